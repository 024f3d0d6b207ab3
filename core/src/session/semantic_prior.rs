//! The semantic prior: a small head predicts classes from the field's features, and its probabilities weigh the
//! classes that label propagation gives each node.

use std::collections::HashMap;

use candle_core::{Result, Tensor};

use super::head_trainer::{HeadKind, HeadTrainer, sampling};
use crate::field::Trainer;
use crate::scene::Scene;
use crate::semantics::{HeadEvaluation, LabelPropagation, SemanticHead};

/// Field steps per step of the head.
const EVERY: u64 = 2;
/// Steps of the head between evaluations on the whole surface.
const EVALUATE_EVERY: u64 = 100;
/// Places of the surface and labelled rays in a step.
const SOFT_TARGETS: usize = 1024;
const LABELLED_RAYS: usize = 128;
const KIND: HeadKind = HeadKind {
    name: "head",
    has_grid: false,
};

/// The head, and the evaluation of it that is under way.
pub(super) struct SemanticPrior {
    pub(super) head_trainer: HeadTrainer,
    evaluation: Option<HeadEvaluation>,
}

impl SemanticPrior {
    /// The prior of a saved model, or a new one where `saved` has none that fits.
    pub(super) fn restored(saved: &HashMap<String, Tensor>, trainer: &Trainer) -> Self {
        Self {
            head_trainer: HeadTrainer::restored(KIND, saved, trainer),
            evaluation: None,
        }
    }

    /// Whether a step is due. While the field trains (`field`) it is due after some of the field's steps; later only
    /// to follow new labels.
    pub(super) fn is_due(&self, trainer: &Trainer, field: bool) -> bool {
        if field {
            trainer.steps().is_multiple_of(EVERY)
        } else {
            self.head_trainer.steps_due() > 0
        }
    }

    /// One training step; an evaluation begins after every hundredth, and once the head has followed new labels.
    pub(super) fn step(
        &mut self,
        scene: &Scene,
        trainer: &Trainer,
        propagation: &LabelPropagation,
        seed: u64,
    ) -> Result<()> {
        let seed = self.head_trainer.seed(trainer, seed);
        let followed = self.head_trainer.steps_due() == 1;
        let soft = propagation.soft_targets(SOFT_TARGETS, seed);
        let labelled = propagation.labelled_rays(scene, LABELLED_RAYS, seed);
        let head = self.head_trainer.for_step(propagation.classes(), trainer, seed)?;
        let (field, occupancy) = (trainer.field(), trainer.occupancy());
        head.step(field, occupancy, &soft, &labelled, sampling(trainer, Some(seed)))?;
        if followed || head.steps().is_multiple_of(EVALUATE_EVERY) {
            self.start_evaluation();
        }
        Ok(())
    }

    /// Starts to evaluate the head at every node, unless it has had too few steps.
    pub(super) fn start_evaluation(&mut self) {
        let has_learnt = |head: &SemanticHead| head.steps() >= EVALUATE_EVERY;
        let is_useful = self.head_trainer.head().is_some_and(has_learnt);
        self.evaluation = is_useful.then(HeadEvaluation::default);
    }

    /// Whether an evaluation is under way.
    pub(super) fn is_evaluating(&self) -> bool {
        self.evaluation.is_some()
    }

    /// Evaluates some more nodes; at the end returns the weights of the classes for each node, `[nodes, classes]`.
    pub(super) fn evaluate(
        &mut self,
        trainer: &Trainer,
        propagation: &LabelPropagation,
    ) -> Result<Option<Vec<f32>>> {
        let (Some(mut evaluation), Some(head)) = (self.evaluation.take(), self.head_trainer.head()) else {
            return Ok(None);
        };
        // Classes came or went: the head learns them first.
        if head.classes() != propagation.classes() {
            return Ok(None);
        }
        let weights = evaluation.advance(propagation, head, trainer.field())?;
        if weights.is_none() {
            self.evaluation = Some(evaluation);
        }
        Ok(weights)
    }
}
