//! Semantic-NeRF as published (Zhi et al., ICCV 2021): one network for colour, density and class logits,
//! on plain candle ops. It is what the fast field is compared with.
//!
//! Layout and constants are those of the paper and of the authors' code. Three things differ, as described there: the
//! far end of the rays, the share of labelled rays where few pixels are labelled, and that gradients are summed over
//! small pieces of a batch.

mod compositing;
mod encoding;
mod labels;
mod loss;
mod network;
mod render;
mod sampling;
mod train;

use std::fmt;

use candle_core::Device;

pub use compositing::{composite, entropy, ray_weights};
pub use encoding::positional_encoding;
pub use labels::PixelLabels;
pub use loss::{photometric, semantic};
pub use network::{Prediction, ReferenceNetwork};
pub use render::{Composited, ReferenceField, ReferenceRay};
pub use sampling::{inverse_cdf, stratified};
pub use train::ReferenceTrainer;

/// Sizes and rates. [`ReferenceSettings::PUBLISHED`] is the paper's; tests use smaller ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReferenceSettings {
    /// Layers of the trunk.
    pub layers: usize,
    /// Width of the trunk; the view and semantic branches are half as wide.
    pub width: usize,
    /// The encoded position is given again to the layer after this one, counted from 0.
    pub skip: usize,
    /// Frequencies of the encoded position.
    pub position_frequencies: usize,
    /// Frequencies of the encoded viewing direction.
    pub direction_frequencies: usize,
    /// Positions are divided by this many metres before they are encoded.
    pub position_scale: f64,
    /// Samples of the coarse network.
    pub coarse_samples: usize,
    /// Samples added for the fine network, which sees those of the coarse one too.
    pub fine_samples: usize,
    /// Standard deviation of the noise on the raw density in training, per metre.
    pub density_noise: f32,
    /// Rays of a step.
    pub rays: usize,
    /// Of these, as many see a labelled pixel as long as there is any; see [`ReferenceTrainer`].
    pub labelled_rays: usize,
    /// Weight of the semantic loss (lambda in Eq. 8).
    pub semantic_weight: f64,
    /// Adam's learning rate at the start.
    pub learning_rate: f64,
    /// Steps over which the learning rate falls to a tenth.
    pub decay_steps: f64,
    /// Steps of a whole training.
    pub steps: u64,
    /// Nearest sample, in metres.
    pub near: f32,
    /// Rays of one piece of work ([`ReferenceTrainer::advance`]), between which a step can be interrupted.
    pub slice: usize,
    /// Rays of one computation graph, of which a slice works on several in parallel. On a CPU one: its
    /// activations stay in the cache, and its operations are too small for candle to split them among
    /// threads of its own, which spin while they wait. Another device wants a whole slice.
    pub chunk: usize,
}

impl ReferenceSettings {
    /// As published, with pieces for a CPU.
    pub const PUBLISHED: Self = Self {
        layers: 8,
        width: 256,
        skip: 4,
        position_frequencies: 10,
        direction_frequencies: 4,
        position_scale: 10.0,
        coarse_samples: 64,
        fine_samples: 128,
        density_noise: 1.0,
        rays: 1024,
        labelled_rays: 128,
        semantic_weight: 0.04,
        learning_rate: 5e-4,
        decay_steps: 250_000.0,
        steps: 200_000,
        near: 0.1,
        slice: 8,
        chunk: 1,
    };

    /// As published, with pieces that fit a device.
    pub fn published(device: &Device) -> Self {
        if device.is_cpu() {
            return Self::PUBLISHED;
        }
        // About three gigabytes of activations.
        Self {
            slice: 256,
            chunk: 256,
            ..Self::PUBLISHED
        }
    }

    /// Network evaluations that a ray takes: the coarse samples, and both kinds again in the fine network.
    pub fn evaluations_per_ray(&self) -> usize {
        2 * self.coarse_samples + self.fine_samples
    }
}

impl fmt::Display for ReferenceSettings {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            formatter,
            "Semantic-NeRF, coarse and fine networks of {} layers of {} units, {} + {} samples a ray",
            self.layers, self.width, self.coarse_samples, self.fine_samples
        )
    }
}

#[cfg(test)]
mod tests;
