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

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    #[test]
    fn the_same_status_is_reported_again_only_on_request() {
        let (sender, events) = crossbeam_channel::unbounded();
        let outbox = Outbox::new(sender, Arc::default(), Box::new(|| {}));
        let mut reporter = StatusReporter::new();
        let settled = Status {
            settled: true,
            ..Status::default()
        };
        reporter.report(&outbox, Status::default());
        assert!(!reporter.reported_settled());
        reporter.report(&outbox, settled.clone());
        reporter.report(&outbox, settled.clone());
        assert!(reporter.reported_settled());
        assert_eq!(events.try_iter().count(), 2);
        reporter.repeat_next();
        assert!(!reporter.reported_settled());
        reporter.report(&outbox, settled);
        assert_eq!(events.try_iter().count(), 1);
    }
}
