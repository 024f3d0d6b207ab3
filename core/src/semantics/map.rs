//! Dense label maps.

use crate::labels::{ClassId, VOID};

/// Steps of [`FrameMap::entropy`] per nat.
pub const ENTROPY_STEPS_PER_NAT: f32 = 10_000.0;

/// Dense labels of one frame, row-major `[height, width]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameMap {
    /// Index of the frame.
    pub frame: usize,
    /// Generation of the labels it was made from.
    pub generation: u64,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Most likely class of every pixel; void where nothing is known or the person said so.
    pub labels: Vec<ClassId>,
    /// Entropy of every pixel's class distribution, in nats times [`ENTROPY_STEPS_PER_NAT`].
    pub entropy: Vec<u16>,
}

impl FrameMap {
    /// Mean entropy over all pixels, in nats.
    pub fn mean_entropy(&self) -> f32 {
        let sum: u64 = self.entropy.iter().map(|&e| u64::from(e)).sum();
        sum as f32 / self.entropy.len().max(1) as f32 / ENTROPY_STEPS_PER_NAT
    }

    /// Share of the pixels that have a class, 0..=1.
    pub fn coverage(&self) -> f32 {
        let labelled = self.labels.iter().filter(|&&label| label != VOID).count();
        labelled as f32 / self.labels.len().max(1) as f32
    }
}
