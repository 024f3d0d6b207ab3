//! The session as the window has it.

use std::sync::Arc;

use inplace_core::drop_on_thread;
use inplace_core::session::{Command, Event, MapSlots, Session, SessionOptions};

/// Starts sessions; `wake` is to be called after every event. Tests answer them in place of a worker.
pub type SessionStarter = Box<dyn Fn(SessionOptions, Box<dyn Fn() + Send + Sync>) -> Session>;

/// A session that ends off the UI thread: dropping it waits for the worker.
#[derive(Debug)]
pub struct Running {
    /// `None` at its end alone.
    session: Option<Session>,
    maps: Arc<MapSlots>,
}

impl Running {
    /// Takes over a session.
    pub fn new(session: Session) -> Self {
        Self {
            maps: Arc::clone(session.maps()),
            session: Some(session),
        }
    }

    /// Asks the worker to do something.
    pub fn send(&self, command: Command) {
        if let Some(session) = &self.session {
            session.send(command);
        }
    }

    /// The next thing that the worker told, if any.
    pub fn next_event(&self) -> Option<Event> {
        self.session.as_ref()?.events().try_recv().ok()
    }

    /// The newest map of every frame.
    pub fn maps(&self) -> &Arc<MapSlots> {
        &self.maps
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // Without a thread the window waits, at worst 100 ms.
        drop_on_thread("inplace-session-end", self.session.take());
    }
}
