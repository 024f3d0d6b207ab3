//! Rays and the samples along them.

use glam::Vec3;

use super::kernels::{DIRECTION_FEATURES, RayPacking};
use crate::scene::Frame;

/// A ray through the centre of a pixel.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Start, in metres.
    pub origin: Vec3,
    /// Unit direction.
    pub direction: Vec3,
    /// Length to the surface where it is known, in metres.
    pub length: Option<f32>,
}

impl Ray {
    /// Through the pixel of a frame with this row-major index, as long as its measured depth.
    pub fn through(frame: &Frame, index: usize) -> Self {
        Self {
            origin: frame.center(),
            direction: frame.ray_direction(index),
            length: frame.ray_length(index),
        }
    }
}

/// The samples of a batch of rays.
#[derive(Clone, Debug, Default)]
pub struct Samples {
    /// Where along which ray each sample lies.
    pub packing: RayPacking,
    /// Unit positions, `[N, 3]`.
    pub(super) positions: Vec<f32>,
    /// Spherical harmonics of each ray's direction.
    pub(super) directions: Vec<[f32; DIRECTION_FEATURES]>,
}

impl Samples {
    /// Points in unit coordinates without rays, for evaluations that do not depend on the direction.
    pub fn at_points(points: &[Vec3]) -> Self {
        let mut samples = Self::default();
        samples.refill_points(points.iter().map(Vec3::to_array));
        samples
    }

    /// Does the same as [`Samples::at_points`] in the memory of these samples.
    pub fn refill_points(&mut self, points: impl Iterator<Item = [f32; 3]>) {
        // In portions, so that they can be worked on in parallel.
        const POINTS: usize = 256;
        self.positions.clear();
        self.positions.extend(points.flatten());
        let count = self.positions.len() / 3;
        let packing = &mut self.packing;
        packing.starts.clear();
        let starts = (0..count).step_by(POINTS).chain([count]);
        packing.starts.extend(starts.map(|start| start as u32));
        packing.t.clear();
        packing.t.resize(count, 0.0);
        packing.dt.clear();
        packing.dt.resize(count, 0.0);
        self.directions.clear();
        self.directions.resize(packing.rays(), [0.0; DIRECTION_FEATURES]);
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.packing.samples()
    }

    /// Whether no ray has any sample.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Unit positions of all samples, x, y, z one after another.
    pub fn positions(&self) -> &[f32] {
        &self.positions
    }

    /// Unit position of a sample.
    #[inline(always)]
    pub fn position(&self, sample: usize) -> [f32; 3] {
        std::array::from_fn(|axis| self.positions[3 * sample + axis])
    }

    /// Direction features of a ray.
    pub fn direction(&self, ray: usize) -> &[f32; DIRECTION_FEATURES] {
        &self.directions[ray]
    }
}

/// Real spherical harmonics up to degree 3 of a unit direction.
pub(super) fn direction_features(d: Vec3) -> [f32; DIRECTION_FEATURES] {
    let Vec3 { x, y, z } = d;
    [
        0.282_094_8,
        0.488_602_5 * y,
        0.488_602_5 * z,
        0.488_602_5 * x,
        1.092_548_4 * x * y,
        1.092_548_4 * y * z,
        0.315_391_57 * (3.0 * z * z - 1.0),
        1.092_548_4 * x * z,
        0.546_274_2 * (x * x - y * y),
        0.590_043_6 * y * (3.0 * x * x - y * y),
        2.890_611_4 * x * y * z,
        0.457_045_8 * y * (5.0 * z * z - 1.0),
        0.373_176_33 * z * (5.0 * z * z - 3.0),
        0.457_045_8 * x * (5.0 * z * z - 1.0),
        1.445_305_7 * z * (x * x - y * y),
        0.590_043_6 * x * (x * x - 3.0 * y * y),
    ]
}
