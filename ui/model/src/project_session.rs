//! Where the work on a scene is kept: the journal of its project file, named or not.

use std::convert::Infallible;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, Sender, TryRecvError, bounded};
use inplace_core::drop_on_thread;
use inplace_core::project::{Journal, JournalEvent, SaveAs, SceneRecord, Step, same_file};
use inplace_core::session::{Command, Event, FrameMap, ModelState, Session};

/// How long the end of a session waits for what its model has learnt.
const LAST_STATE: Duration = Duration::from_secs(2);

/// The project file behind a workspace. Nothing here ever waits.
#[derive(Debug)]
pub struct ProjectSession {
    /// `None` when no file could be opened or made: the work is in memory only.
    journal: Option<Journal>,
    /// The project file.
    pub path: PathBuf,
    /// Whether the person has chosen a name.
    pub named: bool,
    /// The scene as the work counts its frames: those that were labelled and have since vanished are the last.
    pub(crate) scene: SceneRecord,
    failing: bool,
    /// Whether the person knows that closing loses labels.
    pub(crate) told_of_loss: bool,
    /// Without a journal: the attempt to make a file that the work goes on in, if one is under way, and the steps since that
    /// began.
    pub(crate) attempt: Option<u64>,
    pub(crate) unrecorded: Vec<Step>,
}

/// The newest results of a session, or some of them; the others stay as they are in the project.
#[derive(Clone, Debug, Default)]
pub struct Results {
    /// How the scene is looked at.
    pub view: Option<String>,
    /// The newest maps of the keyframes.
    pub maps: Vec<Arc<FrameMap>>,
    /// The newest model state.
    pub state: Option<Arc<ModelState>>,
}

/// Whether the work is on the disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SavedState {
    /// All of it.
    Saved,
    /// The last edits are being written.
    Writing,
    /// It cannot be written; the journal goes on trying.
    Failing,
    /// There is no file.
    MemoryOnly,
}

impl ProjectSession {
    /// Keeps the work on a scene in this journal's file; `named` when the person chose the name.
    pub fn new(journal: Option<Journal>, path: PathBuf, named: bool, scene: SceneRecord) -> Self {
        Self {
            journal,
            path,
            named,
            scene,
            failing: false,
            told_of_loss: false,
            attempt: None,
            unrecorded: Vec::new(),
        }
    }

    /// Whether the work is on the disk.
    pub fn saved_state(&self) -> SavedState {
        match &self.journal {
            None => SavedState::MemoryOnly,
            Some(_) if self.failing => SavedState::Failing,
            Some(journal) if journal.committed() < journal.recorded() => SavedState::Writing,
            Some(_) => SavedState::Saved,
        }
    }

    /// Keeps a step through the history, in memory where there is no journal.
    pub(crate) fn record(&mut self, step: Step) {
        // There is more to lose now than what the person was told of.
        self.told_of_loss = false;
        match &self.journal {
            Some(journal) => drop(journal.record(step)),
            None => self.unrecorded.push(step),
        }
    }

    /// Keeps results, so that the project shows them at once when it is opened again.
    pub fn keep(&self, results: Results) {
        if let Some(journal) = &self.journal {
            if let Some(view) = results.view {
                journal.save_view(view);
            }
            if !results.maps.is_empty() {
                journal.save_maps(results.maps);
            }
            if let Some(state) = results.state {
                journal.save_model(state);
            }
        }
    }

    /// Goes on in another file, where there is a journal that can; `replace` if it may be there already.
    pub fn save_to(&self, path: PathBuf, replace: bool) {
        if let Some(journal) = &self.journal {
            journal.save_as(SaveAs {
                path,
                replace,
                remove_old: !self.named,
            });
        }
    }

    /// The next thing that the journal tells, if any.
    pub fn next_event(&self) -> Option<JournalEvent> {
        self.journal.as_ref()?.events().try_recv().ok()
    }

    /// Takes what the journal told into account.
    pub(crate) fn on_event(&mut self, event: &JournalEvent) {
        match event {
            JournalEvent::Saved { path } => {
                self.path.clone_from(path);
                self.named = true;
                self.failing = false;
            }
            JournalEvent::Failed(_) => {
                self.failing = true;
                self.told_of_loss = false;
            }
            JournalEvent::IsThere(_) | JournalEvent::NotSavedAs(_) | JournalEvent::Problem(_) => {}
            JournalEvent::Recovered { .. } => self.failing = false,
        }
    }

    /// Writes what is queued and ends; waits for the disk.
    pub fn close(mut self) {
        drop(self.journal.take());
    }

    /// Writes what is queued, and what the model of a session has learnt, and ends, on a thread; the file cannot be opened
    /// again before that is done.
    pub fn end(mut self, session: Option<Session>) -> Option<Ending> {
        let journal = self.journal.take()?;
        let (hold, done) = bounded(0);
        drop_on_thread(
            "inplace-journal-end",
            LastWords {
                session,
                journal,
                _hold: hold,
            },
        );
        Some(Ending {
            path: self.path.clone(),
            done,
        })
    }
}

#[cfg(test)]
impl ProjectSession {
    /// Work on a scene that is in memory only.
    pub(crate) fn of_test(scene: &inplace_core::scene::Scene) -> Self {
        Self::new(
            None,
            PathBuf::new(),
            false,
            SceneRecord::of(scene, Default::default()),
        )
    }
}

impl Drop for ProjectSession {
    fn drop(&mut self) {
        if let Some(journal) = self.journal.take() {
            drop_on_thread("inplace-journal-end", journal);
        }
    }
}

/// A journal that is to end, which waits for the disk, once it has what a session has learnt. Dropped in this order.
struct LastWords {
    session: Option<Session>,
    journal: Journal,
    _hold: Sender<Infallible>,
}

impl Drop for LastWords {
    fn drop(&mut self) {
        let state = self.session.take().and_then(|session| last_state(&session));
        state.into_iter().for_each(|state| self.journal.save_model(state));
    }
}

/// What the model of a session has learnt, if its worker tells so in time.
fn last_state(session: &Session) -> Option<Arc<ModelState>> {
    session.send(Command::Save);
    let until = Instant::now() + LAST_STATE;
    loop {
        if let Event::State(state) = session.events().recv_deadline(until).ok()? {
            return Some(state);
        }
    }
}

/// A project file that is still being written, though it was closed.
#[derive(Clone, Debug)]
pub struct Ending {
    path: PathBuf,
    done: Receiver<Infallible>,
}

impl Ending {
    /// Whether all of it is written.
    pub fn is_done(&self) -> bool {
        matches!(self.done.try_recv(), Err(TryRecvError::Disconnected))
    }

    /// Waits until all of it is written.
    pub fn wait(&self) {
        // Nothing is ever sent: the end of the other side is the news.
        let _ = self.done.recv();
    }

    /// The same if it is this file; touches the disk.
    pub fn wait_for(&self, file: &Path) {
        if same_file(&self.path, file) {
            self.wait();
        }
    }
}
