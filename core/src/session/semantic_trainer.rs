//! Trains the semantic field of a session, as far as it is read: its appearance weighs the classes of the maps, and the
//! whole of it is rendered where somebody looks at it.

use std::collections::HashMap;

use candle_core::{Result, Tensor};

use crate::field::{Sampling, Trainer};
use crate::scene::Scene;
use crate::semantics::{LabelPropagation, PriorEvaluation, SemanticField, SemanticPart};

/// Steps that a part needs to follow a change of the labels.
const STEPS_PER_CHANGE: u64 = 300;
/// Steps of the radiance field per step of a part.
const EVERY: u64 = 2;
/// Steps of the appearance between evaluations on the whole surface.
const EVALUATE_EVERY: u64 = 100;
/// Surface points and rays of labelled pixels in a step; for the residual also rays of any pixels.
const APPEARANCE_POINTS: usize = 1024;
const RESIDUAL_POINTS: usize = 2048;
const RAYS: usize = 512;
const LABELLED_RAYS: usize = 128;

/// Who reads the semantic field.
#[derive(Clone, Copy, Debug)]
pub(super) struct Readers {
    /// The maps read the appearance.
    pub(super) maps: bool,
    /// Somebody looks at views of the whole field.
    pub(super) views: bool,
}

/// The semantic field, what training it still needs, and the evaluation that is under way.
pub(super) struct SemanticTrainer {
    /// `None` before the first step.
    field: Option<SemanticField>,
    /// Steps that the appearance and the residual need to follow the newest labels.
    appearance_due: u64,
    residual_due: u64,
    /// Whether there are labels worth training on.
    wanted: bool,
    /// Whether the labels have changed since anybody looked at the whole field.
    is_behind: bool,
    evaluation: Option<PriorEvaluation>,
}

impl SemanticTrainer {
    /// A trainer of the semantic field in a saved model, or of a new one where `saved` has none that fits.
    pub(super) fn restored(saved: &HashMap<String, Tensor>, trainer: &Trainer) -> Self {
        Self {
            field: restored(saved, trainer),
            appearance_due: 0,
            residual_due: 0,
            wanted: false,
            is_behind: true,
            evaluation: None,
        }
    }

    /// The semantic field, once it has had a step; `None` while there are no labels for it to show.
    pub(super) fn field(&self) -> Option<&SemanticField> {
        self.field.as_ref().filter(|_| self.wanted)
    }

    /// There are new labels to follow, or none worth training on (`wanted` is false).
    pub(super) fn labels_changed(&mut self, wanted: bool, readers: Readers) {
        let due = |is_read: bool| if wanted && is_read { STEPS_PER_CHANGE } else { 0 };
        self.appearance_due = due(readers.maps || readers.views);
        self.residual_due = due(readers.views);
        self.wanted = wanted;
        self.is_behind = !readers.views;
    }

    /// Somebody looks at the whole field, which then follows the newest labels.
    pub(super) fn is_looked_at(&mut self, wanted: bool, readers: Readers) {
        if self.is_behind {
            self.labels_changed(wanted, readers);
        }
    }

    /// Whether it has followed the newest labels as far as they are read.
    pub(super) fn is_done(&self) -> bool {
        self.appearance_due + self.residual_due == 0 && self.evaluation.is_none()
    }

    /// The part whose step is due, if any is. While the radiance field trains (`field`) one is due after some of its
    /// steps, and to follow new labels after each; later only to follow new labels.
    pub(super) fn due(&self, trainer: &Trainer, field: bool, readers: Readers) -> Option<SemanticPart> {
        if self.appearance_due > 0 {
            return Some(SemanticPart::Appearance);
        }
        if self.residual_due > 0 {
            return Some(SemanticPart::Residual);
        }
        let own_turn = field && trainer.steps().is_multiple_of(EVERY);
        let is_residuals = (trainer.steps() / EVERY).is_multiple_of(2);
        match readers {
            _ if !own_turn => None,
            Readers { views: true, .. } if is_residuals => Some(SemanticPart::Residual),
            Readers {
                views: false,
                maps: false,
            } => None,
            _ => Some(SemanticPart::Appearance),
        }
    }

    /// One step of a part. For the maps, an evaluation of the appearance begins after every hundredth of its steps, and
    /// once it has followed new labels.
    pub(super) fn step(
        &mut self,
        part: SemanticPart,
        scene: &Scene,
        trainer: &Trainer,
        propagation: &LabelPropagation,
        (for_maps, seed): (bool, u64),
    ) -> Result<()> {
        let done = self.field.as_ref().map_or(0, |field| field.steps(part));
        let seed = seed ^ (trainer.steps() << 20) ^ (done << 1) ^ u64::from(part == SemanticPart::Residual);
        let mut rays = propagation.labelled_rays(scene, LABELLED_RAYS, seed);
        let soft = match part {
            SemanticPart::Appearance => propagation.soft_targets(APPEARANCE_POINTS, seed),
            SemanticPart::Residual => {
                rays.append(propagation.map_rays(scene, RAYS, seed));
                propagation.map_targets(RESIDUAL_POINTS, seed)
            }
        };
        let mut field = self.field_of(propagation, trainer, seed)?;
        let radiance = (trainer.field(), trainer.occupancy());
        field.step(part, radiance, &soft, &rays, sampling(trainer, Some(seed)))?;
        let steps = field.steps(part);
        self.field = Some(field);
        match part {
            SemanticPart::Appearance => {
                let followed = self.appearance_due == 1;
                self.appearance_due = self.appearance_due.saturating_sub(1);
                if for_maps && (followed || steps.is_multiple_of(EVALUATE_EVERY)) {
                    self.start_evaluation();
                }
            }
            SemanticPart::Residual => self.residual_due = self.residual_due.saturating_sub(1),
        }
        Ok(())
    }

    /// The semantic field of the present classes; where they have changed, a new one takes over what it can.
    fn field_of(
        &mut self,
        propagation: &LabelPropagation,
        trainer: &Trainer,
        seed: u64,
    ) -> Result<SemanticField> {
        let classes = propagation.classes();
        match self.field.take() {
            Some(field) if field.classes() == classes => Ok(field),
            earlier => {
                let (width, grid) = (
                    trainer.field().feature_width(),
                    trainer.capacity().semantic_grid(),
                );
                SemanticField::new(classes, width, grid, earlier.as_ref(), seed)
            }
        }
    }

    /// Starts to evaluate the appearance at every node, unless it has had too few steps.
    pub(super) fn start_evaluation(&mut self) {
        let has_learnt = |field: &SemanticField| field.steps(SemanticPart::Appearance) >= EVALUATE_EVERY;
        let is_useful = self.field.as_ref().is_some_and(has_learnt);
        self.evaluation = is_useful.then(PriorEvaluation::default);
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
        let (Some(mut evaluation), Some(field)) = (self.evaluation.take(), &self.field) else {
            return Ok(None);
        };
        // Classes came or went: the field learns them first.
        if field.classes() != propagation.classes() {
            return Ok(None);
        }
        let weights = evaluation.advance(propagation, field, trainer.field())?;
        if weights.is_none() {
            self.evaluation = Some(evaluation);
        }
        Ok(weights)
    }

    /// Training steps of both parts.
    pub(super) fn steps(&self) -> u64 {
        let of = |part| self.field.as_ref().map_or(0, |field| field.steps(part));
        of(SemanticPart::Appearance) + of(SemanticPart::Residual)
    }

    /// Trainable parameters.
    pub(super) fn parameters(&self) -> usize {
        self.field.as_ref().map_or(0, SemanticField::parameters)
    }

    /// The parameters by name, for saving.
    pub(super) fn state(&self) -> Result<HashMap<String, Tensor>> {
        self.field
            .as_ref()
            .map_or_else(|| Ok(HashMap::new()), SemanticField::state)
    }
}

/// The semantic field of a saved model on a radiance field; `None` where it has none that fits.
pub(super) fn restored(saved: &HashMap<String, Tensor>, trainer: &Trainer) -> Option<SemanticField> {
    let (width, grid) = (
        trainer.field().feature_width(),
        trainer.capacity().semantic_grid(),
    );
    SemanticField::restored(saved, width, grid)
}

/// How rays are sampled when the semantic field is trained or rendered; jittered where there is a seed.
pub fn sampling(trainer: &Trainer, jitter: Option<u64>) -> Sampling {
    Sampling::new(trainer.render_step(), [2, 8], jitter)
}
