//! What things look like: a head on the field's features as an opinion beside the graph's answer.

use std::collections::HashMap;

use candle_core::{Result, Tensor};

use super::semantic_field::sampling;
use crate::field::Trainer;
use crate::scene::Scene;
use crate::semantics::{HeadLook, SemanticHead, Spread};

/// Field steps per step of the head.
const EVERY: u64 = 2;
/// Steps between looks at what it says of the surface, and steps after which it has followed the labels.
const LOOK_EVERY: u64 = 100;
const FOLLOWS: u64 = 300;
/// Places of the surface and labelled rays in a step.
const SOFT_TARGETS: usize = 1024;
const LABELLED_RAYS: usize = 128;
/// What the names of its parameters begin with in a saved model.
const NAME: &str = "head";

/// The head, what it still has to learn, and the look at what it says that is under way.
#[derive(Default)]
pub(super) struct Opinion {
    head: Option<SemanticHead>,
    /// Steps that it needs to follow the labels.
    steps_due: u64,
    look: Option<HeadLook>,
}

impl Opinion {
    /// The head of a saved model, where it has one that fits.
    pub(super) fn restored(tensors: &HashMap<String, Tensor>, trainer: &Trainer) -> Self {
        Self {
            head: SemanticHead::restored(NAME, tensors, trainer.field().feature_width(), None),
            ..Self::default()
        }
    }

    /// There are new labels to follow, or it is `wanted` no more.
    pub(super) fn labels_changed(&mut self, wanted: bool) {
        self.steps_due = if wanted { FOLLOWS } else { 0 };
    }

    /// Whether it needs more steps to follow the labels.
    pub(super) fn is_behind(&self) -> bool {
        self.steps_due > 0
    }

    /// Whether a step is due after one of the field, or when that `trains` no more.
    pub(super) fn is_due(&self, trainer: &Trainer, trains: bool) -> bool {
        if trains {
            trainer.steps().is_multiple_of(EVERY)
        } else {
            self.is_behind()
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
        let (field, classes) = (trainer.field(), spread.classes());
        let done = self.head.as_ref().map_or(0, SemanticHead::steps);
        let seed = seed ^ (trainer.steps() << 20) ^ done;
        let followed = self.steps_due == 1;
        self.steps_due = self.steps_due.saturating_sub(1);
        let mut head = match self.head.take() {
            Some(head) if head.classes() == classes => head,
            earlier => SemanticHead::new(classes, field.feature_width(), None, earlier.as_ref(), seed)?,
        };
        let soft = spread.soft_targets(SOFT_TARGETS, seed);
        let labelled = spread.labelled_rays(scene, LABELLED_RAYS, seed);
        head.step(
            field,
            trainer.occupancy(),
            &soft,
            &labelled,
            sampling(trainer, seed),
        )?;
        // Also when it has just followed the labels, so that the last of those steps are not lost.
        let due = followed || head.steps().is_multiple_of(LOOK_EVERY);
        self.head = Some(head);
        if due {
            self.start_look();
        }
        Ok(())
    }

    /// Starts a look at what the head says of every node, once it has learnt something.
    pub(super) fn start_look(&mut self) {
        let knows = |head: &SemanticHead| head.steps() >= LOOK_EVERY;
        self.look = self
            .head
            .as_ref()
            .filter(|head| knows(head))
            .map(|_| HeadLook::default());
    }

    /// Whether a look is under way.
    pub(super) fn is_looking(&self) -> bool {
        self.look.is_some()
    }

    /// Goes on with the look; at its end, what the head says of each node.
    pub(super) fn look_on(&mut self, trainer: &Trainer, spread: &Spread) -> Result<Option<Vec<f32>>> {
        let (Some(mut look), Some(head)) = (self.look.take(), &self.head) else {
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
