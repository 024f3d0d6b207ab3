//! Principal components (Pearson 1901), by subspace iteration.

use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};

use super::dot;

/// Rounds of the iteration: components are only wanted as far as they hold most of the variance.
const ROUNDS: usize = 8;

/// Principal components of vectors, and their mean.
pub(super) struct Components {
    mean: Vec<f32>,
    /// Unit vectors, row-major `[components, dimensions]`.
    axes: Vec<f32>,
}

impl Components {
    /// The first `count` components of `vectors`, row-major `[n, dimensions]`.
    pub(super) fn of(vectors: &[f32], dimensions: usize, count: usize) -> Self {
        let rows = || vectors.chunks_exact(dimensions);
        let scale = 1.0 / rows().len().max(1) as f32;
        let mut mean = vec![0.0; dimensions];
        for row in rows() {
            mean.iter_mut()
                .zip(row)
                .for_each(|(mean, value)| *mean += scale * value);
        }
        let mut covariance = vec![0.0; dimensions * dimensions];
        let mut centred = vec![0.0; dimensions];
        for row in rows() {
            centred
                .iter_mut()
                .zip(row)
                .zip(&mean)
                .for_each(|((own, value), mean)| *own = value - mean);
            for (line, &value) in covariance.chunks_exact_mut(dimensions).zip(&centred) {
                line.iter_mut()
                    .zip(&centred)
                    .for_each(|(sum, other)| *sum += scale * value * other);
            }
        }
        // Any start will do that is not across a component.
        let mut random = StdRng::seed_from_u64(0);
        let mut axes: Vec<f32> = (0..count * dimensions)
            .map(|_| random.random_range(-1.0..1.0))
            .collect();
        orthonormalise(&mut axes, dimensions);
        for _ in 0..ROUNDS {
            axes = axes
                .chunks_exact(dimensions)
                .flat_map(|axis| {
                    covariance
                        .chunks_exact(dimensions)
                        .map(move |line| dot(line, axis))
                })
                .collect();
            orthonormalise(&mut axes, dimensions);
        }
        Self { mean, axes }
    }

    /// The coordinates of a vector along the components.
    pub(super) fn project<'a>(&'a self, vector: &'a [f32]) -> impl Iterator<Item = f32> + 'a {
        let along = |axis: &[f32]| {
            let centred = vector.iter().zip(&self.mean).map(|(value, mean)| value - mean);
            axis.iter().zip(centred).map(|(a, b)| a * b).sum()
        };
        self.axes.chunks_exact(self.mean.len()).map(along)
    }
}

/// Gram and Schmidt's; what depends on the vectors before becomes zero.
fn orthonormalise(axes: &mut [f32], dimensions: usize) {
    for at in (0..axes.len()).step_by(dimensions) {
        let (before, rest) = axes.split_at_mut(at);
        let own = &mut rest[..dimensions];
        let was = dot(own, own);
        for other in before.chunks_exact(dimensions) {
            let along = dot(own, other);
            own.iter_mut()
                .zip(other)
                .for_each(|(own, other)| *own -= along * other);
        }
        let square = dot(own, own);
        let is_new = square > 1e-8 * was;
        let scale = if is_new { square.sqrt().recip() } else { 0.0 };
        own.iter_mut().for_each(|own| *own *= scale);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_directions_of_a_cloud_come_first_and_there_are_no_more_than_it_has() {
        // Most along (1, 1, 0), less along (0, 0, 1), nothing across both.
        let steps = [-2.0_f32, -1.0, 1.0, 2.0];
        let point = |long: f32, short: f32| [5.0 + 3.0 * long, 3.0 * long, short];
        let cloud: Vec<f32> = steps
            .iter()
            .flat_map(|&a| steps.iter().flat_map(move |&b| point(a, b)))
            .collect();
        let components = Components::of(&cloud, 3, 3);
        let along: Vec<f32> = components.project(&point(1.0, 2.0)).collect();
        assert!((along[0].abs() - 18_f32.sqrt()).abs() < 1e-3, "{along:?}");
        assert!((along[1].abs() - 2.0).abs() < 1e-3, "{along:?}");
        assert!(along[2].abs() < 1e-3, "{along:?}");
    }
}
