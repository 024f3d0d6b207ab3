//! The seam between the window and the worker, so that tests can stand in for the worker.

use std::sync::Arc;

use inplace_core::drop_on_thread;
use inplace_core::session::{Command, Event, MapSlots, Session, SessionOptions};

/// A running session as the window sees it. Nothing here ever waits.
pub trait SessionLink: Send {
    /// Asks the worker to do something.
    fn send(&self, command: Command);
    /// The next thing that the worker told, if any.
    fn next_event(&self) -> Option<Event>;
    /// The newest map of every frame.
    fn maps(&self) -> &Arc<MapSlots>;
}

impl SessionLink for Session {
    fn send(&self, command: Command) {
        Self::send(self, command);
    }

    fn next_event(&self) -> Option<Event> {
        self.events().try_recv().ok()
    }

    fn maps(&self) -> &Arc<MapSlots> {
        Self::maps(self)
    }
}

/// Starts sessions; `wake` is to be called after every event.
pub type SessionStarter = Box<dyn Fn(SessionOptions, Box<dyn Fn() + Send + Sync>) -> Box<dyn SessionLink>>;

/// Starts real sessions.
pub fn real_sessions() -> SessionStarter {
    Box::new(|options, wake| Box::new(Session::beside_window(options, wake)))
}

/// A session that ends off the UI thread: dropping it waits for the worker.
pub struct Running {
    /// `None` at its end alone.
    session: Option<Box<dyn SessionLink>>,
    maps: Arc<MapSlots>,
}

impl Running {
    /// Takes over a session.
    pub fn new(session: Box<dyn SessionLink>) -> Self {
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
        self.session.as_ref()?.next_event()
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

impl std::fmt::Debug for Running {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("Running").finish_non_exhaustive()
    }
}
