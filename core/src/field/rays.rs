//! Rays and the samples along them.

use std::cell::Cell;

use glam::Vec3;
use rand::{Rng, SeedableRng, rngs::SmallRng};
use rayon::prelude::*;

use super::kernels::{DIRECTION_FEATURES, RayPacking, split_off};
use super::{OccupancyGrid, Volume};
use crate::scene::Frame;

/// Nothing is sampled nearer to the camera, in metres: density there explains noise, not the scene.
const NEAR: f32 = 0.1;
/// Most samples of one ray.
const MOST_SAMPLES: usize = 512;
/// Rays that one task samples.
const PORTION: usize = 64;

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

/// How rays are sampled.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sampling {
    /// Distance between samples where the surface is not known, in metres.
    pub step: f32,
    /// Share of the first half of a ray that is left out where the surface is not known, 0..=1.
    pub held_back: f32,
    /// Samples in front of a known surface.
    pub free: usize,
    /// Samples around a known surface.
    pub near_surface: usize,
    /// Random offsets inside each interval, from this seed; `None` = interval centres.
    pub jitter: Option<u64>,
}

impl Sampling {
    /// This step in metres, so many samples in front of and around a known surface, and nothing held back.
    pub fn new(step: f32, [free, near_surface]: [usize; 2], jitter: Option<u64>) -> Self {
        Self {
            step,
            held_back: 0.0,
            free,
            near_surface,
            jitter,
        }
    }
}

/// The samples of a batch of rays.
#[derive(Clone, Debug, Default)]
pub struct Samples {
    /// Where along which ray each sample lies.
    pub packing: RayPacking,
    /// Unit positions, `[N, 3]`.
    positions: Vec<f32>,
    /// Spherical harmonics of each ray's direction.
    directions: Vec<[f32; DIRECTION_FEATURES]>,
}

/// The samples of a portion of rays, before their place among all is known.
#[derive(Default)]
struct Portion {
    /// Samples of each ray.
    counts: Vec<u32>,
    /// (t, dt), one ray after another.
    intervals: Vec<(f32, f32)>,
}

thread_local! {
    /// Memory of [`Samples::refill`], from one call to the next.
    static PORTIONS: Cell<Vec<Portion>> = const { Cell::new(Vec::new()) };
}

impl Samples {
    /// Samples rays in a volume, skipping cells that are empty by the grid.
    ///
    /// A ray of known length is sampled evenly up to the surface, densely around it (more widely the farther it is,
    /// since sensors are less exact there), and not behind it.
    pub fn along(rays: &[Ray], volume: &Volume, occupancy: &OccupancyGrid, sampling: Sampling) -> Self {
        let mut samples = Self::default();
        samples.refill(rays, volume, occupancy, sampling);
        samples
    }

    /// Does the same as [`Samples::along`] in the memory of these samples.
    pub fn refill(&mut self, rays: &[Ray], volume: &Volume, occupancy: &OccupancyGrid, sampling: Sampling) {
        let mut portions = PORTIONS.take();
        let count = rays.len().div_ceil(PORTION);
        portions.resize_with(count.max(portions.len()), Portion::default);
        portions[..count]
            .par_iter_mut()
            .zip(rays.par_chunks(PORTION))
            .enumerate()
            .for_each(|(number, (portion, rays))| {
                portion.counts.clear();
                portion.intervals.clear();
                for (number, ray) in (number * PORTION..).zip(rays) {
                    let mut rng = sampling
                        .jitter
                        .map(|seed| SmallRng::seed_from_u64(seed.wrapping_add(number as u64 * 0x9e37_79b9)));
                    let mut offset = || rng.as_mut().map_or(0.5, |rng| rng.random::<f32>());
                    let intervals = &mut portion.intervals;
                    let before = intervals.len();
                    match ray.length {
                        Some(length) => guided(length, sampling, &mut offset, intervals),
                        None => marched(ray, volume, occupancy, sampling, &mut offset, intervals),
                    }
                    portion.counts.push((portion.intervals.len() - before) as u32);
                }
            });

        let packing = &mut self.packing;
        packing.starts.clear();
        let mut total = 0;
        packing.starts.push(total);
        for count in portions[..count].iter().flat_map(|portion| &portion.counts) {
            total += count;
            packing.starts.push(total);
        }
        let total = total as usize;
        self.directions.clear();
        self.directions
            .extend(rays.iter().map(|ray| direction_features(ray.direction)));
        packing.t.resize(total, 0.0);
        packing.dt.resize(total, 0.0);
        self.positions.resize(3 * total, 0.0);
        let mut rest = (&mut packing.t[..], &mut packing.dt[..], &mut self.positions[..]);
        let places: Vec<_> = portions[..count]
            .iter()
            .map(|portion| {
                let length = portion.intervals.len();
                let t = split_off(&mut rest.0, length);
                let dt = split_off(&mut rest.1, length);
                let positions = split_off(&mut rest.2, 3 * length);
                (portion, t, dt, positions)
            })
            .collect();
        places.into_par_iter().zip(rays.par_chunks(PORTION)).for_each(
            |((portion, t, dt, positions), rays)| {
                let mut sample = 0;
                for (ray, &count) in rays.iter().zip(&portion.counts) {
                    for _ in 0..count {
                        (t[sample], dt[sample]) = portion.intervals[sample];
                        let unit = volume.to_unit(ray.origin + t[sample] * ray.direction);
                        positions[3 * sample..3 * sample + 3].copy_from_slice(&unit.to_array());
                        sample += 1;
                    }
                }
            },
        );
        PORTIONS.set(portions);
    }

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

    /// Keeps only the first `counts[ray]` samples of each ray.
    pub fn truncate(&mut self, counts: &[usize]) {
        let packing = &mut self.packing;
        let (mut start, mut end) = (0, 0);
        for (ray, &count) in counts.iter().enumerate() {
            let next = packing.starts[ray + 1] as usize;
            let kept = start..next.min(start + count);
            packing.starts[ray] = end as u32;
            packing.t.copy_within(kept.clone(), end);
            packing.dt.copy_within(kept.clone(), end);
            self.positions.copy_within(3 * kept.start..3 * kept.end, 3 * end);
            end += kept.len();
            start = next;
        }
        packing.starts[counts.len()] = end as u32;
        packing.t.truncate(end);
        packing.dt.truncate(end);
        self.positions.truncate(3 * end);
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

/// Adds the intervals of a ray whose surface is known: (t, dt) ascending.
fn guided(
    length: f32,
    sampling: Sampling,
    offset: &mut impl FnMut() -> f32,
    intervals: &mut Vec<(f32, f32)>,
) {
    let margin = 1.5 * sampling.step + 0.015 * length;
    let surface = (length - margin).max(0.5 * NEAR);
    let near = NEAR.min(0.5 * surface);
    let mut fill = |from: f32, to: f32, count: usize| {
        let dt = (to - from) / count.max(1) as f32;
        intervals.extend((0..count).map(|k| (from + (k as f32 + offset()) * dt, dt)));
    };
    fill(near, surface, sampling.free);
    fill(surface, length + margin, sampling.near_surface);
}

/// Adds the intervals of a ray whose surface is not known, in occupied cells only.
fn marched(
    ray: &Ray,
    volume: &Volume,
    occupancy: &OccupancyGrid,
    Sampling { step, held_back, .. }: Sampling,
    offset: &mut impl FnMut() -> f32,
    intervals: &mut Vec<(f32, f32)>,
) {
    let Some((enter, leave)) = volume.clip(ray.origin, ray.direction) else {
        return;
    };
    let most = intervals.len() + MOST_SAMPLES;
    let near = enter.max(NEAR);
    let mut from = near + held_back * 0.5 * (leave - near).max(0.0);
    while from + step <= leave && intervals.len() < most {
        let t = from + offset() * step;
        if occupancy.is_occupied(volume.to_unit(ray.origin + t * ray.direction)) {
            intervals.push((t, step));
        }
        from += step;
    }
}

/// Real spherical harmonics up to degree 3 of a unit direction.
fn direction_features(d: Vec3) -> [f32; DIRECTION_FEATURES] {
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

#[cfg(test)]
mod tests {
    use super::*;

    const VOLUME: Volume = Volume {
        min: Vec3::splat(-3.0),
        side: 6.0,
    };

    fn along(rays: &[Ray], seed: u64) -> Samples {
        Samples::along(rays, &VOLUME, &OccupancyGrid::unknown(0.05), sampling(seed))
    }

    fn sampling(seed: u64) -> Sampling {
        Sampling::new(0.05, [4, 8], Some(seed))
    }

    #[test]
    fn samples_ascend_and_surround_a_known_surface() {
        let ray = |length| Ray {
            origin: Vec3::ZERO,
            direction: Vec3::X,
            length,
        };
        let rays = [ray(Some(2.0)), ray(None), ray(Some(0.05))];
        let samples = along(&rays, 3);
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
    fn samples_depend_on_the_seed_and_filled_again_are_as_new() {
        let rays = |count: usize, length| {
            let ray = |k| Ray {
                origin: Vec3::ZERO,
                direction: Vec3::new(1.0, 0.01 * k as f32, 0.3).normalize(),
                length,
            };
            (0..count).map(ray).collect::<Vec<_>>()
        };
        let mut samples = along(&rays(300, None), 1);
        samples.truncate(&[7; 300]);
        assert_eq!(samples.packing.range(299), 7 * 299..7 * 300);
        let whole = along(&rays(300, None), 1);
        assert_ne!(whole.packing.t, along(&rays(300, None), 2).packing.t);
        let start = whole.packing.range(299).start;
        assert_eq!(samples.packing.t[7 * 299..], whole.packing.t[start..start + 7]);
        assert_eq!(samples.position(7 * 299 + 6), whole.position(start + 6));

        samples.refill(
            &rays(130, Some(0.9)),
            &VOLUME,
            &OccupancyGrid::unknown(0.05),
            sampling(2),
        );
        let new = along(&rays(130, Some(0.9)), 2);
        assert_eq!(samples.packing.starts, new.packing.starts);
        assert_eq!(samples.packing.t, new.packing.t);
        assert_eq!(samples.packing.dt, new.packing.dt);
        assert_eq!(samples.positions, new.positions);
        assert_eq!(samples.directions, new.directions);
    }
}
