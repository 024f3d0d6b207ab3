//! Where the semantic field is trained and evaluated: points of the surface, and rays.

use std::ops::Range;

use candle_core::Result;
use glam::Vec3;

use crate::field::kernels::Wanted;
use crate::field::{OccupancyGrid, RadianceField, Ray, Samples, Sampling};

/// Samples with a smaller weight in their ray are left out.
const DIM: f32 = 0.02;

/// Points of the surface with their class probabilities, as training targets.
#[derive(Clone, Debug, Default)]
pub struct SoftTargets {
    /// World positions.
    pub positions: Vec<Vec3>,
    /// Probabilities, row-major `[positions, classes]`.
    pub probabilities: Vec<f32>,
    /// Weight of each row by its certainty, 0..=1.
    pub weights: Vec<f32>,
}

/// Rays with class probabilities, as training targets: the class of a stroke, or the probabilities where the ray ends.
#[derive(Clone, Debug, Default)]
pub struct RayTargets {
    /// The rays.
    pub rays: Vec<Ray>,
    /// Probabilities, row-major `[rays, classes]`.
    pub probabilities: Vec<f32>,
    /// Weight of each row by its certainty, 0..=1.
    pub weights: Vec<f32>,
}

impl RayTargets {
    /// Adds others of the same classes.
    pub fn append(&mut self, mut others: Self) {
        self.rays.append(&mut others.rays);
        self.probabilities.append(&mut others.probabilities);
        self.weights.append(&mut others.weights);
    }
}

/// Rows of points whose logits are composited: a row is one point, or the samples of one ray.
#[derive(Clone, Debug)]
pub(super) struct CompositedPlaces {
    /// First sample of each row, and the number of samples at the end: `[rows + 1]`.
    starts: Vec<usize>,
    /// Unit positions of the samples.
    pub positions: Vec<Vec3>,
    /// Share of each sample in its row (w_i of Eq. 1).
    pub shares: Vec<f32>,
}

impl CompositedPlaces {
    /// A row for each world position.
    pub fn at_points(field: &RadianceField, positions: &[Vec3]) -> Self {
        Self {
            starts: (0..=positions.len()).collect(),
            positions: positions.iter().map(|&p| field.volume().to_unit(p)).collect(),
            shares: vec![1.0; positions.len()],
        }
    }

    /// Adds a row for each ray: its samples from which light arrives.
    pub fn add_rays(
        &mut self,
        field: &RadianceField,
        occupancy: &OccupancyGrid,
        rays: &[Ray],
        sampling: Sampling,
    ) -> Result<()> {
        let samples = Samples::along(field, occupancy, rays, sampling)?;
        let density = field.evaluate(&samples, Wanted::default())?.density;
        for ray in 0..rays.len() {
            let own = samples.packing.range(ray);
            for (sample, weight) in own.zip(samples.packing.weights(ray, &density)) {
                if weight >= DIM {
                    self.positions.push(Vec3::from(samples.position(sample)));
                    self.shares.push(weight);
                }
            }
            self.starts.push(self.positions.len());
        }
        Ok(())
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.starts.len() - 1
    }

    /// The samples of some rows.
    pub fn samples(&self, rows: &Range<usize>) -> Range<usize> {
        self.starts[rows.start]..self.starts[rows.end]
    }

    /// For each sample of some rows, the number of its row among them.
    pub fn row_of_samples(&self, rows: &Range<usize>) -> Vec<u32> {
        let of_row = |row: usize| {
            let count = self.starts[row + 1] - self.starts[row];
            std::iter::repeat_n((row - rows.start) as u32, count)
        };
        rows.clone().flat_map(of_row).collect()
    }

    /// The rows in pieces of at most `most` samples and rows, or single rows.
    pub fn pieces(&self, most: usize) -> Vec<Range<usize>> {
        let mut pieces = Vec::new();
        let mut first = 0;
        while first < self.rows() {
            let mut end = first + 1;
            while end < self.rows() && end - first < most && self.starts[end + 1] - self.starts[first] <= most
            {
                end += 1;
            }
            pieces.push(first..end);
            first = end;
        }
        pieces
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_hold_every_row_once_and_few_samples() {
        // Rows of 3, 0, 0, 5, 2 and 1 samples.
        let places = CompositedPlaces {
            starts: vec![0, 3, 3, 3, 8, 10, 11],
            positions: vec![Vec3::ZERO; 11],
            shares: vec![1.0; 11],
        };
        assert_eq!(places.pieces(4), [0..3, 3..4, 4..6]);
        assert_eq!(places.pieces(2), [0..1, 1..3, 3..4, 4..5, 5..6]);
        assert_eq!(places.samples(&(1..4)), 3..8);
        assert_eq!(places.row_of_samples(&(3..6)), [0, 0, 0, 0, 0, 1, 1, 2]);
    }
}
