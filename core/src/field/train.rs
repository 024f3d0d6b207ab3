//! Training of the radiance field on the frames' pixels and measured depths.

mod batch;
mod held_out;
mod loss;
mod schedule;

use std::collections::HashMap;
use std::sync::Arc;

use candle_core::{Device, Result, Tensor, bail};
use rand::{SeedableRng, rngs::SmallRng};

use super::encoding::FEATURES_PER_LEVEL;
use super::exposure::Exposure;
use super::kernels::{Adam, Wanted};
use super::model::restore;
use super::{
    Backend, Capacity, OccupancyGrid, Preset, RadianceField, Samples, Sampling, Volume, is_alike, render_rays,
};
use crate::scene::Scene;
use batch::{Batch, PixelSource};
pub use held_out::{HeldOut, HeldOutPixels};
use loss::LossPart;
pub use loss::Recipe;
use schedule::{Adjustment, CHECK_EVERY, Schedule};

/// Samples per step, about; the number of rays follows from the samples that a ray needs.
const SAMPLES_PER_STEP: usize = 24 * 1024;
/// Learning rates at the start: of the hash table without and with measured depth (where few samples lie in free space,
/// and a higher rate would leave floaters there), of the networks, and of the frames' exposures (of which a step sees
/// only a few rays each).
const TABLE_RATE: f32 = 0.04;
const TABLE_RATE_WITH_DEPTH: f32 = 0.02;
const NETWORK_RATE: f32 = 0.005;
const EXPOSURE_RATE: f32 = 0.001;
/// Steps without exposures at the start: the field's own colours come first.
const EXPOSURE_WARM_UP: u64 = 300;
/// Share of the first half of a ray that is left out at the start, and steps until none of it is (RegNeRF, annealing of
/// the sample space). Density right in front of a camera can explain all that it sees: without this, a field would now
/// and then put a picture before each camera and never find the scene.
const HELD_BACK: f32 = 0.25;
const HELD_BACK_STEPS: f32 = 128.0;
/// Steps between updates of the occupancy grid, and cells evaluated in each.
const OCCUPANCY_EVERY: u64 = 16;
const OCCUPANCY_PROBES: usize = 16 * 1024;
/// Steps before the first update: the field has not learnt anything yet.
const OCCUPANCY_WARM_UP: u64 = 256;
/// Non-finite steps in a row after which the last checkpoint comes back.
const PATIENCE: u32 = 3;

/// Trains a field, a step at a time.
pub struct Trainer {
    scene: Arc<Scene>,
    capacity: Capacity,
    field: RadianceField,
    occupancy: OccupancyGrid,
    table_optimiser: Adam,
    weights_optimiser: Adam,
    exposure: Exposure,
    recipe: Recipe,
    source: PixelSource,
    held_out: HeldOutPixels,
    seed: u64,
    steps: u64,
    rays: u64,
    samples_per_ray: f32,
    rate_scale: f32,
    skipped: u64,
    failures: u32,
    schedule: Schedule,
    error: Option<HeldOut>,
    undone: u64,
    checkpoint: Checkpoint,
    begun: Option<Begun>,
}

/// The first half of a step.
struct Begun {
    batch: Batch,
    samples: Samples,
    /// Memory for one number per sample.
    gaps: Vec<f32>,
}

/// A state of the field to return to.
struct Checkpoint {
    /// The parameters, in the order of [`RadianceField::named`].
    parameters: Vec<Tensor>,
    occupancy: OccupancyGrid,
}

impl Checkpoint {
    fn of(field: &RadianceField, occupancy: &OccupancyGrid) -> Result<Self> {
        let copies = field.named().map(|(_, parameter)| parameter.copy());
        Ok(Self {
            parameters: copies.into_iter().collect::<Result<_>>()?,
            occupancy: occupancy.clone(),
        })
    }
}

impl Trainer {
    /// Starts a field for a scene on the fastest backend.
    ///
    /// # Errors
    /// Candle's.
    pub fn new(scene: Arc<Scene>, preset: Preset, seed: u64) -> Result<Self> {
        Self::scaled(scene, preset, 1.0, seed)
    }

    /// The same for a field of `size` times the size ([`Capacity::scaled`]).
    ///
    /// # Errors
    /// As [`Trainer::new`].
    pub fn scaled(scene: Arc<Scene>, preset: Preset, size: f32, seed: u64) -> Result<Self> {
        Self::on(Backend::default(), scene, (preset, size), Recipe::default(), seed)
    }

    /// The same on this backend and by this recipe.
    ///
    /// # Errors
    /// Candle's.
    pub fn on(
        backend: Backend,
        scene: Arc<Scene>,
        (preset, size): (Preset, f32),
        recipe: Recipe,
        seed: u64,
    ) -> Result<Self> {
        let volume = Volume::around(&scene.bounds());
        let capacity = Capacity::for_scene(&scene, &volume, preset).scaled(size);
        let field = RadianceField::new(volume, &capacity, seed, backend)?;
        let mut occupancy = OccupancyGrid::unknown(capacity.cell);
        if scene.has_depth() {
            occupancy.carve(&scene, &volume);
        }
        occupancy.keep_points(&scene, &volume);
        let (held_out, frames) = HeldOutPixels::split(&scene, seed);
        // With depth images there is no need to assume that surfaces are smooth.
        let source = PixelSource::new(
            &scene,
            frames,
            recipe.has(LossPart::Smoothness) && !scene.has_depth(),
        );
        let exposure = Exposure::new(scene.frames.len())?;
        let [table_optimiser, weights_optimiser] = field.optimisers();
        let checkpoint = Checkpoint::of(&field, &occupancy)?;
        Ok(Self {
            schedule: Schedule::new(capacity.steps, capacity.doublings()),
            scene,
            capacity,
            field,
            occupancy,
            table_optimiser,
            weights_optimiser,
            exposure,
            recipe,
            source,
            held_out,
            seed,
            steps: 0,
            rays: 0,
            samples_per_ray: 16.0,
            rate_scale: 1.0,
            skipped: 0,
            failures: 0,
            error: None,
            undone: 0,
            checkpoint,
            begun: None,
        })
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

    /// Rays of all steps of this trainer; those before a saved state are not in it.
    pub fn rays(&self) -> u64 {
        self.rays
    }

    /// Steps that were skipped because their loss or gradient was not finite.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }

    /// How often the field was reset to a checkpoint because it had collapsed or was not finite.
    pub fn undone(&self) -> u64 {
        self.undone
    }

    /// The newest held-out error; it is measured every 250 steps, and when a state is restored.
    pub fn error(&self) -> Option<HeldOut> {
        self.error
    }

    /// Whether training has ended: the learning rates are down.
    pub fn settled(&self) -> bool {
        self.schedule.is_over(self.steps)
    }

    /// Samples per training ray, a moving average.
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
        while !self.half_step()? {}
        Ok(())
    }

    /// One half of a step: draws pixels and samples along their rays, or learns from them. Returns whether the step has ended.
    ///
    /// # Errors
    /// As [`Trainer::step`].
    pub fn half_step(&mut self) -> Result<bool> {
        match self.begun.take() {
            None => self.begun = Some(self.begin()?),
            Some(begun) => self.learn(begun)?,
        }
        Ok(self.begun.is_none())
    }

    fn begin(&mut self) -> Result<Begun> {
        let batch = self.batch();
        let rays = &batch.rays;
        let (mut samples, gaps) = self.field.spare();
        samples.refill(&self.field, &self.occupancy, rays, self.sampling())?;
        // Masks may hide all pixels of a batch.
        let count = rays.len().max(1) as f32;
        self.samples_per_ray = 0.9 * self.samples_per_ray + 0.1 * samples.len() as f32 / count;
        Ok(Begun { batch, samples, gaps })
    }

    fn learn(&mut self, begun: Begun) -> Result<()> {
        self.steps += 1;
        self.rays += begun.batch.rays.len() as u64;
        if !begun.samples.is_empty() {
            let loss = self.loss(&begun.batch, begun.samples, begun.gaps)?;
            let finite = loss.to_scalar::<f32>()?.is_finite() && self.descend(&loss)?;
            self.guard(finite)?;
        }
        if self.steps >= OCCUPANCY_WARM_UP && self.steps.is_multiple_of(OCCUPANCY_EVERY) {
            self.look_around()?;
        }
        if self.steps.is_multiple_of(CHECK_EVERY) {
            self.check()?;
        }
        Ok(())
    }

    /// Measures the held-out error and adjusts the training to it.
    fn check(&mut self) -> Result<()> {
        let error = self.evaluate()?;
        let adjustment = error.map_or(Adjustment::GoOn, |error| {
            self.schedule.judge(self.steps, error.psnr)
        });
        match adjustment {
            // The error stays that of the checkpoint.
            Adjustment::Undo => return self.undo(),
            Adjustment::Grow => self.grow()?,
            Adjustment::GoOn => {}
        }
        self.error = error;
        self.checkpoint = Checkpoint::of(&self.field, &self.occupancy)?;
        Ok(())
    }

    /// Doubles the table.
    fn grow(&mut self) -> Result<()> {
        let sources = self.field.grow()?;
        self.table_optimiser = self.table_optimiser.regrown(self.field.table(), &sources)?;
        self.capacity.table_log2 += 1;
        Ok(())
    }

    /// Returns to the last checkpoint and halves the learning rates.
    fn undo(&mut self) -> Result<()> {
        for ((_, var), good) in self.field.named().into_iter().zip(&self.checkpoint.parameters) {
            var.set(good)?;
        }
        self.occupancy = self.checkpoint.occupancy.clone();
        self.rate_scale *= 0.5;
        self.undone += 1;
        Ok(())
    }

    /// The error on held-out pixels; `None` where the scene is too small to hold a frame out.
    ///
    /// # Errors
    /// Candle's.
    pub fn evaluate(&self) -> Result<Option<HeldOut>> {
        self.evaluate_against(&self.scene)
    }

    /// The error against another reading of the same capture, such as one with the depth that the field
    /// was not given.
    ///
    /// # Errors
    /// As [`Trainer::evaluate`].
    pub fn evaluate_against(&self, truth: &Scene) -> Result<Option<HeldOut>> {
        let rays = self.held_out.rays(truth);
        let rendered = render_rays(&self.field, &self.occupancy, &rays, self.render_step(), true)?;
        Ok(self.held_out.error(&rendered, truth))
    }

    /// The parameters, the occupancy, the frames' exposures and the volume by name, for saving.
    ///
    /// # Errors
    /// Candle's.
    pub fn state(&self) -> Result<HashMap<String, Tensor>> {
        let mut tensors: HashMap<String, Tensor> = HashMap::new();
        for (name, var) in self.field.named() {
            tensors.insert(name.to_owned(), var.copy()?);
        }
        let density = self.occupancy.density();
        let occupancy = Tensor::from_slice(density, density.len(), &Device::Cpu)?;
        tensors.insert("occupancy".to_owned(), occupancy);
        tensors.insert("exposure".to_owned(), self.exposure.parameters.copy()?);
        if let Some((from, rate)) = self.schedule.cooling() {
            tensors.insert(
                "cooling".to_owned(),
                Tensor::new(&[from as f32, rate], &Device::Cpu)?,
            );
        }
        let volume = Tensor::new(&self.field.volume().to_array(), &Device::Cpu)?;
        tensors.insert("volume".to_owned(), volume);
        Ok(tensors)
    }

    /// Continues from a saved state after `steps` steps, between two steps.
    ///
    /// # Errors
    /// A state of a field of another capacity or volume; nothing is changed then.
    pub fn restore(&mut self, tensors: &HashMap<String, Tensor>, steps: u64) -> Result<()> {
        let saved = |name: &str| {
            let values = tensors.get(name);
            let values = values.map(|values| values.flatten_all()?.to_vec1::<f32>());
            values.transpose()
        };
        let (volume, density) = (saved("volume")?, saved("occupancy")?);
        // States of before they named their volume are taken to fit.
        if volume.is_some_and(|saved| !self.field.volume().is_about(&saved)) {
            bail!("the saved model is of another part of the world");
        }
        self.grow_to(tensors)?;
        restore(&self.field.named(), tensors)?;
        if let Some(density) = density {
            self.occupancy.restore(density);
        }
        let exposure = &self.exposure.parameters;
        if let Some(saved) = tensors.get("exposure").filter(|saved| is_alike(saved, exposure)) {
            exposure.set(saved)?;
        }
        self.steps = steps;
        if let Some(&[from, rate]) = saved("cooling")?.as_deref() {
            self.schedule.restore((from as u64, rate));
        }
        self.begun = None;
        // The error of a field that has learnt nothing yet would tell nothing.
        self.error = if steps > 0 { self.evaluate()? } else { None };
        self.checkpoint = Checkpoint::of(&self.field, &self.occupancy)?;
        Ok(())
    }

    /// Grows the table to the size of a saved state's, where doublings lead there.
    fn grow_to(&mut self, tensors: &HashMap<String, Tensor>) -> Result<()> {
        let (Some(table), Some(weights)) = (tensors.get("field.table"), tensors.get("field.weights")) else {
            return Ok(());
        };
        let is_usable =
            table.dtype() == self.field.table().dtype() && is_alike(weights, self.field.weights());
        let (&[rows, FEATURES_PER_LEVEL], true) = (table.dims(), is_usable) else {
            return Ok(());
        };
        let fits = |capacity: &Capacity| capacity.grid().rows() == rows;
        let mut capacity = self.capacity;
        while !fits(&capacity) && capacity.doublings() > 0 {
            capacity.table_log2 += 1;
        }
        if fits(&capacity) {
            while self.capacity != capacity {
                self.grow()?;
            }
            self.schedule = Schedule::new(capacity.steps, capacity.doublings());
        }
        Ok(())
    }

    fn batch(&self) -> Batch {
        let mut rng =
            SmallRng::seed_from_u64(self.seed ^ (self.steps + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let count = (SAMPLES_PER_STEP as f32 / self.samples_per_ray.max(1.0)) as usize;
        self.source
            .draw(&self.scene, self.steps, count.clamp(128, 4096), &mut rng)
    }

    fn sampling(&self) -> Sampling {
        // Coarse steps first: the field has no detail to resolve yet.
        let coarse = 1.0 + 2.0 * (1.0 - self.steps as f32 / 400.0).max(0.0);
        Sampling {
            step: coarse * self.render_step(),
            held_back: HELD_BACK * (1.0 - self.steps as f32 / HELD_BACK_STEPS).max(0.0),
            free: 5,
            near_surface: 9,
            jitter: Some(self.seed.wrapping_add(self.steps.wrapping_mul(0x51_7cc1_b727))),
        }
    }

    /// Steps all parameters against the loss; `false`, with nothing changed, when a gradient is not finite.
    fn descend(&self, loss: &Tensor) -> Result<bool> {
        let gradients = loss.backward()?;
        let rate = self.rate_scale * self.schedule.rate(self.steps);
        if let Some(weights) = gradients.get(self.field.weights()) {
            // The weights' gradient is small, and is not finite whenever a sample's is not.
            if !weights.sqr()?.sum_all()?.to_scalar::<f32>()?.is_finite() {
                return Ok(false);
            }
            self.weights_optimiser.step(weights, rate * NETWORK_RATE)?;
            if self.steps >= EXPOSURE_WARM_UP
                && let Some(exposure) = gradients.get(&self.exposure.parameters)
            {
                self.exposure.step(exposure, rate * EXPOSURE_RATE)?;
            }
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

    /// Counts steps that were not finite; when they repeat, returns to the last checkpoint.
    fn guard(&mut self, finite: bool) -> Result<()> {
        if finite {
            self.failures = 0;
            return Ok(());
        }
        self.skipped += 1;
        self.failures += 1;
        if self.failures >= PATIENCE {
            self.failures = 0;
            self.undo()?;
        }
        Ok(())
    }

    fn look_around(&mut self) -> Result<()> {
        // Without depth the first update covers all cells: nothing else tells what is empty.
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

#[cfg(test)]
mod tests;
