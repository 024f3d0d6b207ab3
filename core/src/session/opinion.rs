//! What things look like: a head on the field's features as an opinion beside the graph's answer.

use std::collections::HashMap;

use candle_core::{Result, Tensor};

use super::taught::{Kind, Taught, sampling};
use crate::field::Trainer;
use crate::scene::Scene;
use crate::semantics::{HeadLook, SemanticHead, Spread};

/// Field steps per step of the head.
const EVERY: u64 = 2;
/// Steps between looks at what it says of the surface.
const LOOK_EVERY: u64 = 100;
/// Places of the surface and labelled rays in a step.
const SOFT_TARGETS: usize = 1024;
const LABELLED_RAYS: usize = 128;
const KIND: Kind = Kind {
    name: "head",
    has_grid: false,
};

/// The head and the look at what it says that is under way.
pub(super) struct Opinion {
    pub(super) taught: Taught,
    look: Option<HeadLook>,
}

impl Opinion {
    pub(super) fn new() -> Self {
        Self {
            taught: Taught::new(KIND),
            look: None,
        }
    }

    /// That of a saved model, where it has one that fits.
    pub(super) fn restored(tensors: &HashMap<String, Tensor>, trainer: &Trainer) -> Self {
        Self {
            taught: Taught::restored(KIND, tensors, trainer),
            look: None,
        }
    }

    /// Whether a step is due after one of the field, or when that `trains` no more.
    pub(super) fn is_due(&self, trainer: &Trainer, trains: bool) -> bool {
        if trains {
            trainer.steps().is_multiple_of(EVERY)
        } else {
            self.taught.steps_due() > 0
        }
    }

    /// A step; every now and then, a look at what it says begins.
    pub(super) fn step(
        &mut self,
        scene: &Scene,
        trainer: &Trainer,
        spread: &Spread,
        seed: u64,
    ) -> Result<()> {
        let seed = self.taught.seed(trainer, seed);
        // Also when it has just followed the labels, so that the last of those steps are not lost.
        let followed = self.taught.steps_due() == 1;
        let soft = spread.soft_targets(SOFT_TARGETS, seed);
        let labelled = spread.labelled_rays(scene, LABELLED_RAYS, seed);
        let head = self.taught.for_step(spread.classes(), trainer, seed)?;
        let (field, occupancy) = (trainer.field(), trainer.occupancy());
        head.step(field, occupancy, &soft, &labelled, sampling(trainer, Some(seed)))?;
        if followed || head.steps().is_multiple_of(LOOK_EVERY) {
            self.start_look();
        }
        Ok(())
    }

    /// Starts a look at what the head says of every node, once it has learnt something.
    pub(super) fn start_look(&mut self) {
        let knows = |head: &&SemanticHead| head.steps() >= LOOK_EVERY;
        self.look = self.taught.head().filter(knows).map(|_| HeadLook::default());
    }

    /// Whether a look is under way.
    pub(super) fn is_looking(&self) -> bool {
        self.look.is_some()
    }

    /// Goes on with the look; at its end, what the head says of each node.
    pub(super) fn look_on(&mut self, trainer: &Trainer, spread: &Spread) -> Result<Option<Vec<f32>>> {
        let (Some(mut look), Some(head)) = (self.look.take(), self.taught.head()) else {
            return Ok(None);
        };
        // Classes came or went: the head learns them first.
        if head.classes() != spread.classes() {
            return Ok(None);
        }
        let said = look.advance(spread, head, trainer.field())?;
        if said.is_none() {
            self.look = Some(look);
        }
        Ok(said)
    }
}
