//! A session followed without a window: the headless commands and the laboratory do.

use std::fmt;
use std::sync::Arc;
use std::time::Instant;

use crossbeam_channel::RecvTimeoutError;

use super::{Command, Event, FrameMap, ModelState, Session, SessionOptions, Status};
use crate::labels::LabelSet;
use crate::scene::Scene;
use crate::semantics::Surface;

/// A session with its newest status.
pub struct Client {
    pub(super) session: Session,
    status: Status,
    observe: Box<dyn FnMut(&Event)>,
}

impl fmt::Debug for Client {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut client = formatter.debug_struct("Client");
        client.field("session", &self.session).finish_non_exhaustive()
    }
}

/// A session that ended before it was done.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// It failed; its own sentence.
    #[error("{0}")]
    Failed(String),
    /// It was stopped.
    #[error("the session ended before its work was done")]
    Ended,
}

impl Client {
    /// Starts a session.
    pub fn start(options: SessionOptions) -> Self {
        Self::observing(Session::start(options, || {}), |_| {})
    }

    /// Follows a session, and shows every event to `observe` first.
    pub fn observing(session: Session, observe: impl FnMut(&Event) + 'static) -> Self {
        Self {
            session,
            status: Status::default(),
            observe: Box::new(observe),
        }
    }

    /// How training goes, as it was last reported.
    pub fn status(&self) -> &Status {
        &self.status
    }

    /// Sends a command; never waits.
    pub fn send(&self, command: Command) {
        self.session.send(command);
    }

    /// Sends the labels.
    pub fn label(&self, labels: LabelSet, generation: u64) {
        self.send(Command::Labels { labels, generation });
    }

    /// The newest map of a frame.
    pub fn map(&self, frame: usize) -> Option<Arc<FrameMap>> {
        self.session.maps().get(frame)
    }

    /// The surface of the newest maps; `None` before there is one.
    pub fn surface(&self) -> Option<Arc<Surface>> {
        self.session.maps().surface()
    }

    /// The maps of all frames, if every one of them follows these labels.
    pub fn all_maps(&self, generation: u64) -> Option<Vec<Arc<FrameMap>>> {
        let of = |frame| self.map(frame).filter(|map| map.generation == generation);
        (0..self.session.maps().len()).map(of).collect()
    }

    /// Waits for the next event, but not past the deadline; `None` when none came in time.
    ///
    /// # Errors
    /// The session failed or ended.
    pub fn next(&mut self, deadline: Option<Instant>) -> Result<Option<Event>, ClientError> {
        let events = self.session.events();
        let event = match deadline {
            Some(deadline) => events.recv_deadline(deadline),
            None => events.recv().map_err(|_| RecvTimeoutError::Disconnected),
        };
        let event = match event {
            Ok(event) => event,
            Err(RecvTimeoutError::Timeout) => return Ok(None),
            Err(RecvTimeoutError::Disconnected) => return Err(ClientError::Ended),
        };
        (self.observe)(&event);
        match &event {
            Event::Status(status) => self.status = status.clone(),
            Event::Error(reason) => return Err(ClientError::Failed(reason.clone())),
            Event::Stopped => return Err(ClientError::Ended),
            _ => {}
        }
        Ok(Some(event))
    }

    /// Waits for an event out of which `found` makes something.
    ///
    /// # Errors
    /// The session failed or ended.
    pub fn wait<T>(&mut self, mut found: impl FnMut(&Event) -> Option<T>) -> Result<T, ClientError> {
        loop {
            if let Some(found) = self.next(None)?.as_ref().and_then(&mut found) {
                return Ok(found);
            }
        }
    }

    /// Waits until `is_it` holds for an event, but not past the deadline; whether it came.
    ///
    /// # Errors
    /// The session failed or ended.
    pub fn wait_until(
        &mut self,
        deadline: Option<Instant>,
        mut is_it: impl FnMut(&Event) -> bool,
    ) -> Result<bool, ClientError> {
        while let Some(event) = self.next(deadline)? {
            if is_it(&event) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Follows the session for as long as it lasts, but not past the deadline.
    ///
    /// # Errors
    /// The session failed or ended.
    pub fn work_until(&mut self, deadline: Instant) -> Result<(), ClientError> {
        self.wait_until(Some(deadline), |_| false).map(|_| ())
    }

    /// Waits for the frames of the capture as they are [listed](Event::Listed).
    ///
    /// # Errors
    /// It cannot be opened.
    pub fn listed(&mut self) -> Result<Arc<Scene>, ClientError> {
        self.wait(|event| match event {
            Event::Listed(scene) => Some(Arc::clone(scene)),
            _ => None,
        })
    }

    /// Waits for the scene.
    ///
    /// # Errors
    /// It cannot be opened.
    pub fn opened(&mut self) -> Result<Arc<Scene>, ClientError> {
        self.wait(|event| match event {
            Event::Opened(scene) => Some(Arc::clone(scene)),
            _ => None,
        })
    }

    /// Waits until the maps of these labels are final, but not past the deadline; whether they are.
    ///
    /// # Errors
    /// The session failed or ended.
    pub fn settled(&mut self, generation: u64, deadline: Option<Instant>) -> Result<bool, ClientError> {
        self.wait_until(
            deadline,
            |event| matches!(event, Event::Status(status) if status.is_final(generation)),
        )
    }

    /// Waits until every frame has a map of these labels.
    ///
    /// # Errors
    /// The session failed or ended.
    pub fn mapped(&mut self, generation: u64) -> Result<(), ClientError> {
        let made =
            |event: &Event| matches!(event, Event::AllMaps { generation: made } if *made == generation);
        self.wait_until(None, made).map(|_| ())
    }

    /// Asks for the model as it is, and waits for it.
    ///
    /// # Errors
    /// It cannot be saved.
    pub fn saved(&mut self) -> Result<Arc<ModelState>, ClientError> {
        self.send(Command::Save);
        self.wait(|event| match event {
            Event::State(state) => Some(Arc::clone(state)),
            _ => None,
        })
    }
}
