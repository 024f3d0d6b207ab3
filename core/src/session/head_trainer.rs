//! Trains a semantic head on the labels of a session.

use std::collections::HashMap;

use candle_core::{Result, Tensor};

use crate::field::{GridShape, Sampling, Trainer};
use crate::labels::ClassId;
use crate::semantics::SemanticHead;

/// Steps that a head needs to follow a change of the labels.
const STEPS_PER_CHANGE: u64 = 300;

/// What distinguishes the heads of a session.
#[derive(Clone, Copy, Debug)]
pub(super) struct HeadKind {
    /// Prefix of its parameters' names in a saved model.
    pub(super) name: &'static str,
    /// Whether it has a grid of its own.
    pub(super) has_grid: bool,
}

impl HeadKind {
    fn grid(self, trainer: &Trainer) -> Option<GridShape> {
        self.has_grid.then(|| trainer.capacity().semantic_grid())
    }
}

/// A head and the training that it still needs.
#[derive(Debug)]
pub(super) struct HeadTrainer {
    kind: HeadKind,
    /// `None` before the first step.
    head: Option<SemanticHead>,
    steps_due: u64,
}

impl HeadTrainer {
    /// A trainer of the head in a saved model, or of a new one where `saved` has none that fits.
    pub(super) fn restored(kind: HeadKind, saved: &HashMap<String, Tensor>, trainer: &Trainer) -> Self {
        let (width, grid) = (trainer.field().feature_width(), kind.grid(trainer));
        Self {
            kind,
            head: SemanticHead::restored(kind.name, saved, width, grid),
            steps_due: 0,
        }
    }

    /// The head, once it has had a step.
    pub(super) fn head(&self) -> Option<&SemanticHead> {
        self.head.as_ref()
    }

    /// The head, once it has had a step.
    pub(super) fn into_head(self) -> Option<SemanticHead> {
        self.head
    }

    /// There are new labels to follow, or none worth training on (`wanted` is false).
    pub(super) fn labels_changed(&mut self, wanted: bool) {
        self.steps_due = if wanted { STEPS_PER_CHANGE } else { 0 };
    }

    /// Steps that the head still needs to follow the newest labels.
    pub(super) fn steps_due(&self) -> u64 {
        self.steps_due
    }

    /// The head for a step on these classes; the step is counted. Where the classes have changed, a new head takes
    /// over what it can from the earlier one.
    pub(super) fn for_step(
        &mut self,
        classes: &[ClassId],
        trainer: &Trainer,
        seed: u64,
    ) -> Result<&mut SemanticHead> {
        self.steps_due = self.steps_due.saturating_sub(1);
        let head = match self.head.take() {
            Some(head) if head.classes() == classes => head,
            earlier => {
                let (width, grid) = (trainer.field().feature_width(), self.kind.grid(trainer));
                SemanticHead::new(classes, width, grid, earlier.as_ref(), seed)?
            }
        };
        Ok(self.head.insert(head))
    }

    /// A seed for its next step.
    pub(super) fn seed(&self, trainer: &Trainer, seed: u64) -> u64 {
        let done = self.head.as_ref().map_or(0, SemanticHead::steps);
        seed ^ (trainer.steps() << 20) ^ (done << 1) ^ u64::from(self.kind.has_grid)
    }

    /// Trainable parameters.
    pub(super) fn parameters(&self) -> usize {
        self.head.as_ref().map_or(0, SemanticHead::parameters)
    }

    /// The parameters by name, for saving.
    pub(super) fn state(&self) -> Result<HashMap<String, Tensor>> {
        match &self.head {
            Some(head) => head.state(self.kind.name),
            None => Ok(HashMap::new()),
        }
    }
}

/// How rays are sampled when a head is trained or evaluated; jittered where there is a seed.
pub fn sampling(trainer: &Trainer, jitter: Option<u64>) -> Sampling {
    Sampling {
        step: trainer.render_step(),
        held_back: 0.0,
        free: 2,
        near_surface: 8,
        jitter,
    }
}
