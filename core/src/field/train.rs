//! Training of the radiance field on the frames' pixels and measured depths.

use std::collections::HashMap;
use std::sync::Arc;

use candle_core::{Device, Result, Tensor, Var};
use rand::{Rng, SeedableRng, rngs::SmallRng};

use super::kernels::{Adam, Wanted};
use super::{
    Capacity, OccupancyGrid, Path, Preset, RadianceField, Ray, Samples, Sampling, Volume, render_rays,
    until_opaque,
};
use crate::scene::Scene;

/// Samples that a step aims at; the number of rays follows from how many samples a ray needs.
const SAMPLES_PER_STEP: usize = 24 * 1024;
/// Learning rate at the start: of the hash table without and with measured depth (where only a few
/// samples watch over the free space, and a fast table leaves floaters there), and of the networks.
const TABLE_RATE: f32 = 0.04;
const TABLE_RATE_WITH_DEPTH: f32 = 0.02;
const NETWORK_RATE: f32 = 0.005;
/// Learning rates fall to this share over the capacity's steps.
const FINAL_RATE: f32 = 0.1;
/// Weight of the mean distance (in sides of the volume) between samples and the measured surface.
const DEPTH_WEIGHT: f64 = 1.0;
/// Weight of the distortion (in sides of the volume) in batches with rays of unknown depth, after its ramp.
const DISTORTION_WEIGHT: f64 = 0.01;
/// Steps between looks at the occupancy grid, and cells looked at.
const OCCUPANCY_EVERY: u64 = 16;
const OCCUPANCY_PROBES: usize = 16 * 1024;
/// Steps before the first look: the field says nothing yet.
const OCCUPANCY_WARM_UP: u64 = 256;
/// Non-finite steps in a row after which the last good state comes back.
const PATIENCE: u32 = 3;
/// Steps between snapshots of a good state.
const SNAPSHOT_EVERY: u64 = 200;
/// Pixels that the held-out error is measured on.
const HELD_OUT_PIXELS: usize = 1024;
/// Gradients are scaled down nearer to the camera than this, in metres, in batches without any depth.
const GRADIENT_RAMP: f32 = 1.0;

/// The error on frames that the field never trained on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldOut {
    /// Peak signal-to-noise ratio of the colours, in dB.
    pub psnr: f32,
    /// Median absolute error of the ray length where depth is measured, in metres.
    pub depth_error: Option<f32>,
    /// The same as a share of the ray length.
    pub relative_depth_error: Option<f32>,
    /// Share of those pixels whose error is at most a tenth of the ray length, 0..=1.
    pub within_tenth: Option<f32>,
}

/// Trains a field, a step at a time.
pub struct Trainer {
    scene: Arc<Scene>,
    capacity: Capacity,
    field: RadianceField,
    occupancy: OccupancyGrid,
    table_optimiser: Adam,
    weights_optimiser: Adam,
    train_frames: Vec<usize>,
    held_out: Vec<(usize, usize)>,
    seed: u64,
    steps: u64,
    samples_per_ray: f32,
    rate_scale: f32,
    skipped: u64,
    failures: u32,
    good: Vec<Tensor>,
}

impl Trainer {
    /// Starts a field for a scene on the fastest path.
    ///
    /// # Errors
    /// As [`best_device`](super::best_device), and a lack of memory.
    pub fn new(scene: Arc<Scene>, preset: Preset, seed: u64) -> Result<Self> {
        Self::on(&Path::best()?, scene, preset, seed)
    }

    /// Starts a field for a scene on this path.
    ///
    /// # Errors
    /// The device's, such as a lack of memory.
    pub fn on(path: &Path, scene: Arc<Scene>, preset: Preset, seed: u64) -> Result<Self> {
        let volume = Volume::around(&scene.bounds());
        let capacity = Capacity::for_scene(&scene, &volume, preset);
        let field = RadianceField::new(volume, &capacity, seed, path)?;
        let mut occupancy = OccupancyGrid::unknown(capacity.cell);
        if scene.has_depth() {
            occupancy.carve(&scene, &volume);
        }
        let (train_frames, held_out) = split(&scene, seed);
        let [table_optimiser, weights_optimiser] = field.optimisers()?;
        let mut trainer = Self {
            scene,
            capacity,
            field,
            occupancy,
            table_optimiser,
            weights_optimiser,
            train_frames,
            held_out,
            seed,
            steps: 0,
            samples_per_ray: 16.0,
            rate_scale: 1.0,
            skipped: 0,
            failures: 0,
            good: Vec::new(),
        };
        trainer.good = trainer.snapshot()?;
        Ok(trainer)
    }

    /// The field.
    pub fn field(&self) -> &RadianceField {
        &self.field
    }

    /// Where the field can hold anything.
    pub fn occupancy(&self) -> &OccupancyGrid {
        &self.occupancy
    }

    /// The chosen size.
    pub fn capacity(&self) -> &Capacity {
        &self.capacity
    }

    /// Steps done.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Steps that were skipped because their loss or gradient was not finite.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }

    /// Whether the learning rate has come down.
    pub fn settled(&self) -> bool {
        self.steps >= self.capacity.steps
    }

    /// Samples that a training ray needed of late.
    pub fn samples_per_ray(&self) -> f32 {
        self.samples_per_ray
    }

    /// Distance between samples for rendering, in metres.
    pub fn render_step(&self) -> f32 {
        self.capacity.cell.max(self.field.volume().side / 400.0)
    }

    /// One step on a random batch of pixels.
    ///
    /// # Errors
    /// None on the CPU short of a lack of memory; a step that is not finite is skipped and counted.
    pub fn step(&mut self) -> Result<()> {
        let (rays, colors) = self.batch();
        let (mut samples, gaps) = self.field.spare();
        samples.refill(&rays, self.field.volume(), &self.occupancy, self.sampling());
        let samples = until_opaque(&self.field, samples, |ray| rays[ray].length.is_none())?;
        self.samples_per_ray = 0.9 * self.samples_per_ray + 0.1 * samples.len() as f32 / rays.len() as f32;
        self.steps += 1;
        if !samples.is_empty() {
            let loss = self.loss(&rays, &colors, samples, gaps)?;
            let finite = loss.to_scalar::<f32>()?.is_finite() && self.descend(&loss)?;
            self.guard(finite)?;
        }
        if self.steps >= OCCUPANCY_WARM_UP && self.steps.is_multiple_of(OCCUPANCY_EVERY) {
            self.look_around()?;
        }
        Ok(())
    }

    /// The error on held-out pixels; `None` where the scene is too small to hold a frame out.
    ///
    /// # Errors
    /// None on the CPU short of a lack of memory.
    pub fn evaluate(&self) -> Result<Option<HeldOut>> {
        self.evaluate_against(&self.scene)
    }

    /// The same against another reading of the same capture, such as one with the depth that the field
    /// was not given.
    ///
    /// # Errors
    /// As [`Trainer::evaluate`].
    pub fn evaluate_against(&self, truth: &Scene) -> Result<Option<HeldOut>> {
        if self.held_out.is_empty() {
            return Ok(None);
        }
        let ray = |&(frame, index): &(usize, usize)| Ray {
            length: None,
            ..self.ray(frame, index)
        };
        let rays: Vec<Ray> = self.held_out.iter().map(ray).collect();
        let rendered = render_rays(&self.field, &self.occupancy, &rays, self.render_step(), true)?;
        let mut squared = 0.0;
        let mut errors = Vec::new();
        for (&(frame, index), ray) in self.held_out.iter().zip(&rendered) {
            let frame = &truth.frames[frame];
            squared += (ray.color - frame.color.color(index)).length_squared() / 3.0;
            if let Some(measured) = frame.depth.as_ref().and_then(|depth| depth.ray_length(index)) {
                let error = ray
                    .length
                    .map_or(f32::INFINITY, |length| (length - measured).abs());
                errors.push((error, error / measured));
            }
        }
        let median = |part: fn(&(f32, f32)) -> f32| {
            let mut values: Vec<f32> = errors.iter().map(part).collect();
            values.sort_by(f32::total_cmp);
            values.get(values.len() / 2).copied()
        };
        let close = errors.iter().filter(|(_, relative)| *relative <= 0.1).count();
        Ok(Some(HeldOut {
            psnr: -10.0 * (squared / self.held_out.len() as f32).max(1e-10).log10(),
            depth_error: median(|(error, _)| *error),
            relative_depth_error: median(|(_, relative)| *relative),
            within_tenth: (!errors.is_empty()).then(|| close as f32 / errors.len() as f32),
        }))
    }

    /// The parameters and the occupancy by name, for saving.
    ///
    /// # Errors
    /// None on the CPU short of a lack of memory.
    pub fn state(&self) -> Result<HashMap<String, Tensor>> {
        let mut tensors: HashMap<String, Tensor> = HashMap::new();
        for (name, var) in self.field.named() {
            tensors.insert(name.to_owned(), var.copy()?.to_device(&Device::Cpu)?);
        }
        let density = self.occupancy.density();
        let occupancy = Tensor::from_slice(density, density.len(), &Device::Cpu)?;
        tensors.insert("occupancy".to_owned(), occupancy);
        Ok(tensors)
    }

    /// Goes on from a saved state after `steps` steps.
    ///
    /// # Errors
    /// A state of a field of another capacity; nothing is changed then.
    pub fn restore(&mut self, tensors: &HashMap<String, Tensor>, steps: u64) -> Result<()> {
        self.field.restore(tensors)?;
        if let Some(density) = tensors.get("occupancy") {
            self.occupancy.restore(density.flatten_all()?.to_vec1()?);
        }
        self.steps = steps;
        self.good = self.snapshot()?;
        Ok(())
    }

    /// Random rays of training frames and their colours `[rays, 3]`.
    fn batch(&self) -> (Vec<Ray>, Vec<f32>) {
        let mut rng =
            SmallRng::seed_from_u64(self.seed ^ (self.steps + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let count = (SAMPLES_PER_STEP as f32 / self.samples_per_ray.max(1.0)) as usize;
        let count = count.clamp(128, 4096);
        let mut rays = Vec::with_capacity(count);
        let mut colors = Vec::with_capacity(3 * count);
        for _ in 0..count {
            let frame = self.train_frames[rng.random_range(0..self.train_frames.len())];
            let index = rng.random_range(0..self.scene.frames[frame].camera.pixels());
            rays.push(self.ray(frame, index));
            colors.extend(self.scene.frames[frame].color.color(index).to_array());
        }
        (rays, colors)
    }

    fn ray(&self, frame: usize, index: usize) -> Ray {
        let frame = &self.scene.frames[frame];
        Ray {
            origin: frame.center(),
            direction: frame.ray_direction(index),
            length: frame.depth.as_ref().and_then(|depth| depth.ray_length(index)),
        }
    }

    fn sampling(&self) -> Sampling {
        // Coarse steps first: the field has no detail to resolve yet.
        let coarse = 1.0 + 2.0 * (1.0 - self.steps as f32 / 400.0).max(0.0);
        Sampling {
            step: coarse * self.render_step(),
            free: 5,
            near_surface: 9,
            jitter: Some(self.seed.wrapping_add(self.steps.wrapping_mul(0x51_7cc1_b727))),
        }
    }

    /// Colour error over a random background, distance of the samples to measured surfaces, distortion.
    fn loss(&self, rays: &[Ray], colors: &[f32], mut samples: Samples, mut gaps: Vec<f32>) -> Result<Tensor> {
        let side = self.field.volume().side;
        let measured = rays.iter().filter(|ray| ray.length.is_some()).count();
        if measured == 0 {
            samples.packing.gradient_ramp = GRADIENT_RAMP;
        }
        gaps.clear();
        gaps.resize(samples.len(), 0.0);
        for (number, ray) in rays.iter().enumerate() {
            if let Some(length) = ray.length {
                for i in samples.packing.range(number) {
                    gaps[i] = (samples.packing.t[i] - length).abs() / side;
                }
            }
        }
        let out = self.field.render(Arc::new(samples), gaps)?;

        let count = rays.len();
        let opacity = out.narrow(1, 5, 1)?;
        let mut rng = SmallRng::seed_from_u64(self.seed ^ self.steps);
        let background: Vec<f32> = (0..3 * count).map(|_| rng.random()).collect();
        let background = Tensor::from_vec(background, (count, 3), self.field.device())?;
        let target = Tensor::from_slice(colors, (count, 3), self.field.device())?;
        let clear = opacity.affine(-1.0, 1.0)?;
        let seen = (out.narrow(1, 0, 3)? + background.broadcast_mul(&clear)?)?;
        let mut loss = seen.sub(&target)?.sqr()?.mean_all()?;
        if measured > 0 {
            let has_depth: Vec<f32> = rays
                .iter()
                .map(|ray| f32::from(u8::from(ray.length.is_some())))
                .collect();
            let has_depth = Tensor::from_vec(has_depth, (count, 1), self.field.device())?;
            // What passes the surface is as wrong as what stops a margin away from it.
            let passing = clear.mul(&has_depth)?.affine(0.02, 0.0)?;
            let depth = (out.narrow(1, 3, 1)? + passing)?.sum_all()?;
            loss = (loss + depth.affine(DEPTH_WEIGHT / measured as f64, 0.0)?)?;
        }
        if measured < count {
            let ramp = (self.steps as f64 / 500.0).min(1.0);
            let weight = ramp * DISTORTION_WEIGHT / f64::from(side) / count as f64;
            loss = (loss + out.narrow(1, 6, 1)?.sum_all()?.affine(weight, 0.0)?)?;
        }
        Ok(loss)
    }

    /// Steps all parameters against the loss; `false`, with nothing changed, when a gradient is not finite.
    fn descend(&self, loss: &Tensor) -> Result<bool> {
        let gradients = loss.backward()?;
        let progress = (self.steps as f32 / self.capacity.steps as f32).min(1.0);
        let rate = self.rate_scale * FINAL_RATE.powf(progress);
        if let Some(weights) = gradients.get(self.field.weights()) {
            // The weights' gradient is small, and is not finite whenever a sample's is not.
            if !weights.sqr()?.sum_all()?.to_scalar::<f32>()?.is_finite() {
                return Ok(false);
            }
            self.weights_optimiser.step(weights, rate * NETWORK_RATE)?;
            let base = if self.scene.has_depth() {
                TABLE_RATE_WITH_DEPTH
            } else {
                TABLE_RATE
            };
            if let Some(table) = self.field.table_gradient(&gradients) {
                self.table_optimiser.step(table, rate * base)?;
            }
        }
        Ok(true)
    }

    /// Counts steps that were not finite; when they repeat, brings the last good state back and halves
    /// the learning rate.
    fn guard(&mut self, finite: bool) -> Result<()> {
        if finite {
            self.failures = 0;
            if self.steps.is_multiple_of(SNAPSHOT_EVERY) {
                self.good = self.snapshot()?;
            }
            return Ok(());
        }
        self.skipped += 1;
        self.failures += 1;
        if self.failures >= PATIENCE {
            for ((_, var), good) in self.field.named().into_iter().zip(&self.good) {
                var.set(good)?;
            }
            self.rate_scale *= 0.5;
            self.failures = 0;
        }
        Ok(())
    }

    fn snapshot(&self) -> Result<Vec<Tensor>> {
        self.field
            .named()
            .into_iter()
            .map(|(_, var): (_, &Var)| var.copy())
            .collect()
    }

    fn look_around(&mut self) -> Result<()> {
        // The first look without depth sees everything: nothing else tells what is empty.
        let all = self.steps < OCCUPANCY_WARM_UP + OCCUPANCY_EVERY && !self.scene.has_depth();
        let (cells, positions) = if all {
            self.occupancy.everywhere(self.seed ^ self.steps)
        } else {
            self.occupancy.probes(OCCUPANCY_PROBES, self.seed ^ self.steps)
        };
        let density = self
            .field
            .evaluate(&Samples::at_points(&positions), Wanted::default())?
            .density;
        self.occupancy.update(&cells, &density);
        Ok(())
    }
}

/// Training frames, and (frame, pixel index) of the held-out pixels: from every twentieth frame, at
/// most eight and none of a capture of fewer than eight frames.
fn split(scene: &Scene, seed: u64) -> (Vec<usize>, Vec<(usize, usize)>) {
    let frames = scene.frames.len();
    let count = if frames < 8 { 0 } else { (frames / 20).clamp(1, 8) };
    let held_frames: Vec<usize> = (0..count).map(|k| (2 * k + 1) * frames / (2 * count)).collect();
    let train = (0..frames).filter(|frame| !held_frames.contains(frame)).collect();
    let mut rng = SmallRng::seed_from_u64(seed ^ 0x4e1d);
    let pixels = (0..if count == 0 { 0 } else { HELD_OUT_PIXELS })
        .map(|k| {
            let frame = held_frames[k % count];
            (frame, rng.random_range(0..scene.frames[frame].camera.pixels()))
        })
        .collect();
    (train, pixels)
}

#[cfg(test)]
mod tests;
