//! The metrics of semantic segmentation, over one confusion matrix for all evaluated frames.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use super::{Failure, mean, unless_equal};
use inplace_core::labels::{ClassId, VOID};
use inplace_core::semantics::insides;

/// How many pixels of each true class were given each predicted class.
///
/// Pixels whose truth is void are dropped; predicting void where there is a truth is an error. Sparse,
/// as ids may be any 16-bit number.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ConfusionMatrix {
    /// Pixels by (true class, predicted class).
    counts: BTreeMap<(ClassId, ClassId), u64>,
}

/// Width of the band along borders, as a share of an image's diagonal.
const BAND: f64 = 0.02;

/// The pixels along the borders of each class, in the truth and in the maps.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Borders {
    /// Pixels along the true borders of a class.
    truth: BTreeMap<ClassId, u64>,
    /// Those along the borders of a class in either, and in both.
    either: BTreeMap<ClassId, u64>,
    both: BTreeMap<ClassId, u64>,
}

impl Borders {
    /// Counts the pixels of one frame of this width. Where the truth is void nothing is counted.
    pub fn add(&mut self, truth: &[ClassId], predicted: &[ClassId], width: usize) {
        let height = truth.len() / width.max(1);
        let reach = (BAND * (width as f64).hypot(height as f64)).round().max(1.0) as u32;
        let along = |labels: &[ClassId]| -> Vec<Option<ClassId>> {
            let insides = insides(labels, width).into_iter();
            let label = |(&label, inside)| (label != VOID && inside <= reach).then_some(label);
            labels.iter().zip(insides).map(label).collect()
        };
        let pairs = along(truth).into_iter().zip(along(predicted)).zip(truth);
        for ((own, other), _) in pairs.filter(|(_, truth)| **truth != VOID) {
            if let Some(class) = own {
                *self.truth.entry(class).or_default() += 1;
                *self.either.entry(class).or_default() += 1;
            }
            if let Some(class) = other {
                let counts = if own == other {
                    &mut self.both
                } else {
                    &mut self.either
                };
                *counts.entry(class).or_default() += 1;
            }
        }
    }

    /// Boundary mIoU (Cheng et al. 2021): the intersection over union of the pixels at most 2% of the diagonal inside a
    /// class, in the truth and in the maps; the mean over the classes of the truth.
    pub fn miou(&self) -> Option<f64> {
        let iou = |class| *self.both.get(class).unwrap_or(&0) as f64 / self.either[class] as f64;
        (!self.truth.is_empty()).then(|| mean(self.truth.keys().map(iou)))
    }
}

/// The usual summaries, each 0..=1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scores {
    /// Mean over the classes present in the truth of intersection over union.
    pub miou: f64,
    /// Mean over the classes present in the truth of the share of their pixels that is right.
    pub average_accuracy: f64,
    /// Share of all pixels that is right.
    pub total_accuracy: f64,
    /// Boundary mIoU (Cheng et al. 2021); `None` where nothing tells which pixels are beside each other.
    pub boundary_miou: Option<f64>,
}

impl ConfusionMatrix {
    /// Counts the pixels of one frame.
    ///
    /// # Errors
    /// When the two have not the same number of pixels; then nothing is counted.
    pub fn add(&mut self, truth: &[ClassId], predicted: &[ClassId]) -> Result<(), Failure> {
        unless_equal(truth.len(), predicted.len())?;
        // Label maps consist of runs: one look-up for each run, not for each pixel.
        let pairs: Vec<(ClassId, ClassId)> = truth.iter().copied().zip(predicted.iter().copied()).collect();
        for run in pairs.chunk_by(|a, b| a == b) {
            if run[0].0 != VOID {
                *self.counts.entry(run[0]).or_default() += run.len() as u64;
            }
        }
        Ok(())
    }

    /// Mean intersection over union over the classes present in the truth; `None` without pixels.
    pub fn miou(&self) -> Option<f64> {
        Some(self.scores()?.miou)
    }

    /// All summaries; `None` without pixels.
    pub fn scores(&self) -> Option<Scores> {
        let classes: BTreeSet<ClassId> = self.counts.keys().map(|&(truth, _)| truth).collect();
        if classes.is_empty() {
            return None;
        }
        let mean = |value: &dyn Fn(ClassId) -> f64| mean(classes.iter().map(|&class| value(class)));
        let right = |class| self.sum(|truth, predicted| truth == class && predicted == class);
        let union = |class| self.sum(|truth, predicted| truth == class || predicted == class);
        let shown = |class| self.sum(|truth, _| truth == class);
        Some(Scores {
            miou: mean(&|class| right(class) / union(class)),
            average_accuracy: mean(&|class| right(class) / shown(class)),
            total_accuracy: self.sum(|truth, predicted| truth == predicted) / self.sum(|_, _| true),
            boundary_miou: None,
        })
    }

    /// Number of the pixels whose true and predicted class are counted.
    fn sum(&self, counts: impl Fn(ClassId, ClassId) -> bool) -> f64 {
        let chosen = self.counts.iter().filter(|&(&(t, p), _)| counts(t, p));
        chosen.map(|(_, &count)| count).sum::<u64>() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows are truth, columns predictions of 0, 1, 2, 3 (worked out by hand):
    ///
    /// ```text
    ///      0  1  2  3
    /// 0    -  -  -  -    two pixels, dropped
    /// 1    1  3  1  0    IoU 3 / 5
    /// 2    0  0  2  1    IoU 2 / 4
    /// ```
    #[test]
    fn scores_agree_with_a_matrix_worked_out_by_hand_and_unequal_sizes_are_refused() {
        let mut matrix = ConfusionMatrix::default();
        assert_eq!(matrix.scores(), None);
        matrix.add(&[0, 1, 1, 1, 1, 1], &[1, 1, 1, 1, 2, 0]).unwrap();
        matrix.add(&[2, 2, 2, 0], &[2, 2, 3, 0]).unwrap();
        assert!(matrix.add(&[1], &[1, 1]).is_err());
        let scores = matrix.scores().unwrap();
        assert!((scores.miou - (3.0 / 5.0 + 2.0 / 4.0) / 2.0).abs() < 1e-12);
        assert!((scores.average_accuracy - (3.0 / 5.0 + 2.0 / 3.0) / 2.0).abs() < 1e-12);
        assert!((scores.total_accuracy - 5.0 / 8.0).abs() < 1e-12);
    }

    #[test]
    fn along_borders_a_shift_counts_as_much_as_the_band_is_wide_and_the_inside_nothing() {
        // 80 x 60 pixels: a band of 2. Class 1 is left of column 40, in the map of column 41.
        let halves = |border: usize| -> Vec<ClassId> {
            (0..80 * 60)
                .map(|pixel| 1 + ClassId::from(pixel % 80 >= border))
                .collect()
        };
        let mut borders = Borders::default();
        assert_eq!(borders.miou(), None);
        borders.add(&halves(40), &halves(40), 80);
        assert_eq!(borders.miou(), Some(1.0));
        let mut borders = Borders::default();
        borders.add(&halves(40), &halves(41), 80);
        // Each class is 384 pixels; of those of the map, 388 and 380, these are the same.
        let expected = 0.5 * (328.0 / (384.0 + 388.0 - 328.0) + 324.0 / (384.0 + 380.0 - 324.0));
        assert!((borders.miou().unwrap() - expected).abs() < 1e-12);
    }
}
