//! The semantic field of a session: it learns what the maps say, and renders it from any pose.

use std::collections::HashMap;

use candle_core::{Result, Tensor};

use crate::field::{Sampling, Trainer};
use crate::scene::Scene;
use crate::semantics::{SemanticHead, Spread};

/// Radiance steps per step of the semantic field. After a change of the labels it has so many steps for
/// each of those, until it has followed them.
const EVERY: u64 = 2;
const BURST: u64 = 4;
const FOLLOWS: u64 = 300;
/// Places of the surface, rays of any pixels and rays of labelled pixels in a step.
const PLACES: usize = 2048;
const RAYS: usize = 512;
const LABELLED_RAYS: usize = 128;
/// What the names of its parameters begin with in a saved model.
const NAME: &str = "semantics";

/// The semantic field and what it still has to learn.
#[derive(Default)]
pub(crate) struct SemanticField {
    head: Option<SemanticHead>,
    /// Steps that it needs to follow the labels.
    steps_due: u64,
}

impl SemanticField {
    /// The semantic field of a saved model, where it has one that fits.
    pub(crate) fn restored(tensors: &HashMap<String, Tensor>, trainer: &Trainer) -> Self {
        let own = Some(trainer.capacity().semantic_grid());
        Self {
            head: SemanticHead::restored(NAME, tensors, trainer.field().feature_width(), own),
            steps_due: 0,
        }
    }

    /// The head, once it has had a step.
    pub(crate) fn into_head(self) -> Option<SemanticHead> {
        self.head
    }

    /// There are new labels to follow, or `wanted` no more.
    pub(super) fn labels_changed(&mut self, wanted: bool) {
        self.steps_due = if wanted { FOLLOWS } else { 0 };
    }

    /// Whether it has followed the labels.
    pub(super) fn has_followed(&self) -> bool {
        self.steps_due == 0
    }

    /// Whether its next step comes before the next one of the radiance field.
    pub(super) fn has_the_turn(&self) -> bool {
        !self.steps_due.is_multiple_of(BURST)
    }

    /// Whether a step is due after one of the radiance field, or when that `trains` no more.
    pub(super) fn is_due(&self, trainer: &Trainer, trains: bool) -> bool {
        self.steps_due > 0 || trains && trainer.steps().is_multiple_of(EVERY)
    }

    /// A step towards what the maps say and what the person said.
    pub(super) fn step(
        &mut self,
        scene: &Scene,
        trainer: &Trainer,
        spread: &Spread,
        seed: u64,
    ) -> Result<()> {
        self.steps_due = self.steps_due.saturating_sub(1);
        let (field, classes) = (trainer.field(), spread.classes());
        let done = self.head.as_ref().map_or(0, SemanticHead::steps);
        let seed = seed ^ (trainer.steps() << 20) ^ (done << 1);
        let known = self.head.take();
        let mut head = match known {
            Some(head) if head.classes() == classes => head,
            earlier => {
                let own = Some(trainer.capacity().semantic_grid());
                SemanticHead::new(classes, field.feature_width(), own, earlier.as_ref(), seed)?
            }
        };
        let soft = spread.map_targets(PLACES, seed);
        let mut rays = spread.map_rays(scene, RAYS, seed);
        rays.append(spread.labelled_rays(scene, LABELLED_RAYS, seed));
        let sampling = sampling(trainer, seed);
        head.step(field, trainer.occupancy(), &soft, &rays, sampling)?;
        self.head = Some(head);
        Ok(())
    }

    /// Trainable parameters.
    pub(super) fn parameters(&self) -> usize {
        self.head.as_ref().map_or(0, SemanticHead::parameters)
    }

    /// The parameters by name, for saving.
    pub(super) fn state(&self) -> Result<HashMap<String, Tensor>> {
        match &self.head {
            Some(head) => head.state(NAME),
            None => Ok(HashMap::new()),
        }
    }
}

/// How rays are sampled for a step of a head.
pub(super) fn sampling(trainer: &Trainer, seed: u64) -> Sampling {
    Sampling {
        step: trainer.render_step(),
        free: 2,
        near_surface: 8,
        jitter: Some(seed),
    }
}
