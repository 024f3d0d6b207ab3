//! Joint training on colours and labels.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use candle_core::{DType, Device, Result, Tensor, Var, bail};
use candle_nn::{AdamW, Optimizer, ParamsAdamW};
use rand::{Rng, seq::IndexedRandom};
use rayon::prelude::*;

use super::render::generator;
use super::{PixelLabels, ReferenceField, ReferenceSettings, photometric, semantic};
use crate::field::model::restore;
use crate::field::{HeldOutPixels, Ray, Work};
use crate::scene::Scene;

/// Trains the networks, a slice of a step at a time, on colours wherever there are pixels and on labels
/// wherever there are any; measured depth is not used.
///
/// As in the published code, the rays of a step are random pixels of one random frame (those that its image does not
/// show are left out). That code has labels for whole images, whereas a few clicks would be hit once in hundreds of
/// steps. So where fewer than [`ReferenceSettings::labelled_rays`] of the pixels are labelled, the missing ones are
/// drawn from all labelled pixels of the scene, those on held-out frames included.
pub struct ReferenceTrainer {
    scene: Arc<Scene>,
    field: ReferenceField,
    labels: PixelLabels,
    variables: Vec<Var>,
    optimiser: AdamW,
    train_frames: Vec<usize>,
    held_out: HeldOutPixels,
    seed: u64,
    steps: u64,
    work: Work,
    skipped: u64,
    batch: Option<ReferenceBatch>,
}

/// The rays of a step, and what has been summed over those that were worked on.
struct ReferenceBatch {
    rays: Vec<Ray>,
    /// `[rays, 3]`
    colors: Vec<f32>,
    /// Index of each ray's class, where it has one.
    classes: Vec<Option<u32>>,
    labelled: usize,
    done: usize,
    loss: f32,
    gradients: Vec<Option<Tensor>>,
}

impl ReferenceTrainer {
    /// Starts networks for a scene and its classes; without classes they learn colours alone.
    ///
    /// # Errors
    /// A lack of memory on the device.
    pub fn new(
        scene: Arc<Scene>,
        labels: PixelLabels,
        settings: ReferenceSettings,
        device: &Device,
        seed: u64,
    ) -> Result<Self> {
        let field = ReferenceField::new(&scene, settings, labels.classes().len(), device, seed)?;
        let variables: Vec<Var> = field.named().into_iter().map(|(_, var)| var.clone()).collect();
        // Without weight decay this is Adam, with the published moments' rates 0.9 and 0.999.
        let parameters = ParamsAdamW {
            lr: settings.learning_rate,
            weight_decay: 0.0,
            ..ParamsAdamW::default()
        };
        let optimiser = AdamW::new(variables.clone(), parameters)?;
        let (held_out, train_frames) = HeldOutPixels::split(&scene, seed);
        Ok(Self {
            scene,
            field,
            labels,
            variables,
            optimiser,
            train_frames,
            held_out,
            seed,
            steps: 0,
            work: Work::default(),
            skipped: 0,
            batch: None,
        })
    }

    /// The networks.
    pub fn field(&self) -> &ReferenceField {
        &self.field
    }

    /// The labels that they are trained on.
    pub fn labels(&self) -> &PixelLabels {
        &self.labels
    }

    /// Takes other labels of the same classes; the step under way starts anew.
    ///
    /// # Errors
    /// Other classes: the networks have one logit for each of theirs.
    pub fn set_labels(&mut self, labels: PixelLabels) -> Result<()> {
        if labels.classes() != self.labels.classes() {
            bail!("the networks were made for other classes");
        }
        self.labels = labels;
        self.batch = None;
        Ok(())
    }

    /// Whole steps done.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// What was worked on since the trainer was made, the rays of a step that is not done yet included.
    pub fn work(&self) -> Work {
        self.work
    }

    /// Steps that were skipped because their loss was not finite.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }

    /// Whether all published steps are done.
    pub fn settled(&self) -> bool {
        self.steps >= self.field.settings().steps
    }

    /// The pixels that are held out of the training: those of the fused field with this seed.
    pub fn held_out(&self) -> &HeldOutPixels {
        &self.held_out
    }

    /// Works on the next [`ReferenceSettings::slice`] rays; `true` when that completed a step.
    ///
    /// Gradients are summed in the order of the rays, which gives the step of the whole batch whatever the
    /// number of threads.
    ///
    /// # Errors
    /// A lack of memory on the device; a step that is not finite is skipped and counted.
    pub fn advance(&mut self) -> Result<bool> {
        let mut batch = self.batch.take().unwrap_or_else(|| self.draw());
        let settings = *self.field.settings();
        let end = (batch.done + settings.slice).min(batch.rays.len());
        let parts: Vec<(f32, Vec<Option<Tensor>>)> = (batch.done..end)
            .into_par_iter()
            .step_by(settings.chunk)
            .map(|start| self.gradients(&batch, start..(start + settings.chunk).min(end)))
            .collect::<Result<_>>()?;
        for (loss, gradients) in parts {
            batch.loss += loss;
            for (sum, own) in batch.gradients.iter_mut().zip(gradients) {
                *sum = match (sum.take(), own) {
                    (Some(sum), Some(own)) => Some((sum + own)?),
                    (sum, own) => sum.or(own),
                };
            }
        }
        let rays = (end - batch.done) as u64;
        self.work.rays += rays;
        self.work.samples += rays * settings.evaluations_per_ray() as u64;
        batch.done = end;
        if batch.done < batch.rays.len() {
            self.batch = Some(batch);
            return Ok(false);
        }
        if batch.loss.is_finite() {
            // A store can only be had from a backward pass; this one is as small as can be.
            let mut store = self.variables[0].zeros_like()?.backward()?;
            for (sum, variable) in batch.gradients.into_iter().zip(&self.variables) {
                if let Some(sum) = sum {
                    store.insert(variable, sum);
                }
            }
            let decay = 0.1_f64.powf(self.steps as f64 / settings.decay_steps);
            self.optimiser.set_learning_rate(settings.learning_rate * decay);
            self.optimiser.step(&store)?;
        } else {
            self.skipped += 1;
        }
        self.steps += 1;
        self.work.steps += 1;
        Ok(true)
    }

    /// The share of some rays in the loss (Eq. 8) of their batch, and its gradient for each variable.
    fn gradients(&self, batch: &ReferenceBatch, range: Range<usize>) -> Result<(f32, Vec<Option<Tensor>>)> {
        let settings = self.field.settings();
        let rays = &batch.rays[range.clone()];
        let mut random: Vec<_> = range
            .clone()
            .map(|ray| generator(self.seed, self.steps + 1, ray))
            .collect();
        let truth = &batch.colors[3 * range.start..3 * range.end];
        let truth = Tensor::from_slice(truth, (rays.len(), 3), self.field.device())?;
        let mut loss = Tensor::zeros((), DType::F32, self.field.device())?;
        for said in self.field.forward(rays, Some(&mut random))? {
            loss = (loss + photometric(&said.color, &truth, batch.rays.len())?)?;
            if let Some(logits) = &said.logits
                && let Some(semantic) = semantic(logits, &batch.classes[range.clone()], batch.labelled)?
            {
                loss = (loss + semantic.affine(settings.semantic_weight, 0.0)?)?;
            }
        }
        let mut store = loss.backward()?;
        // A gradient holds on to the activations that it was computed from unless it is detached.
        let gradients = self.variables.iter().map(|variable| store.remove(variable));
        let gradients = gradients.map(|gradient| gradient.map(|gradient| gradient.detach()));
        Ok((loss.to_scalar()?, gradients.collect()))
    }

    /// The parameters by name, for saving.
    ///
    /// # Errors
    /// None on the CPU short of a lack of memory.
    pub fn state(&self) -> Result<HashMap<String, Tensor>> {
        let named = self.field.named().into_iter();
        named.map(|(name, var)| Ok((name, var.copy()?))).collect()
    }

    /// Goes on from saved parameters after `steps` steps; Adam's moments start anew.
    ///
    /// # Errors
    /// A state of other networks; nothing is changed then.
    pub fn restore(&mut self, tensors: &HashMap<String, Tensor>, steps: u64) -> Result<()> {
        restore(&self.field.named(), tensors)?;
        self.steps = steps;
        self.batch = None;
        Ok(())
    }

    /// The rays of the next step.
    fn draw(&self) -> ReferenceBatch {
        let settings = self.field.settings();
        let mut rng = generator(self.seed, self.steps + 1, usize::MAX);
        let frame = self.train_frames[rng.random_range(0..self.train_frames.len())];
        let pixels = self.scene.frames[frame].camera.pixels();
        let mut chosen: Vec<(usize, usize)> = (0..settings.rays)
            .map(|_| (frame, rng.random_range(0..pixels)))
            .collect();
        let is_labelled = |&(frame, index): &(usize, usize)| self.labels.class_of(frame, index).is_some();
        let mut missing = settings
            .labelled_rays
            .saturating_sub(chosen.iter().filter(|pixel| is_labelled(pixel)).count());
        for pixel in &mut chosen {
            if missing > 0
                && !is_labelled(pixel)
                && let Some(&(frame, index)) = self.labels.pixels().choose(&mut rng)
            {
                *pixel = (frame, index as usize);
                missing -= 1;
            }
        }
        chosen.retain(|&(frame, index)| self.scene.frames[frame].is_valid(index));
        let class = |&(frame, index): &(usize, usize)| self.labels.class_of(frame, index);
        let classes: Vec<Option<u32>> = chosen.iter().map(class).collect();
        ReferenceBatch {
            rays: chosen
                .iter()
                .map(|&(frame, index)| Ray {
                    length: None,
                    ..Ray::through(&self.scene.frames[frame], index)
                })
                .collect(),
            colors: chosen
                .iter()
                .flat_map(|&(frame, index)| self.scene.frames[frame].color_of(index).to_array())
                .collect(),
            labelled: classes.iter().flatten().count(),
            classes,
            done: 0,
            loss: 0.0,
            gradients: vec![None; self.variables.len()],
        }
    }
}
