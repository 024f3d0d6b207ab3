//! When a worker tells how it goes.

use std::time::{Duration, Instant};

use super::outbox::Outbox;
use super::{Event, Status};

/// How often it is told at least while something changes.
const EVERY: Duration = Duration::from_millis(250);

/// What was told last, and when. What was told already is not told again: each event wakes the window.
pub(super) struct Pulse {
    looked: Instant,
    told: Option<Status>,
}

impl Pulse {
    pub(super) fn new() -> Self {
        Self {
            looked: Instant::now(),
            told: None,
        }
    }

    /// Somebody waits for the next status, whether it is a new one or not.
    pub(super) fn renew(&mut self) {
        self.told = None;
    }

    /// Whether it is time to look how it goes.
    pub(super) fn is_due(&self) -> bool {
        self.looked.elapsed() >= EVERY
    }

    /// Whether the end of the work was told.
    pub(super) fn told_settled(&self) -> bool {
        self.told.as_ref().is_some_and(|status| status.settled)
    }

    /// Tells how it goes if it goes otherwise than was told.
    pub(super) fn tell(&mut self, outbox: &Outbox, status: Status) {
        self.looked = Instant::now();
        if self.told.as_ref() != Some(&status) {
            outbox.send(Event::Status(status.clone()));
            self.told = Some(status);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    #[test]
    fn the_same_status_is_told_again_only_when_somebody_waits_for_it() {
        let (sender, events) = crossbeam_channel::unbounded();
        let outbox = Outbox::new(sender, Arc::default(), Box::new(|| {}));
        let mut pulse = Pulse::new();
        let settled = Status {
            settled: true,
            ..Status::default()
        };
        pulse.tell(&outbox, Status::default());
        assert!(!pulse.told_settled());
        pulse.tell(&outbox, settled.clone());
        pulse.tell(&outbox, settled.clone());
        assert!(pulse.told_settled());
        assert_eq!(events.try_iter().count(), 2);
        pulse.renew();
        assert!(!pulse.told_settled());
        pulse.tell(&outbox, settled);
        assert_eq!(events.try_iter().count(), 1);
    }
}
