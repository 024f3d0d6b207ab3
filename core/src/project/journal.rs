//! The thread that writes the project file, so that nobody waits for the disk.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::JoinHandle;

use crossbeam_channel::{Receiver, Sender, unbounded};

use super::writer::{JournalEvent, Message, SaveAs, Writer};
use super::{Contents, Project, ProjectError, Step};
use crate::session::{FrameMap, ModelState};

/// Writes a project in the background. Dropping it writes what is queued and waits for that.
///
/// What could not be written waits, and is tried again. The writer keeps a copy of the history of its own, so that it
/// can write everything again where the file was deleted under it, or under another name. Edits go before maps and
/// models; edits that queue up while the disk is busy share a transaction. Now and then it has another thread write a
/// backup of what was said.
#[derive(Debug)]
pub struct Journal {
    messages: Option<Sender<Message>>,
    events: Receiver<JournalEvent>,
    recorded: AtomicU64,
    committed: Arc<AtomicU64>,
    writer: Option<JoinHandle<Result<(), ProjectError>>>,
}

impl Journal {
    /// Starts the writer on an open project whose contents are these (after
    /// [`Contents::matched`]: then the file is brought in line first). `wake` is called after every event
    /// and commit, from the writer's thread.
    ///
    /// # Errors
    /// [`ProjectError::Unwritable`] when the system has no thread left.
    pub fn start(
        project: Project,
        contents: &Contents,
        wake: impl Fn() + Send + 'static,
    ) -> Result<Self, ProjectError> {
        let (message_sender, messages) = unbounded();
        let (event_sender, events) = unbounded();
        let committed = Arc::new(AtomicU64::new(0));
        let path = project.path().to_path_buf();
        let writer = Writer::new(
            project,
            contents,
            event_sender,
            Arc::clone(&committed),
            Box::new(wake),
        );
        let thread = std::thread::Builder::new().name("inplace-journal".to_owned());
        let writer = thread
            .spawn(move || writer.run(&messages))
            .map_err(|error| ProjectError::writing_file(&path, &error))?;
        Ok(Self {
            messages: Some(message_sender),
            events,
            recorded: AtomicU64::new(0),
            committed,
            writer: Some(writer),
        })
    }

    /// Queues a step through the history; never waits. Returns its sequence number, from 1.
    pub fn record(&self, step: Step) -> u64 {
        let sequence = self.recorded.fetch_add(1, Ordering::Relaxed) + 1;
        self.send(Message::Step(step));
        sequence
    }

    /// Sequence number of the last step recorded.
    pub fn recorded(&self) -> u64 {
        self.recorded.load(Ordering::Relaxed)
    }

    /// Every step up to this sequence number is on the disk.
    pub fn committed(&self) -> u64 {
        self.committed.load(Ordering::Acquire)
    }

    /// Queues maps to be kept as the last ones; a map that still waits is replaced by a newer one of its
    /// frame.
    pub fn save_maps(&self, maps: Vec<Arc<FrameMap>>) {
        self.send(Message::Maps(maps));
    }

    /// Queues a model state to be kept as the last one.
    pub fn save_model(&self, model: Arc<ModelState>) {
        self.send(Message::Model(model));
    }

    /// Queues view settings, a JSON text.
    pub fn save_view(&self, json: String) {
        self.send(Message::View(json));
    }

    /// Saves under another name and goes on in that file. Answered by [`JournalEvent::Saved`], [`JournalEvent::IsThere`] or
    /// [`JournalEvent::NotSavedAs`].
    pub fn save_as(&self, request: SaveAs) {
        self.send(Message::SaveAs(request));
    }

    /// What the journal tells, oldest first.
    pub fn events(&self) -> &Receiver<JournalEvent> {
        &self.events
    }

    /// Writes everything that is queued and ends.
    ///
    /// # Errors
    /// Why something could not be written.
    pub fn close(mut self) -> Result<(), ProjectError> {
        self.finish()
    }

    fn finish(&mut self) -> Result<(), ProjectError> {
        self.messages = None;
        match self.writer.take().map(JoinHandle::join) {
            Some(Ok(result)) => result,
            // A panic has been printed; there is nothing to add.
            Some(Err(_)) | None => Ok(()),
        }
    }

    fn send(&self, message: Message) {
        if let Some(messages) = &self.messages {
            // The writer ends only when this sender does.
            let _ = messages.send(message);
        }
    }
}

impl Drop for Journal {
    fn drop(&mut self) {
        // Nobody is left to tell; `Failed` was sent before.
        let _ = self.finish();
    }
}
