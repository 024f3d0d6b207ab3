//! Rays and the samples along them.

use glam::Vec3;
use rand::{Rng, SeedableRng, rngs::SmallRng};
use rayon::prelude::*;

use super::kernels::DIRECTION_FEATURES;
use super::kernels::RayPacking;
use super::model::direction_features;
use super::{OccupancyGrid, Volume};

/// Nothing is sampled nearer to the camera, in metres: density there explains noise, not the scene.
const NEAR: f32 = 0.1;
/// Most samples of one ray.
const MOST_SAMPLES: usize = 512;

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

/// How rays are sampled.
#[derive(Clone, Copy, Debug)]
pub struct Sampling {
    /// Distance between samples where the surface is not known, in metres.
    pub step: f32,
    /// Samples in front of a known surface.
    pub free: usize,
    /// Samples around a known surface.
    pub near_surface: usize,
    /// Random offsets inside each interval, from this seed; `None` = interval centres.
    pub jitter: Option<u64>,
}

/// The samples of a batch of rays.
#[derive(Clone, Debug)]
pub struct Samples {
    /// Where along which ray each sample lies.
    pub packing: RayPacking,
    /// Unit positions, `[N, 3]`.
    positions: Vec<f32>,
    /// Spherical harmonics of each ray's direction.
    directions: Vec<[f32; DIRECTION_FEATURES]>,
}

impl Samples {
    /// Samples rays in a volume, skipping what the grid knows to be empty.
    ///
    /// A ray of known length is sampled evenly up to the surface and densely around it (more widely the
    /// farther it is, as sensors are), and not behind it.
    pub fn along(rays: &[Ray], volume: &Volume, occupancy: &OccupancyGrid, sampling: Sampling) -> Self {
        let per_ray: Vec<Vec<(f32, f32)>> = rays
            .par_iter()
            .enumerate()
            .with_min_len(64)
            .map(|(number, ray)| {
                let mut rng = sampling
                    .jitter
                    .map(|seed| SmallRng::seed_from_u64(seed.wrapping_add(number as u64 * 0x9e37_79b9)));
                let mut offset = || rng.as_mut().map_or(0.5, |rng| rng.random::<f32>());
                match ray.length {
                    Some(length) => guided(length, sampling, &mut offset),
                    None => marched(ray, volume, occupancy, sampling.step, &mut offset),
                }
            })
            .collect();

        let total = per_ray.iter().map(Vec::len).sum();
        let mut packing = RayPacking {
            starts: Vec::with_capacity(rays.len() + 1),
            t: Vec::with_capacity(total),
            dt: Vec::with_capacity(total),
            ..RayPacking::default()
        };
        let mut positions = Vec::with_capacity(3 * total);
        let mut directions = Vec::with_capacity(rays.len());
        for (ray, samples) in rays.iter().zip(per_ray) {
            packing.starts.push(packing.t.len() as u32);
            directions.push(direction_features(ray.direction));
            for (t, dt) in samples {
                packing.t.push(t);
                packing.dt.push(dt);
                let unit = volume.to_unit(ray.origin + t * ray.direction);
                positions.extend_from_slice(&unit.to_array());
            }
        }
        packing.starts.push(packing.t.len() as u32);
        Self {
            packing,
            positions,
            directions,
        }
    }

    /// Points without rays, given in unit coordinates: for what does not depend on the direction.
    pub fn at_points(points: &[Vec3]) -> Self {
        // In portions, so that they can be worked on in parallel.
        const PORTION: usize = 256;
        let starts = (0..points.len())
            .step_by(PORTION)
            .chain([points.len()])
            .map(|start| start as u32);
        let packing = RayPacking {
            starts: starts.collect(),
            t: vec![0.0; points.len()],
            dt: vec![0.0; points.len()],
            ..RayPacking::default()
        };
        Self {
            directions: vec![[0.0; DIRECTION_FEATURES]; packing.rays()],
            positions: points.iter().flat_map(Vec3::to_array).collect(),
            packing,
        }
    }

    /// The same rays with only their first `counts[ray]` samples each.
    pub fn truncated(&self, counts: &[usize]) -> Self {
        let kept = (0..self.packing.rays()).map(|ray| {
            let range = self.packing.range(ray);
            range.start..range.end.min(range.start + counts[ray])
        });
        let mut packing = RayPacking {
            gradient_ramp: self.packing.gradient_ramp,
            ..RayPacking::default()
        };
        let mut positions = Vec::new();
        for range in kept {
            packing.starts.push(packing.t.len() as u32);
            packing.t.extend_from_slice(&self.packing.t[range.clone()]);
            packing.dt.extend_from_slice(&self.packing.dt[range.clone()]);
            positions.extend_from_slice(&self.positions[3 * range.start..3 * range.end]);
        }
        packing.starts.push(packing.t.len() as u32);
        Self {
            packing,
            positions,
            directions: self.directions.clone(),
        }
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.packing.samples()
    }

    /// Whether no ray has any sample.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Unit position of a sample.
    #[inline(always)]
    pub fn position(&self, sample: usize) -> [f32; 3] {
        let start = 3 * sample;
        [
            self.positions[start],
            self.positions[start + 1],
            self.positions[start + 2],
        ]
    }

    /// Direction features of a ray.
    pub fn direction(&self, ray: usize) -> &[f32; DIRECTION_FEATURES] {
        &self.directions[ray]
    }
}

/// Intervals of a ray whose surface is known: (t, dt) ascending.
fn guided(length: f32, sampling: Sampling, offset: &mut impl FnMut() -> f32) -> Vec<(f32, f32)> {
    let margin = 1.5 * sampling.step + 0.015 * length;
    let surface = (length - margin).max(0.5 * NEAR);
    let near = NEAR.min(0.5 * surface);
    let mut samples = Vec::with_capacity(sampling.free + sampling.near_surface);
    let mut fill = |from: f32, to: f32, count: usize| {
        let dt = (to - from) / count.max(1) as f32;
        samples.extend((0..count).map(|k| (from + (k as f32 + offset()) * dt, dt)));
    };
    fill(near, surface, sampling.free);
    fill(surface, length + margin, sampling.near_surface);
    samples
}

/// Intervals of a ray whose surface is not known, in occupied cells only.
fn marched(
    ray: &Ray,
    volume: &Volume,
    occupancy: &OccupancyGrid,
    step: f32,
    offset: &mut impl FnMut() -> f32,
) -> Vec<(f32, f32)> {
    let Some((enter, leave)) = volume.clip(ray.origin, ray.direction) else {
        return Vec::new();
    };
    let mut samples = Vec::new();
    let mut from = enter.max(NEAR);
    while from + step <= leave && samples.len() < MOST_SAMPLES {
        let t = from + offset() * step;
        if occupancy.is_occupied(volume.to_unit(ray.origin + t * ray.direction)) {
            samples.push((t, step));
        }
        from += step;
    }
    samples
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sampling(jitter: Option<u64>) -> Sampling {
        Sampling {
            step: 0.05,
            free: 4,
            near_surface: 8,
            jitter,
        }
    }

    #[test]
    fn samples_ascend_and_surround_a_known_surface() {
        let volume = Volume {
            min: Vec3::splat(-3.0),
            side: 6.0,
        };
        let grid = OccupancyGrid::unknown(0.05);
        let ray = |length| Ray {
            origin: Vec3::ZERO,
            direction: Vec3::X,
            length,
        };
        let rays = [ray(Some(2.0)), ray(None), ray(Some(0.05))];
        let samples = Samples::along(&rays, &volume, &grid, sampling(Some(3)));
        for index in 0..3 {
            let t = &samples.packing.t[samples.packing.range(index)];
            assert!(t.windows(2).all(|pair| pair[0] < pair[1]), "{t:?}");
        }
        let guided = &samples.packing.t[samples.packing.range(0)];
        assert_eq!(guided.len(), 12);
        assert!(guided[4..].iter().all(|t| (t - 2.0).abs() < 0.12));
        assert!(samples.packing.range(1).len() > 40);
    }

    #[test]
    fn the_same_seed_gives_the_same_samples() {
        let grid = OccupancyGrid::unknown(0.05);
        let volume = Volume {
            min: Vec3::ZERO,
            side: 2.0,
        };
        let ray = Ray {
            origin: Vec3::splat(1.0),
            direction: Vec3::Z,
            length: None,
        };
        let t = |seed| {
            Samples::along(&[ray; 9], &volume, &grid, sampling(Some(seed)))
                .packing
                .t
        };
        assert_eq!(t(7), t(7));
        assert_ne!(t(7), t(8));
    }
}
