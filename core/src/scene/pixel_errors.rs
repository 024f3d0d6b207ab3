//! Distances in pixels, and the medians of values.

use serde::Serialize;

/// Median error above which poses or cameras are suspicious, in pixels.
const SUSPICIOUS_PX: f64 = 4.0;

/// Distances in pixels between where something is and where it should be.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PixelErrors {
    /// Half of the distances are at most this, in pixels.
    pub median_px: f64,
    /// Nine in ten of the distances are at most this, in pixels.
    pub p90_px: f64,
    /// Number of distances.
    pub count: usize,
}

impl PixelErrors {
    /// Of these distances in pixels, in any order; `None` where there are none.
    pub fn of(mut distances: Vec<f64>) -> Option<Self> {
        distances.sort_by(f64::total_cmp);
        Some(Self {
            median_px: share_below(&distances, 0.5)?,
            p90_px: share_below(&distances, 0.9)?,
            count: distances.len(),
        })
    }

    /// Whether something must be wrong with poses or cameras.
    pub fn is_suspicious(&self) -> bool {
        self.median_px > SUSPICIOUS_PX
    }
}

/// The value that this share, below 1, of sorted values does not exceed; `None` of no values.
fn share_below(sorted: &[f64], share: f64) -> Option<f64> {
    sorted.get((sorted.len() as f64 * share) as usize).copied()
}

/// The median of values, the upper one of two in the middle; `None` of no values.
pub(super) fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    share_below(&values, 0.5)
}
