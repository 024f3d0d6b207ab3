//! Where rays are sampled: densely where there may be a surface, sparsely where there is next to nothing, and not at all
//! in empty cells and behind what hides the rest.

use std::cell::Cell;

use candle_core::Result;
use rand::{Rng, SeedableRng, rngs::SmallRng};
use rayon::prelude::*;

use super::kernels::{Evaluated, Wanted};
use super::rays::direction_features;
use super::{OccupancyGrid, RadianceField, Ray, Samples, Volume};

/// Nothing is sampled nearer to the camera, in metres: density there explains noise, not the scene.
const NEAR: f32 = 0.1;
/// Most samples of one ray.
const MOST_SAMPLES: usize = 512;
/// Rays that one task samples.
const PORTION: usize = 32;
/// Pairs of samples by which a ray is followed at a time.
const BLOCK: usize = 8;
/// Transmittance below which a ray has ended.
const DARK: f32 = 1e-3;
/// Optical depth below which a pair of samples holds next to nothing.
const THIN: f32 = 0.03;
/// Such pairs in a row that become a single sample.
const MERGED: usize = 2;

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

thread_local! {
    /// Memory of [`Samples::refill`], from one call to the next.
    static PORTIONS: Cell<Vec<Portion>> = const { Cell::new(Vec::new()) };
}

impl Samples {
    /// Samples rays in the volume of a field, skipping cells that are empty by the grid.
    ///
    /// A ray of known length is sampled evenly up to the surface, densely around it (more widely the farther it is,
    /// since sensors are less exact there), and not behind it. Any other ray is followed until hardly any light is left
    /// by the field's density at every other sample; where that is next to nothing on both sides, too, one sample
    /// stands for up to four.
    ///
    /// # Errors
    /// None on the CPU.
    pub fn along(
        field: &RadianceField,
        occupancy: &OccupancyGrid,
        rays: &[Ray],
        sampling: Sampling,
    ) -> Result<Self> {
        let mut samples = Self::default();
        samples.refill(field, occupancy, rays, sampling)?;
        Ok(samples)
    }

    /// Does the same as [`Samples::along`] in the memory of these samples.
    ///
    /// # Errors
    /// As [`Samples::along`].
    pub fn refill(
        &mut self,
        field: &RadianceField,
        occupancy: &OccupancyGrid,
        rays: &[Ray],
        sampling: Sampling,
    ) -> Result<()> {
        let mut portions = PORTIONS.take();
        let count = rays.len().div_ceil(PORTION);
        portions.resize_with(count.max(portions.len()), Portion::default);
        portions[..count]
            .par_iter_mut()
            .zip(rays.par_chunks(PORTION))
            .enumerate()
            .try_for_each(|(number, (portion, rays))| {
                portion.sample(field, occupancy, (number * PORTION, rays), sampling)
            })?;

        let Self {
            packing,
            positions,
            directions,
        } = self;
        packing.starts.clear();
        packing.t.clear();
        packing.dt.clear();
        positions.clear();
        directions.clear();
        packing.starts.push(0);
        let sampled = portions[..count].iter().flat_map(|portion| &portion.rays);
        for (ray, own) in rays.iter().zip(sampled) {
            for &(t, dt) in &own.intervals {
                let unit = field.volume().to_unit(ray.origin + t * ray.direction);
                packing.t.push(t);
                packing.dt.push(dt);
                positions.extend(unit.to_array());
            }
            packing.starts.push(packing.t.len() as u32);
            directions.push(direction_features(ray.direction));
        }
        PORTIONS.set(portions);
        Ok(())
    }
}

/// Rays that one task samples.
#[derive(Default)]
struct Portion {
    rays: Vec<Sampled>,
    /// Points whose density is asked for, and the answer.
    points: Samples,
    found: Evaluated,
}

/// A ray as far as it has been sampled.
#[derive(Default)]
struct Sampled {
    /// (t, dt), ascending.
    intervals: Vec<(f32, f32)>,
    /// Optical depth of each pair of intervals that was looked at.
    optical_depths: Vec<f32>,
    /// What goes on from here; `None` at the end of the ray.
    rest: Option<Rest>,
}

/// The part of a ray that has not been sampled.
struct Rest {
    from: f32,
    leave: f32,
    /// Share of the light that arrives from here.
    transmittance: f32,
    jitter: Jitter,
}

/// Places within intervals, 0..1.
struct Jitter(Option<SmallRng>);

impl Jitter {
    fn next(&mut self) -> f32 {
        self.0.as_mut().map_or(0.5, |rng| rng.random())
    }
}

impl Portion {
    /// Samples rays, the first of which has this number among all.
    fn sample(
        &mut self,
        field: &RadianceField,
        occupancy: &OccupancyGrid,
        (first, rays): (usize, &[Ray]),
        sampling: Sampling,
    ) -> Result<()> {
        self.rays.resize_with(rays.len(), Sampled::default);
        for ((number, ray), own) in (first..).zip(rays).zip(&mut self.rays) {
            let seed = sampling
                .jitter
                .map(|seed| seed.wrapping_add(number as u64 * 0x9e37_79b9));
            let jitter = Jitter(seed.map(SmallRng::seed_from_u64));
            own.begin(ray, field.volume(), sampling, jitter);
        }
        loop {
            for (ray, own) in rays.iter().zip(&mut self.rays) {
                own.march(ray, field.volume(), occupancy, sampling.step);
            }
            let points = rays.iter().zip(&self.rays).flat_map(|(ray, own)| {
                let new = own.new_intervals().iter().step_by(2);
                new.map(|(t, _)| field.volume().to_unit(ray.origin + *t * ray.direction).to_array())
            });
            self.points.refill_points(points);
            if self.points.is_empty() {
                break;
            }
            field.evaluate_into(&self.points, Wanted::default(), &mut self.found)?;
            let mut density = &self.found.density[..];
            for own in &mut self.rays {
                own.look(&mut density);
            }
        }
        self.rays.iter_mut().for_each(Sampled::thin_out);
        Ok(())
    }
}

impl Sampled {
    /// Samples a ray of known length, or starts at the beginning of another.
    fn begin(&mut self, ray: &Ray, volume: &Volume, sampling: Sampling, mut jitter: Jitter) {
        self.intervals.clear();
        self.optical_depths.clear();
        self.rest = None;
        if let Some(length) = ray.length {
            self.guide(length, sampling, &mut jitter);
        } else if let Some((enter, leave)) = volume.clip(ray.origin, ray.direction) {
            let near = enter.max(NEAR);
            self.rest = Some(Rest {
                from: near + sampling.held_back * 0.5 * (leave - near).max(0.0),
                leave,
                transmittance: 1.0,
                jitter,
            });
        }
    }

    /// Adds the intervals of a ray whose surface is known.
    fn guide(&mut self, length: f32, sampling: Sampling, jitter: &mut Jitter) {
        let margin = 1.5 * sampling.step + 0.015 * length;
        let surface = (length - margin).max(0.5 * NEAR);
        let near = NEAR.min(0.5 * surface);
        let mut fill = |from: f32, to: f32, count: usize| {
            let dt = (to - from) / count.max(1) as f32;
            let intervals = (0..count).map(|k| (from + (k as f32 + jitter.next()) * dt, dt));
            self.intervals.extend(intervals);
        };
        fill(near, surface, sampling.free);
        fill(surface, length + margin, sampling.near_surface);
    }

    /// Adds the next intervals in occupied cells.
    fn march(&mut self, ray: &Ray, volume: &Volume, occupancy: &OccupancyGrid, step: f32) {
        let Some(rest) = &mut self.rest else {
            return;
        };
        let most = (self.intervals.len() + 2 * BLOCK).min(MOST_SAMPLES);
        let (origin, direction) = (volume.to_unit(ray.origin), ray.direction / volume.side);
        while self.intervals.len() < most && rest.from + step <= rest.leave {
            let t = rest.from + rest.jitter.next() * step;
            if occupancy.is_occupied(origin + t * direction) {
                self.intervals.push((t, step));
            }
            rest.from += step;
        }
    }

    /// Intervals of a ray of unknown length that were not looked at yet.
    fn new_intervals(&self) -> &[(f32, f32)] {
        let looked_at = 2 * self.optical_depths.len();
        match self.rest {
            Some(_) => self.intervals.get(looked_at..).unwrap_or_default(),
            None => &[],
        }
    }

    /// Takes the density at the first of each pair of new intervals, and ends the ray where hardly any light is left.
    fn look(&mut self, density: &mut &[f32]) {
        let new = self.new_intervals().len();
        let (own, others) = density.split_at(new.div_ceil(2));
        *density = others;
        let Some(mut rest) = self.rest.take() else {
            return;
        };
        for (density, pair) in own
            .iter()
            .zip(self.intervals[2 * self.optical_depths.len()..].chunks(2))
        {
            let optical_depth = density * pair.iter().map(|(_, dt)| dt).sum::<f32>();
            self.optical_depths.push(optical_depth);
            rest.transmittance *= (-optical_depth).exp();
            if rest.transmittance < DARK {
                self.intervals.truncate(2 * self.optical_depths.len());
                return;
            }
        }
        if new == 2 * BLOCK {
            self.rest = Some(rest);
        }
    }

    /// Keeps one of up to four intervals where there is next to nothing in them and around, and lets it stand for all.
    fn thin_out(&mut self) {
        let is_thin = |pair: usize| self.optical_depths.get(pair).is_none_or(|&depth| depth < THIN);
        let is_alone = |pair: usize| [pair.wrapping_sub(1), pair, pair + 1].into_iter().all(is_thin);
        let (mut pair, mut kept) = (0, 0);
        while pair < self.optical_depths.len() {
            let alone =
                (pair..self.optical_depths.len().min(pair + MERGED)).take_while(|&pair| is_alone(pair));
            let merged = alone.count();
            let own = 2 * pair..self.intervals.len().min(2 * (pair + merged.max(1)));
            if merged == 0 {
                self.intervals.copy_within(own.clone(), kept);
                kept += own.len();
            } else {
                let length = self.intervals[own.clone()].iter().map(|(_, dt)| dt).sum();
                // The second was not looked at.
                let (t, _) = self.intervals[own.start + usize::from(own.len() > 1)];
                self.intervals[kept] = (t, length);
                kept += 1;
            }
            pair += merged.max(1);
        }
        if !self.optical_depths.is_empty() {
            self.intervals.truncate(kept);
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::field::{Backend, Capacity};

    const VOLUME: Volume = Volume {
        min: Vec3::splat(-3.0),
        side: 6.0,
    };

    /// A field that has learnt nothing: next to nothing is anywhere.
    fn thin() -> RadianceField {
        let capacity = Capacity {
            levels: 2,
            coarsest: 4,
            finest: 16,
            table_log2: 8,
            most_log2: 8,
            hidden: 16,
            steps: 100,
            cell: 0.05,
        };
        RadianceField::new(VOLUME, &capacity, 1, Backend::default()).unwrap()
    }

    /// A field that hides all that lies behind a sample.
    fn opaque() -> RadianceField {
        let field = thin();
        for parameter in [field.table(), field.weights()] {
            parameter.set(&parameter.ones_like().unwrap()).unwrap();
        }
        field
    }

    fn along(field: &RadianceField, rays: &[Ray], seed: u64) -> Samples {
        Samples::along(field, &OccupancyGrid::unknown(0.05), rays, sampling(seed)).unwrap()
    }

    fn sampling(seed: u64) -> Sampling {
        Sampling::new(0.05, [4, 8], Some(seed))
    }

    fn ray(length: Option<f32>) -> Ray {
        Ray {
            origin: Vec3::ZERO,
            direction: Vec3::X,
            length,
        }
    }

    #[test]
    fn samples_ascend_and_surround_a_known_surface() {
        let samples = along(&thin(), &[ray(Some(2.0)), ray(None), ray(Some(0.05))], 3);
        for index in 0..3 {
            let t = &samples.packing.t[samples.packing.range(index)];
            assert!(t.windows(2).all(|pair| pair[0] < pair[1]), "{t:?}");
        }
        let guided = &samples.packing.t[samples.packing.range(0)];
        assert_eq!(guided.len(), 12);
        assert!(guided[4..].iter().all(|t| (t - 2.0).abs() < 0.12));
    }

    #[test]
    fn a_ray_through_next_to_nothing_has_few_samples_that_stand_for_all_of_it() {
        let samples = along(&thin(), &[ray(None)], 3);
        let covered: f32 = samples.packing.dt.iter().sum();
        // From 0.1 to 3 metres, in steps of 0.05.
        assert!((14..17).contains(&samples.len()), "{}", samples.len());
        assert!((covered - 2.9).abs() < 0.051, "{covered}");
    }

    #[test]
    fn a_ray_ends_where_hardly_any_light_is_left() {
        let samples = along(&opaque(), &[ray(None), ray(Some(2.0))], 3);
        assert_eq!(samples.packing.range(0).len(), 2);
        assert_eq!(samples.packing.range(1).len(), 12, "known length");
    }

    #[test]
    fn samples_stand_for_others_only_away_from_what_there_is() {
        let mut ray = Sampled {
            intervals: (0..13).map(|k| (k as f32, 1.0)).collect(),
            optical_depths: vec![0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
            rest: None,
        };
        ray.thin_out();
        let near = (6..12).map(|k| (k as f32, 1.0));
        let expected = [(1.0, 4.0), (5.0, 2.0)]
            .into_iter()
            .chain(near)
            .chain([(12.0, 1.0)]);
        assert_eq!(ray.intervals, expected.collect::<Vec<_>>());
    }

    #[test]
    fn samples_depend_on_the_seed_and_filled_again_are_as_new() {
        let field = thin();
        let rays = |count: usize, length| {
            let ray = |k| Ray {
                direction: Vec3::new(1.0, 0.01 * k as f32, 0.3).normalize(),
                ..ray(length)
            };
            (0..count).map(ray).collect::<Vec<_>>()
        };
        let mut samples = along(&field, &rays(300, None), 1);
        assert_ne!(samples.packing.t, along(&field, &rays(300, None), 2).packing.t);
        let (again, occupancy) = (rays(130, Some(0.9)), OccupancyGrid::unknown(0.05));
        samples.refill(&field, &occupancy, &again, sampling(2)).unwrap();
        let new = along(&field, &again, 2);
        assert_eq!(samples.packing.starts, new.packing.starts);
        assert_eq!(samples.packing.t, new.packing.t);
        assert_eq!(samples.packing.dt, new.packing.dt);
        assert_eq!(samples.positions, new.positions);
        assert_eq!(samples.directions, new.directions);
    }
}
