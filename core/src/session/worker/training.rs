//! Training in slices: the field, refinements of its surface, and the semantic field that follows the labels.

use std::time::Instant;

use super::Worker;
use crate::session::serve::{WorkerError, timed};

impl Worker<'_> {
    /// A slice of training; `false` when there is nothing to train.
    pub(super) fn train(&mut self) -> Result<bool, WorkerError> {
        // The first labels come sooner where the surface has all cores.
        let is_first = self.propagation.is_none() || self.trainer.steps() == 0;
        if self.estimation.is_some() || is_first && self.refiner.is_building() {
            return Ok(false);
        }
        if self.refiner.is_rendering() && (!self.paused || self.propagation.is_none()) {
            timed(&mut self.seconds.geometry, || {
                self.refiner.advance(&self.trainer, &self.labels)
            })?;
            return Ok(true);
        }
        if self.semantics.is_evaluating() && !self.paused {
            let start = Instant::now();
            // At the end its weights go into the maps.
            if let Some(propagation) = &mut self.propagation
                && let Some(weights) = self.semantics.evaluate(&self.trainer, propagation)?
            {
                propagation.set_prior(weights);
                self.refresh_all();
            }
            self.seconds.semantics += start.elapsed().as_secs_f64();
            return Ok(true);
        }
        let field = !self.settling && self.demand.end(&self.trainer).is_none();
        if self.propagation.is_none() && !field && self.refiner.is_done() {
            return Err(WorkerError::Other(format!(
                "{}: no surface was found; check that the frames overlap and that the poses belong to them",
                self.options.source
            )));
        }
        if self.paused || self.settling {
            return Ok(false);
        }
        // A click waits for what is under way: half a step, and a step of the semantic field with the shorter half.
        let has_ended = !field || timed(&mut self.seconds.geometry, || self.trainer.half_step())?;
        if !has_ended {
            self.train_semantics(true)?;
            return Ok(true);
        }
        if field {
            self.demand.stepped(&self.trainer);
        }
        let end = self.demand.end(&self.trainer);
        self.refiner.start_if_due(&self.trainer, end);
        Ok(field || self.train_semantics(false)?)
    }

    /// A step of the semantic field if one is due; whether there was one.
    fn train_semantics(&mut self, field: bool) -> Result<bool, WorkerError> {
        let wanted = self.semantics_are_wanted();
        let Some(propagation) = self.propagation.as_ref().filter(|_| wanted) else {
            return Ok(false);
        };
        let readers = self.demand.readers();
        let Some(part) = self.semantics.due(&self.trainer, field, readers) else {
            return Ok(false);
        };
        let start = Instant::now();
        let (scene, trainer, how) = (&self.scene, &self.trainer, (readers.maps, self.options.seed));
        self.semantics.step(part, scene, trainer, propagation, how)?;
        self.seconds.semantics += start.elapsed().as_secs_f64();
        Ok(true)
    }

    /// Whether there are classes to distinguish, and labels of them.
    pub(super) fn semantics_are_wanted(&self) -> bool {
        self.labels.classes.len() >= 2 && self.labels.says_anything()
    }
}
