//! Cross-validation of the strokes beside the worker: a click must not wait for it, and newer labels end it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crossbeam_channel::Receiver;

use super::survey::in_background;
use crate::scene::Scene;
use crate::semantics::{Spread, Verdicts};

/// Checks the strokes against each other once somebody asked for it, whenever the labels or the surface are new.
#[derive(Debug, Default)]
pub(super) struct Checking {
    wanted: bool,
    due: bool,
    running: Option<Running>,
}

#[derive(Debug)]
struct Running {
    /// Generation of the labels that are checked.
    generation: u64,
    cancelled: Arc<AtomicBool>,
    answer: Receiver<Option<Verdicts>>,
}

impl Drop for Running {
    fn drop(&mut self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }
}

impl Checking {
    /// From now on somebody wants to know.
    pub(super) fn want(&mut self) {
        self.wanted = true;
        self.due = true;
    }

    /// Labels or surface are new: what is under way is of no use any more.
    pub(super) fn start_anew(&mut self) {
        self.due = true;
        self.running = None;
    }

    /// Starts to check the labels that are spread, if that is due.
    pub(super) fn start_if_due(&mut self, spread: &Spread, scene: &Arc<Scene>, generation: u64) {
        if !self.wanted || !std::mem::take(&mut self.due) {
            return;
        }
        let cancelled = Arc::new(AtomicBool::new(false));
        let (validation, stop) = (spread.cross_validation(scene), Arc::clone(&cancelled));
        // One thread: training goes on beside it, and nobody waits for the answer.
        let answer = in_background("inplace-checking", 1, move || validation.run(&stop));
        self.running = Some(Running {
            generation,
            cancelled,
            answer,
        });
    }

    /// The verdicts that have become ready with the generation of their labels. They are an extra: where the thread
    /// died there are none, and the next change of the labels tries again.
    pub(super) fn ready(&mut self) -> Option<(u64, Verdicts)> {
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
