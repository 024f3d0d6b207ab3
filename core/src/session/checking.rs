//! Leave-one-out checks of the strokes in the background: a click must not wait for them, and newer labels cancel them.

use std::sync::Arc;

use super::background::Background;
use crate::scene::Scene;
use crate::semantics::{LabelPropagation, LeaveOneOut};

/// Checks the strokes against each other whenever the labels or the surface change, once that has been asked for.
#[derive(Debug, Default)]
pub(super) struct Checking {
    wanted: bool,
    due: bool,
    running: Option<Background<LeaveOneOut>>,
}

impl Checking {
    /// From now on, check.
    pub(super) fn want(&mut self) {
        self.wanted = true;
        self.due = true;
    }

    /// The labels or the surface have changed: cancels the check under way and starts another one later.
    pub(super) fn start_anew(&mut self) {
        self.due = true;
        self.running = None;
    }

    /// Starts to check the strokes that are propagated now, if that is due.
    pub(super) fn start_if_due(
        &mut self,
        propagation: &LabelPropagation,
        scene: &Arc<Scene>,
        generation: u64,
    ) {
        if !self.wanted || !std::mem::take(&mut self.due) {
            return;
        }
        let validation = propagation.cross_validation(scene);
        // One thread is enough: training runs at the same time, and nobody waits for the answer.
        self.running = Some(Background::start(
            "inplace-checking",
            1,
            generation,
            |cancelled| validation.run(cancelled),
        ));
    }

    /// A result that has become ready, with the generation of its labels.
    pub(super) fn ready(&mut self) -> Option<(u64, LeaveOneOut)> {
        Background::take_ready(&mut self.running)
    }
}
