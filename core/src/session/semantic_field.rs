//! The semantic field of a session: it learns the classes of the maps, and renders them from any pose.

use std::collections::HashMap;

use candle_core::{Result, Tensor};

use super::head_trainer::{HeadKind, HeadTrainer, sampling};
use crate::field::Trainer;
use crate::scene::Scene;
use crate::semantics::LabelPropagation;

/// Steps of the radiance field per step of the semantic field.
const EVERY: u64 = 2;
/// After a change of the labels it is the other way round: so many semantic steps per radiance step.
const BURST: u64 = 4;
/// Surface points, rays of any pixels and rays of labelled pixels in a step.
const PLACES: usize = 2048;
const RAYS: usize = 512;
const LABELLED_RAYS: usize = 128;
const KIND: HeadKind = HeadKind {
    name: "semantics",
    has_grid: true,
};

/// The semantic field.
pub(super) struct SemanticField {
    pub(super) head_trainer: HeadTrainer,
}

impl SemanticField {
    /// The semantic field of a saved model, or a new one where `saved` has none that fits.
    pub(super) fn restored(saved: &HashMap<String, Tensor>, trainer: &Trainer) -> Self {
        Self {
            head_trainer: HeadTrainer::restored(KIND, saved, trainer),
        }
    }

    /// Whether its next step comes before the radiance field's.
    pub(super) fn has_the_turn(&self) -> bool {
        !self.head_trainer.steps_due().is_multiple_of(BURST)
    }

    /// Whether a step is due. While the radiance field trains (`field`) it is due after some of its steps; later only
    /// to follow new labels.
    pub(super) fn is_due(&self, trainer: &Trainer, field: bool) -> bool {
        self.head_trainer.steps_due() > 0 || field && trainer.steps().is_multiple_of(EVERY)
    }

    /// One step towards the classes of the maps and of the strokes.
    pub(super) fn step(
        &mut self,
        scene: &Scene,
        trainer: &Trainer,
        propagation: &LabelPropagation,
        seed: u64,
    ) -> Result<()> {
        let seed = self.head_trainer.seed(trainer, seed);
        let soft = propagation.map_targets(PLACES, seed);
        let mut rays = propagation.map_rays(scene, RAYS, seed);
        rays.append(propagation.labelled_rays(scene, LABELLED_RAYS, seed));
        let head = self.head_trainer.for_step(propagation.classes(), trainer, seed)?;
        let (field, occupancy) = (trainer.field(), trainer.occupancy());
        head.step(field, occupancy, &soft, &rays, sampling(trainer, Some(seed)))?;
        Ok(())
    }
}
