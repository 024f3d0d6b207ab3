//! Whether the probabilities of maps are right.

use serde::ser::SerializeStruct;
use serde::{Serialize, Serializer};

use super::{Failure, unless_equal};
use inplace_core::labels::{ClassId, VOID};
use inplace_core::semantics::CERTAIN;

/// Number of bins, of equal width in confidence.
const BINS: usize = 15;
/// Pixels that are at least this likely should hardly ever be wrong.
const SURE: f64 = 0.99;

/// How often the most likely class is right, by how likely it is said to be (Guo et al., "On Calibration of
/// Modern Neural Networks", ICML 2017).
///
/// Pixels whose truth is void are dropped.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Calibration {
    bins: [Bin; BINS],
    /// The pixels that are [`SURE`].
    sure: Bin,
}

/// The pixels of similar confidence.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Bin {
    pixels: u64,
    right: u64,
    /// Sum of the confidences, each times [`CERTAIN`].
    confidence: u64,
}

impl Bin {
    fn confidence(&self) -> f64 {
        self.confidence as f64 / f64::from(CERTAIN)
    }

    fn add(&mut self, more: &Self) {
        self.pixels += more.pixels;
        self.right += more.right;
        self.confidence += more.confidence;
    }
}

impl Calibration {
    /// Counts the pixels of one frame; `confidence` as in [`FrameMap::confidence`](inplace_core::semantics::FrameMap::confidence).
    ///
    /// # Errors
    /// When the three have not the same number of pixels; then nothing is counted.
    pub fn add(
        &mut self,
        truth: &[ClassId],
        predicted: &[ClassId],
        confidence: &[u16],
    ) -> Result<(), Failure> {
        unless_equal(truth.len(), predicted.len())?;
        unless_equal(truth.len(), confidence.len())?;
        for ((&truth, &predicted), &confidence) in truth.iter().zip(predicted).zip(confidence) {
            if truth == VOID {
                continue;
            }
            // The bins are open below: what is certain is in the last one.
            let bin = (usize::from(confidence) * BINS).div_ceil(usize::from(CERTAIN));
            let pixel = Bin {
                pixels: 1,
                right: u64::from(truth == predicted),
                confidence: confidence.into(),
            };
            self.bins[bin.saturating_sub(1)].add(&pixel);
            if pixel.confidence() >= SURE {
                self.sure.add(&pixel);
            }
        }
        Ok(())
    }

    /// The expected calibration error (Guo et al., Eq. 3), 0..=1: the mean over all pixels of how far accuracy and
    /// mean confidence of their bin are apart. `None` without pixels.
    pub fn error(&self) -> Option<f64> {
        let pixels: u64 = self.bins.iter().map(|bin| bin.pixels).sum();
        let apart = |bin: &Bin| (bin.right as f64 - bin.confidence()).abs();
        let apart = self.bins.iter().map(apart);
        (pixels > 0).then(|| apart.sum::<f64>() / pixels as f64)
    }

    /// The share of the pixels that are at least [`SURE`] which is right, 0..=1. `None` where none is so sure.
    pub fn right_if_sure(&self) -> Option<f64> {
        (self.sure.pixels > 0).then(|| self.sure.right as f64 / self.sure.pixels as f64)
    }
}

/// As its figures.
impl Serialize for Calibration {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut figures = serializer.serialize_struct("Calibration", 2)?;
        figures.serialize_field("ece", &self.error())?;
        figures.serialize_field("right_if_sure", &self.right_if_sure())?;
        figures.end()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four pixels of confidence 0.9 of which two are right, one of 0.5 that is wrong, one that is certain and
    /// right, and a void one.
    fn calibration() -> Calibration {
        let mut calibration = Calibration::default();
        let steps = |probability: f64| (probability * f64::from(CERTAIN)).round() as u16;
        let confidence = [0.9, 0.9, 0.9, 0.9, 0.5, 1.0, 0.7].map(steps);
        let added = calibration.add(&[1, 1, 2, 2, 3, 3, 0], &[1, 2, 1, 2, 1, 3, 1], &confidence);
        added.unwrap();
        calibration
    }

    #[test]
    fn the_error_agrees_with_one_worked_out_by_hand() {
        let calibration = calibration();
        let error = (4.0 * (0.9 - 0.5) + 0.5) / 6.0;
        assert!((calibration.error().unwrap() - error).abs() < 1e-4);
        assert_eq!(Calibration::default().error(), None);
        assert_eq!(Calibration::default().right_if_sure(), None);
    }

    #[test]
    fn unequal_sizes_are_refused_and_probabilities_at_the_ends_have_a_bin() {
        assert!(calibration().add(&[1], &[1], &[1, 2]).is_err());
        assert!(calibration().add(&[1], &[1, 1], &[1]).is_err());
        let mut ends = Calibration::default();
        ends.add(&[1, 1], &[1, 0], &[CERTAIN, 0]).unwrap();
        assert_eq!(ends.error(), Some(0.0));
        ends.add(&[1], &[2], &[CERTAIN]).unwrap();
        assert_eq!(ends.right_if_sure(), Some(0.5));
    }
}
