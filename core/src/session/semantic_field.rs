//! The semantic field of a session: it learns what the maps say, and renders it from any pose.

use std::collections::HashMap;

use candle_core::{Result, Tensor};

use super::taught::{Kind, Taught, sampling};
use crate::field::Trainer;
use crate::scene::Scene;
use crate::semantics::{SemanticHead, Spread};

/// Radiance steps per step of the semantic field. After a change of the labels it has so many steps for
/// each of those, until it has followed them.
const EVERY: u64 = 2;
const BURST: u64 = 4;
/// Places of the surface, rays of any pixels and rays of labelled pixels in a step.
pub(crate) const PLACES: usize = 2048;
pub(crate) const RAYS: usize = 512;
const LABELLED_RAYS: usize = 128;
const KIND: Kind = Kind {
    name: "semantics",
    has_grid: true,
};

/// The semantic field.
pub(crate) struct SemanticField {
    pub(super) taught: Taught,
}

impl SemanticField {
    pub(super) fn new() -> Self {
        Self {
            taught: Taught::new(KIND),
        }
    }

    /// The semantic field of a saved model, where it has one that fits.
    pub(crate) fn restored(tensors: &HashMap<String, Tensor>, trainer: &Trainer) -> Self {
        Self {
            taught: Taught::restored(KIND, tensors, trainer),
        }
    }

    /// The head, once it has had a step.
    pub(crate) fn into_head(self) -> Option<SemanticHead> {
        self.taught.into_head()
    }

    /// Whether its next step comes before the next one of the radiance field.
    pub(super) fn has_the_turn(&self) -> bool {
        !self.taught.steps_due().is_multiple_of(BURST)
    }

    /// Whether a step is due after one of the radiance field, or when that `trains` no more.
    pub(super) fn is_due(&self, trainer: &Trainer, trains: bool) -> bool {
        self.taught.steps_due() > 0 || trains && trainer.steps().is_multiple_of(EVERY)
    }

    /// A step towards what the maps say and what the person said.
    pub(super) fn step(
        &mut self,
        scene: &Scene,
        trainer: &Trainer,
        spread: &Spread,
        seed: u64,
    ) -> Result<()> {
        let seed = self.taught.seed(trainer, seed);
        let soft = spread.map_targets(PLACES, seed);
        let mut rays = spread.map_rays(scene, RAYS, seed);
        rays.append(spread.labelled_rays(scene, LABELLED_RAYS, seed));
        let head = self.taught.for_step(spread.classes(), trainer, seed)?;
        let (field, occupancy) = (trainer.field(), trainer.occupancy());
        head.step(field, occupancy, &soft, &rays, sampling(trainer, Some(seed)))?;
        Ok(())
    }
}
