//! The metrics of semantic segmentation, over one confusion matrix for all evaluated frames.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use super::EvalError;
use inplace_core::labels::{ClassId, VOID};

/// How many pixels of each true class were given each predicted class.
///
/// Pixels whose truth is void are dropped; predicting void where there is a truth is an error. Sparse,
/// as ids may be any 16-bit number.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ConfusionMatrix {
    /// Pixels by (true class, predicted class).
    counts: BTreeMap<(ClassId, ClassId), u64>,
}

/// The three usual summaries, each 0..=1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scores {
    /// Mean over the classes present in the truth of intersection over union.
    pub miou: f64,
    /// Mean over the classes present in the truth of the share of their pixels that is right.
    pub average_accuracy: f64,
    /// Share of all pixels that is right.
    pub total_accuracy: f64,
}

impl ConfusionMatrix {
    /// Counts the pixels of one frame.
    ///
    /// # Errors
    /// [`EvalError::Size`] when the two have not the same number of pixels; then nothing is counted.
    pub fn add(&mut self, truth: &[ClassId], predicted: &[ClassId]) -> Result<(), EvalError> {
        if truth.len() != predicted.len() {
            return Err(EvalError::Size {
                truth: truth.len(),
                predicted: predicted.len(),
            });
        }
        // Label maps consist of runs: one look-up for each run, not for each pixel.
        let pairs: Vec<(ClassId, ClassId)> = truth.iter().copied().zip(predicted.iter().copied()).collect();
        for run in pairs.chunk_by(|a, b| a == b) {
            if run[0].0 != VOID {
                *self.counts.entry(run[0]).or_default() += run.len() as u64;
            }
        }
        Ok(())
    }

    /// Pixels of a true class that were given a predicted class.
    pub fn count(&self, truth: ClassId, predicted: ClassId) -> u64 {
        self.counts.get(&(truth, predicted)).copied().unwrap_or(0)
    }

    /// Number of pixels with a truth.
    pub fn pixels(&self) -> u64 {
        self.counts.values().sum()
    }

    /// The classes present in the truth, ascending.
    pub fn classes(&self) -> Vec<ClassId> {
        let classes: BTreeSet<ClassId> = self.counts.keys().map(|&(truth, _)| truth).collect();
        classes.into_iter().collect()
    }

    /// Intersection over union of a class; `None` when it is neither in the truth nor predicted.
    pub fn iou(&self, class: ClassId) -> Option<f64> {
        let union = self.sum(|truth, predicted| truth == class || predicted == class);
        ratio(self.count(class, class), union)
    }

    /// Share of a class's pixels that is right; `None` when it is not in the truth.
    pub fn accuracy(&self, class: ClassId) -> Option<f64> {
        ratio(self.count(class, class), self.sum(|truth, _| truth == class))
    }

    /// Mean intersection over union over the classes present in the truth; `None` without pixels.
    pub fn miou(&self) -> Option<f64> {
        self.mean(|class| self.iou(class))
    }

    /// Mean over the classes present in the truth of their accuracy; `None` without pixels.
    pub fn average_accuracy(&self) -> Option<f64> {
        self.mean(|class| self.accuracy(class))
    }

    /// Share of all pixels that is right; `None` without pixels.
    pub fn total_accuracy(&self) -> Option<f64> {
        ratio(self.sum(|truth, predicted| truth == predicted), self.pixels())
    }

    /// All summaries; `None` without pixels.
    pub fn scores(&self) -> Option<Scores> {
        Some(Scores {
            miou: self.miou()?,
            average_accuracy: self.average_accuracy()?,
            total_accuracy: self.total_accuracy()?,
        })
    }

    fn sum(&self, counts: impl Fn(ClassId, ClassId) -> bool) -> u64 {
        let chosen = self.counts.iter().filter(|&(&(t, p), _)| counts(t, p));
        chosen.map(|(_, &count)| count).sum()
    }

    fn mean(&self, value: impl Fn(ClassId) -> Option<f64>) -> Option<f64> {
        let values: Vec<f64> = self.classes().into_iter().filter_map(value).collect();
        (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
    }
}

fn ratio(part: u64, whole: u64) -> Option<f64> {
    (whole > 0).then(|| part as f64 / whole as f64)
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
    fn matrix() -> ConfusionMatrix {
        let mut matrix = ConfusionMatrix::default();
        matrix.add(&[0, 1, 1, 1, 1, 1], &[1, 1, 1, 1, 2, 0]).unwrap();
        matrix.add(&[2, 2, 2, 0], &[2, 2, 3, 0]).unwrap();
        matrix
    }

    #[test]
    fn scores_agree_with_a_matrix_worked_out_by_hand() {
        let matrix = matrix();
        assert_eq!(matrix.pixels(), 8);
        assert_eq!(matrix.classes(), [1, 2]);
        assert_eq!(matrix.iou(1), Some(3.0 / 5.0));
        assert_eq!(matrix.iou(2), Some(2.0 / 4.0));
        assert_eq!(matrix.iou(3), Some(0.0));
        assert_eq!(matrix.iou(9), None);
        let scores = matrix.scores().unwrap();
        assert!((scores.miou - 0.55).abs() < 1e-12);
        assert!((scores.average_accuracy - (3.0 / 5.0 + 2.0 / 3.0) / 2.0).abs() < 1e-12);
        assert!((scores.total_accuracy - 5.0 / 8.0).abs() < 1e-12);
        assert_eq!(ConfusionMatrix::default().scores(), None);
    }

    #[test]
    fn unequal_sizes_are_refused_and_count_nothing() {
        let mut matrix = matrix();
        assert!(matrix.add(&[1], &[1, 1]).is_err());
        assert_eq!(matrix.pixels(), 8);
    }
}
