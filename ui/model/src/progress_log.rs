//! How the labelling went: a log of a few numbers over time and strokes, and the time spent labelling.

use std::time::{Duration, Instant};

use inplace_core::session::Status;
use serde_json::{Value, json};

/// Most samples kept; beyond it every second one is dropped, and they are taken half as often from then on.
const MOST: usize = 2000;
/// Time between samples while there are no new strokes, at first.
const INTERVAL: f64 = 1.0;
/// Without anything done for so long, one is not labelling.
const IDLE: Duration = Duration::from_secs(60);

/// The numbers at one time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ProgressSample {
    /// Seconds that the scene had been open by then, earlier sessions included.
    pub seconds: f64,
    /// Number of strokes.
    pub strokes: usize,
    /// Mean entropy over all pixels, in nats.
    pub entropy: Option<f32>,
    /// Cross-validated accuracy, 0..=1.
    pub accuracy: Option<f32>,
    /// Peak signal-to-noise ratio on held-out frames, in dB.
    pub psnr: Option<f32>,
}

impl ProgressSample {
    fn to_json(self) -> Value {
        // Milliseconds and four digits are more than a chart shows.
        let short = |value: Option<f32>| value.map(|value| (f64::from(value) * 1e4).round() / 1e4);
        json!([
            (self.seconds * 1e3).round() / 1e3,
            self.strokes,
            short(self.entropy),
            short(self.accuracy),
            short(self.psnr),
        ])
    }

    fn from_json(json: &Value) -> Option<Self> {
        let number = |index: usize| json[index].as_f64().map(|value| value as f32);
        Some(Self {
            seconds: json[0].as_f64()?,
            strokes: usize::try_from(json[1].as_u64()?).ok()?,
            entropy: number(2),
            accuracy: number(3),
            psnr: number(4),
        })
    }

    /// All but the time.
    fn numbers(&self) -> (usize, [Option<f32>; 3]) {
        (self.strokes, [self.entropy, self.accuracy, self.psnr])
    }
}

/// The samples of a scene, oldest first.
#[derive(Clone, Debug)]
pub struct ProgressLog {
    /// The samples, oldest first.
    pub samples: Vec<ProgressSample>,
    interval: f64,
    /// When this session's first second began, and the seconds of earlier ones.
    started: Instant,
    before: f64,
    /// Time spent labelling, without breaks.
    pub labelling: Duration,
    last_act: Option<Instant>,
    /// Changes with every sample.
    pub version: u64,
}

impl ProgressLog {
    /// An empty log.
    pub fn new(now: Instant) -> Self {
        Self {
            samples: Vec::new(),
            interval: INTERVAL,
            started: now,
            before: 0.0,
            labelling: Duration::ZERO,
            last_act: None,
            version: 0,
        }
    }

    /// The person did something.
    pub fn acted(&mut self, now: Instant) {
        if let Some(last) = self.last_act {
            let gap = now.saturating_duration_since(last);
            if gap <= IDLE {
                self.labelling += gap;
            }
        }
        self.last_act = Some(now);
    }

    /// Takes a sample if there are other strokes than at the last one, or other numbers and it is time. The log
    /// begins with the first stroke.
    pub fn note(&mut self, now: Instant, strokes: usize, accuracy: Option<f32>, status: &Status) {
        let sample = ProgressSample {
            seconds: self.before + now.saturating_duration_since(self.started).as_secs_f64(),
            strokes,
            entropy: status.mean_entropy,
            accuracy,
            psnr: status.held_out_psnr,
        };
        let wanted = match self.samples.last() {
            None => strokes > 0,
            Some(last) if last.strokes != strokes => true,
            Some(last) => {
                last.numbers() != sample.numbers() && sample.seconds - last.seconds >= self.interval
            }
        };
        if wanted {
            self.samples.push(sample);
            self.thin();
            self.version += 1;
        }
    }

    fn thin(&mut self) {
        if self.samples.len() > MOST {
            // Of an odd number; the first and the last stay.
            let samples = std::mem::take(&mut self.samples);
            self.samples = samples.into_iter().step_by(2).collect();
            self.interval *= 2.0;
        }
    }

    /// As a project keeps it.
    pub fn to_json(&self) -> Value {
        let samples: Vec<Value> = self.samples.iter().map(|sample| sample.to_json()).collect();
        json!({"labelling_s": self.labelling.as_secs_f64(), "samples": samples})
    }

    /// Goes on from a log that was kept; one that says nothing sensible is left out.
    pub fn take_json(&mut self, kept: &Value) {
        let samples = kept["samples"].as_array().into_iter().flatten().take(MOST);
        let samples: Vec<ProgressSample> = samples.filter_map(ProgressSample::from_json).collect();
        if !samples.is_sorted_by(|a, b| a.seconds <= b.seconds) {
            return;
        }
        self.before = samples.last().map_or(0.0, |sample| sample.seconds);
        self.samples = samples;
        let labelling = kept["labelling_s"].as_f64().unwrap_or(0.0);
        self.labelling = Duration::try_from_secs_f64(labelling).unwrap_or_default();
        self.version += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn status(entropy: f32) -> Status {
        Status {
            mean_entropy: Some(entropy),
            held_out_psnr: Some(21.5),
            ..Status::default()
        }
    }

    #[test]
    fn a_log_begins_with_the_first_stroke_and_takes_every_new_one() {
        let start = Instant::now();
        let mut log = ProgressLog::new(start);
        let after = |seconds: f64| start + Duration::from_secs_f64(seconds);
        log.note(after(1.0), 0, None, &status(1.0));
        assert!(log.samples.is_empty());
        log.note(after(2.0), 1, None, &status(0.9));
        log.note(after(2.1), 2, None, &status(0.9));
        log.note(after(2.2), 2, None, &status(0.8));
        log.note(after(9.0), 2, None, &status(0.9));
        log.note(after(9.5), 2, Some(0.5), &status(0.7));
        let samples = log.samples.iter();
        let taken = samples.map(|sample| (sample.strokes, sample.entropy));
        assert!(taken.eq([(1, Some(0.9)), (2, Some(0.9)), (2, Some(0.7))]));
    }

    #[test]
    fn a_long_log_is_thinned_out_and_keeps_its_beginning() {
        let start = Instant::now();
        let mut log = ProgressLog::new(start);
        for index in 0..20_000 {
            let now = start + Duration::from_secs(2 * index);
            log.note(now, 1 + index as usize / 100, None, &status(index as f32));
        }
        assert!(log.samples.len() <= MOST && log.samples.len() > MOST / 3);
        assert_eq!(log.samples[0].strokes, 1);
        assert_eq!(log.samples.last().map(|sample| sample.strokes), Some(200));
    }

    #[test]
    fn breaks_do_not_count_as_labelling() {
        let start = Instant::now();
        let mut log = ProgressLog::new(start);
        for seconds in [0, 20, 50, 500, 510] {
            log.acted(start + Duration::from_secs(seconds));
        }
        assert_eq!(log.labelling, Duration::from_secs(60));
    }

    #[test]
    fn a_log_goes_on_after_reopening() {
        let start = Instant::now();
        let mut log = ProgressLog::new(start);
        log.note(start + Duration::from_secs(8), 3, Some(0.75), &status(0.5));
        log.acted(start);
        log.acted(start + Duration::from_secs(30));
        let later = Instant::now();
        let mut again = ProgressLog::new(later);
        again.take_json(&log.to_json());
        assert_eq!((&again.samples, again.labelling), (&log.samples, log.labelling));
        again.note(later + Duration::from_secs(4), 4, None, &status(0.4));
        assert_eq!(again.samples[1].seconds, 12.0);
        for kept in [
            Value::Null,
            json!([]),
            json!(3),
            json!({"samples": [[5, 1], [2, 1]], "labelling_s": -1}),
        ] {
            let mut log = ProgressLog::new(later);
            log.take_json(&kept);
            assert!(log.samples.is_empty(), "{kept}");
            assert_eq!(log.labelling, Duration::ZERO);
        }
    }
}
