//! When a worker reports its status.

use std::time::{Duration, Instant};

use super::outbox::Outbox;
use super::{Event, Status};

/// Time between reports while something changes.
const EVERY: Duration = Duration::from_millis(250);

/// Reports the status at intervals. A status that was reported already is left out: each event wakes the window.
pub(super) struct StatusReporter {
    checked: Instant,
    reported: Option<Status>,
}

impl StatusReporter {
    pub(super) fn new() -> Self {
        Self {
            checked: Instant::now(),
            reported: None,
        }
    }

    /// Report the next status even if it is the same as the last.
    pub(super) fn repeat_next(&mut self) {
        self.reported = None;
    }

    /// Whether it is time for the next report.
    pub(super) fn is_due(&self) -> bool {
        self.checked.elapsed() >= EVERY
    }

    /// Whether the newest reported status says that the work is complete.
    pub(super) fn reported_settled(&self) -> bool {
        self.reported.as_ref().is_some_and(|status| status.settled)
    }

    /// Reports a status unless it is the one reported last.
    pub(super) fn report(&mut self, outbox: &Outbox, status: Status) {
        self.checked = Instant::now();
        if self.reported.as_ref() != Some(&status) {
            self.log(&status);
            outbox.send(Event::Status(status.clone()));
            self.reported = Some(status);
        }
    }

    /// Logs milestones of training: each doubling of the steps, and the end.
    fn log(&self, status: &Status) {
        let last = self.reported.as_ref();
        let doubled = last.is_none_or(|last| last.steps.checked_ilog2() < status.steps.checked_ilog2());
        if doubled || last.is_some_and(|last| last.settled != status.settled) {
            tracing::info!(
                phase = ?status.phase,
                steps = status.steps,
                held_out_psnr_db = status.held_out_psnr,
                depth_error_m = status.depth_error,
                settled = status.settled,
                "training"
            );
        }
    }
}
