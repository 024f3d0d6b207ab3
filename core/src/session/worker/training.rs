//! Training in slices: the field, refinements of its surface, and the heads that follow the labels.

use std::time::Instant;

use super::Worker;
use crate::session::serve::{WorkerError, timed};

impl Worker<'_> {
    /// A slice of training; `false` when there is nothing to train.
    pub(super) fn train(&mut self) -> Result<bool, WorkerError> {
        if self.refiner.is_rendering() && (!self.paused || self.propagation.is_none()) {
            timed(&mut self.seconds.geometry, || {
                self.refiner.advance(&self.trainer, &self.labels)
            })?;
            return Ok(true);
        }
        if self.prior.is_evaluating() && !self.paused {
            let start = Instant::now();
            self.evaluate_prior()?;
            self.seconds.semantics += start.elapsed().as_secs_f64();
            return Ok(true);
        }
        if self.paused || self.settling {
            return Ok(false);
        }
        // At first the field's steps improve the maps more.
        let is_first_guess = self.refiner.is_first_guess(&self.trainer);
        if self.semantic_field.has_the_turn() && self.propagation.is_some() && !is_first_guess {
            return self.train_semantics(self.prior.head_trainer.steps_due() > 0, true);
        }
        let field = !self.trainer.settled();
        if field {
            timed(&mut self.seconds.geometry, || self.trainer.step())?;
            self.refiner.start_if_due(&self.trainer);
        }
        if self.propagation.is_none() && !field && self.refiner.is_done() {
            return Err(WorkerError::Other(format!(
                "{}: no surface was found; check that the frames overlap and that the poses belong to them",
                self.options.source
            )));
        }
        let wanted = self.propagation.is_some() && self.semantics_are_wanted();
        // Both heads still follow the labels after the field's last step.
        let prior = wanted && self.prior.is_due(&self.trainer, field);
        let semantic_field = wanted && !is_first_guess && self.semantic_field.is_due(&self.trainer, field);
        Ok(self.train_semantics(prior, semantic_field)? || field)
    }

    /// A step of the semantic prior and one of the semantic field, each if it is due; whether there was any.
    fn train_semantics(&mut self, prior: bool, semantic_field: bool) -> Result<bool, WorkerError> {
        let Some(propagation) = &self.propagation else {
            return Ok(false);
        };
        let start = Instant::now();
        let (scene, trainer, seed) = (&self.scene, &self.trainer, self.options.seed);
        if prior {
            self.prior.step(scene, trainer, propagation, seed)?;
        }
        if semantic_field {
            self.semantic_field.step(scene, trainer, propagation, seed)?;
        }
        self.seconds.semantics += start.elapsed().as_secs_f64();
        Ok(prior || semantic_field)
    }

    /// Whether there are classes to distinguish, and labels of them.
    pub(super) fn semantics_are_wanted(&self) -> bool {
        self.labels.classes.len() >= 2 && self.labels.says_anything()
    }

    /// Evaluates the semantic prior at some more nodes; at the end its weights go into the maps.
    fn evaluate_prior(&mut self) -> Result<(), WorkerError> {
        if let Some(propagation) = &mut self.propagation
            && let Some(weights) = self.prior.evaluate(&self.trainer, propagation)?
        {
            propagation.set_head(weights);
            self.refresh_all();
        }
        Ok(())
    }
}
