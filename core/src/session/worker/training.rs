//! What the worker trains, a slice at a time: the field, the survey of its surface, and what follows the labels.

use std::time::Instant;

use super::{Worker, WorkerError, timed};

impl Worker<'_> {
    /// A slice of training; `false` when there is nothing to train.
    pub(super) fn train(&mut self) -> Result<bool, WorkerError> {
        if self.survey.is_rendering() && (!self.paused || self.spread.is_none()) {
            timed(&mut self.seconds.geometry, || {
                self.survey.advance(&self.trainer, &self.labels)
            })?;
            return Ok(true);
        }
        if self.opinion.is_looking() && !self.paused {
            let start = Instant::now();
            self.look_on()?;
            self.seconds.semantics += start.elapsed().as_secs_f64();
            return Ok(true);
        }
        if self.paused || self.settling {
            return Ok(false);
        }
        // The maps need the field's steps more.
        let is_first_guess = self.survey.is_first_guess(&self.trainer);
        if self.semantic_field.has_the_turn() && self.spread.is_some() && !is_first_guess {
            return self.train_semantics(self.opinion.taught.steps_due() > 0, true);
        }
        let field = !self.trainer.settled();
        if field {
            timed(&mut self.seconds.geometry, || self.trainer.step())?;
            self.survey.start_if_due(&self.trainer);
        }
        if self.spread.is_none() && !field && self.survey.is_done() {
            return Err(WorkerError::Other(format!(
                "{}: no surface was found; check that the frames overlap and that the poses belong to them",
                self.options.source
            )));
        }
        let wanted = self.spread.is_some() && self.semantics_are_wanted();
        // After the field's last step they still follow the labels.
        let opinion = wanted && self.opinion.is_due(&self.trainer, field);
        let semantic_field = wanted && !is_first_guess && self.semantic_field.is_due(&self.trainer, field);
        Ok(self.train_semantics(opinion, semantic_field)? || field)
    }

    /// A step of the opinion, and one of the semantic field towards the maps; whether there was any.
    fn train_semantics(&mut self, opinion: bool, semantic_field: bool) -> Result<bool, WorkerError> {
        let Some(spread) = &self.spread else {
            return Ok(false);
        };
        let start = Instant::now();
        let (scene, trainer, seed) = (&self.scene, &self.trainer, self.options.seed);
        if opinion {
            self.opinion.step(scene, trainer, spread, seed)?;
        }
        if semantic_field {
            self.semantic_field.step(scene, trainer, spread, seed)?;
        }
        self.seconds.semantics += start.elapsed().as_secs_f64();
        Ok(opinion || semantic_field)
    }

    /// Whether there is anything to tell apart.
    pub(super) fn semantics_are_wanted(&self) -> bool {
        self.labels.classes.len() >= 2 && self.labels.says_anything()
    }

    /// Goes on with the look at the opinion; at its end, that goes into the maps.
    fn look_on(&mut self) -> Result<(), WorkerError> {
        if let Some(spread) = &mut self.spread
            && let Some(weights) = self.opinion.look_on(&self.trainer, spread)?
        {
            spread.set_head(weights);
            self.refresh_all();
        }
        Ok(())
    }
}
