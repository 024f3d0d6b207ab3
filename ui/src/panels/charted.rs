//! What the charts of the progress show: the log by its horizontal axis, kept until there is more of it.

use std::ops::RangeInclusive;

use egui_plot::PlotPoint;
use inplace_model::progress_log::{ProgressLog, ProgressSample};

/// Most marks drawn: nearer to each other than this share of the axis, they are one.
const MARKS: f64 = 100.0;

/// The horizontal axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Axis {
    /// Minutes that the scene was open.
    #[default]
    Time,
    /// Strokes.
    Strokes,
}

/// What is charted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Number {
    /// Mean entropy, as a share of that of an even guess among all classes.
    Unsure,
    /// Cross-validated accuracy, 0..=1.
    Accuracy,
    /// Image quality, in dB.
    Psnr,
}

/// All of them, in the order shown.
pub const NUMBERS: [Number; 3] = [Number::Unsure, Number::Accuracy, Number::Psnr];

impl Number {
    /// The number at one time; `most` is the entropy of an even guess among all classes, in nats.
    fn of(self, sample: &ProgressSample, most: f32) -> Option<f64> {
        let value = match self {
            Self::Unsure => sample.entropy.map(|entropy| entropy / most),
            Self::Accuracy => sample.accuracy,
            Self::Psnr => sample.psnr,
        };
        value.filter(|value| value.is_finite()).map(f64::from)
    }
}

/// The lines of the charts.
#[derive(Clone, Debug, Default)]
pub struct Charted {
    /// What they were made from: the version of the log, the axis, and the largest entropy.
    from: Option<(u64, Axis, f32)>,
    lines: [Vec<PlotPoint>; NUMBERS.len()],
    /// Where strokes were made, over time.
    pub marks: Vec<f64>,
    last: f64,
}

impl Charted {
    /// Follows a scene's log, where `most` is the entropy of an even guess among all classes, in nats; costs nothing where
    /// nothing has changed.
    pub fn follow(&mut self, log: &ProgressLog, axis: Axis, most: f32) {
        let from = Some((log.version, axis, most));
        if self.from == from {
            return;
        }
        self.from = from;
        let samples = &log.samples;
        let x = |sample: &ProgressSample| match axis {
            Axis::Time => sample.seconds / 60.0,
            Axis::Strokes => sample.strokes as f64,
        };
        self.last = samples.iter().map(x).fold(0.0, f64::max);
        for (line, number) in self.lines.iter_mut().zip(NUMBERS) {
            let points = samples
                .iter()
                .filter_map(|sample| Some((sample, number.of(sample, most)?)));
            *line = match axis {
                Axis::Time => points.map(|(sample, y)| PlotPoint::new(x(sample), y)).collect(),
                Axis::Strokes => {
                    // What came of each number of strokes in the end.
                    let newest: std::collections::BTreeMap<usize, f64> =
                        points.map(|(sample, y)| (sample.strokes, y)).collect();
                    let points = newest.into_iter();
                    points
                        .map(|(strokes, y)| PlotPoint::new(strokes as f64, y))
                        .collect()
                }
            };
        }
        self.marks.clear();
        if axis == Axis::Time {
            let apart = self.last / MARKS;
            let mut strokes = 0;
            for sample in samples {
                let far = self.marks.last().is_none_or(|&mark| x(sample) - mark >= apart);
                if sample.strokes != strokes && far {
                    self.marks.push(x(sample));
                }
                strokes = sample.strokes;
            }
        }
    }

    /// The points of a number.
    pub fn line(&self, number: Number) -> &[PlotPoint] {
        &self.lines[number as usize]
    }

    /// What the horizontal axis spans.
    pub fn range(&self) -> RangeInclusive<f64> {
        0.0..=self.last
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use inplace_core::session::Status;
    use std::time::{Duration, Instant};

    #[test]
    fn the_log_is_charted_over_time_and_over_strokes() {
        let start = Instant::now();
        let mut log = ProgressLog::new(start);
        for (seconds, strokes, entropy, accuracy) in [
            (0, 1, 0.9, None),
            (60, 1, 0.8, None),
            (120, 2, 0.5, Some(0.5)),
            (180, 2, 0.4, Some(0.5)),
        ] {
            let status = Status {
                mean_entropy: Some(entropy),
                ..Status::default()
            };
            log.note(start + Duration::from_secs(seconds), strokes, accuracy, &status);
        }
        let mut charted = Charted::default();
        charted.follow(&log, Axis::Time, 2.0);
        let minutes = |number: Number| -> Vec<f64> { charted.line(number).iter().map(|p| p.x).collect() };
        assert_eq!(minutes(Number::Unsure), [0.0, 1.0, 2.0, 3.0]);
        assert_eq!(minutes(Number::Accuracy), [2.0, 3.0]);
        assert!(charted.line(Number::Psnr).is_empty());
        assert_eq!(charted.marks, [0.0, 2.0]);
        charted.follow(&log, Axis::Strokes, 2.0);
        let points: Vec<f64> = charted.line(Number::Unsure).iter().map(|p| p.x).collect();
        assert_eq!(points, [1.0, 2.0]);
        let last = charted.line(Number::Unsure)[1].y;
        assert!((last - 0.2).abs() < 1e-6 && charted.marks.is_empty());
    }
}
