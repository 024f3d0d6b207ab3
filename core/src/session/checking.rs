//! Leave-one-out checks of the strokes in the background: a click must not wait for them, and newer labels cancel them.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crossbeam_channel::Receiver;

use super::surface_refiner::in_background;
use crate::scene::Scene;
use crate::semantics::{LabelPropagation, LeaveOneOut};

/// Checks the strokes against each other whenever the labels or the surface change, once that has been asked for.
#[derive(Debug, Default)]
pub(super) struct Checking {
    wanted: bool,
    due: bool,
    running: Option<RunningCheck>,
}

#[derive(Debug)]
struct RunningCheck {
    /// Generation of the labels that are checked.
    generation: u64,
    cancelled: Arc<AtomicBool>,
    answer: Receiver<Option<LeaveOneOut>>,
}

impl Drop for RunningCheck {
    fn drop(&mut self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }
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
        let cancelled = Arc::new(AtomicBool::new(false));
        let (validation, stop) = (propagation.cross_validation(scene), Arc::clone(&cancelled));
        // One thread is enough: training runs at the same time, and nobody waits for the answer.
        let answer = in_background("inplace-checking", 1, move || validation.run(&stop));
        self.running = Some(RunningCheck {
            generation,
            cancelled,
            answer,
        });
    }

    /// A result that has become ready, with the generation of its labels. Where the thread died there is none, and the
    /// next change of the labels tries again.
    pub(super) fn ready(&mut self) -> Option<(u64, LeaveOneOut)> {
        let running = self.running.as_ref()?;
        let answer = match running.answer.try_recv() {
            Ok(answer) => answer,
            Err(crossbeam_channel::TryRecvError::Empty) => return None,
            Err(crossbeam_channel::TryRecvError::Disconnected) => None,
        };
        let generation = running.generation;
        self.running = None;
        Some((generation, answer?))
    }
}
