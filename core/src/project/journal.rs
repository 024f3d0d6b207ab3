//! The thread that writes the project file, so that nobody waits for the disk.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::JoinHandle;

use crossbeam_channel::{Receiver, Sender, unbounded};

use super::writer::Writer;
use super::{Contents, Project, ProjectError, Step};
use crate::session::{FrameMap, ModelState};

/// What the journal tells.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum JournalEvent {
    /// [`Journal::save_as`] or [`Journal::move_to`] is done; the journal goes on in this file.
    Saved {
        /// The new file.
        path: PathBuf,
    },
    /// The file could not be written. The sentence names it; the work is in memory, and the journal goes
    /// on trying.
    Failed(String),
    /// After a failure everything is on the disk again.
    Recovered {
        /// The project file.
        path: PathBuf,
    },
}

/// Writes a project in the background. Dropping it writes what is queued and waits for that.
///
/// The writer keeps a copy of the history of its own, so that after a failure, or when the file was
/// deleted under it, it can write everything again, here or under another name. Edits go before maps and
/// models; edits that queue up while the disk is busy share a transaction.
#[derive(Debug)]
pub struct Journal {
    messages: Option<Sender<Message>>,
    events: Receiver<JournalEvent>,
    recorded: AtomicU64,
    committed: Arc<AtomicU64>,
    writer: Option<JoinHandle<Result<(), ProjectError>>>,
}

/// What the writer is asked to keep.
pub(super) enum Message {
    Step(Step),
    Maps(Vec<Arc<FrameMap>>),
    Model(Arc<ModelState>),
    View(String),
    SaveAs(SaveAs),
}

/// A project that gets another name.
pub(super) struct SaveAs {
    pub(super) path: PathBuf,
    pub(super) remove_old: bool,
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

    /// Saves under another name and goes on in that file. Answered by [`JournalEvent::Saved`] or
    /// [`JournalEvent::Failed`], which changes nothing.
    pub fn save_as(&self, path: PathBuf) {
        self.send(Message::SaveAs(SaveAs {
            path,
            remove_old: false,
        }));
    }

    /// Like [`Journal::save_as`], and removes the old file: for work that had no name yet
    /// ([`autosave_path`](super::autosave_path)).
    pub fn move_to(&self, path: PathBuf) {
        self.send(Message::SaveAs(SaveAs {
            path,
            remove_old: true,
        }));
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

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;
    use std::time::{Duration, Instant};

    use super::super::tests::{contents, labelled, map, scene};
    use super::*;
    use crate::labels::{History, Stroke};
    use crate::scene::OpenOptions;

    fn start(path: &Path) -> (Journal, History) {
        let contents = contents(path.parent().unwrap());
        let project = Project::create(path, &contents).unwrap();
        let journal = Journal::start(project, &contents, || ()).unwrap();
        (journal, contents.history)
    }

    fn click(history: &mut History, x: u32) -> Step {
        Step::Do(history.add_stroke(Stroke::click(0, 1, [x, 0])))
    }

    fn wait_for(condition: impl Fn() -> bool) {
        let start = Instant::now();
        while !condition() {
            assert!(start.elapsed() < Duration::from_secs(20), "waited too long");
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    fn event(journal: &Journal) -> JournalEvent {
        journal.events().recv_timeout(Duration::from_secs(20)).unwrap()
    }

    #[test]
    fn what_is_committed_is_in_the_file_and_dropping_writes_the_rest() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("p.inplace");
        let (journal, mut history) = start(&path);
        let mut last = 0;
        for x in 0..40 {
            last = journal.record(click(&mut history, x));
        }
        history.undo();
        history.undo();
        history.redo();
        for step in [Step::Undo, Step::Undo, Step::Redo] {
            last = journal.record(step);
        }
        wait_for(|| journal.committed() == last);
        journal.record(click(&mut history, 99));
        journal.save_maps(vec![map(0, 3, 1)]);
        journal.save_view("{}".to_owned());
        drop(journal);
        let (_project, reopened) = Project::open(&path).unwrap();
        assert_eq!(reopened.history.labels(), history.labels());
        assert_eq!(reopened.history.edits(), history.edits());
        assert_eq!((reopened.maps.len(), reopened.view.as_deref()), (1, Some("{}")));
    }

    #[test]
    fn a_failure_is_told_once_and_everything_is_written_when_the_folder_is_back() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("folder");
        fs::create_dir(&folder).unwrap();
        let path = folder.join("p.inplace");
        let (journal, mut history) = start(&path);
        fs::remove_dir_all(&folder).unwrap();
        journal.record(click(&mut history, 1));
        let JournalEvent::Failed(sentence) = event(&journal) else {
            panic!("a failure is told");
        };
        assert!(sentence.contains("p.inplace"), "{sentence}");
        let last = journal.record(click(&mut history, 2));
        fs::create_dir(&folder).unwrap();
        wait_for(|| journal.committed() == last);
        let told: Vec<_> = std::iter::from_fn(|| Some(event(&journal)))
            .take_while(|event| !matches!(event, JournalEvent::Recovered { .. }))
            .collect();
        assert!(told.len() <= 1, "{told:?}");
        journal.close().unwrap();
        let (_project, reopened) = Project::open(&path).unwrap();
        assert_eq!(reopened.history.labels(), history.labels());
    }

    #[test]
    fn save_as_rescues_the_work_when_the_folder_is_gone() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("folder");
        fs::create_dir(&folder).unwrap();
        let (journal, mut history) = start(&folder.join("p.inplace"));
        fs::remove_dir_all(&folder).unwrap();
        journal.record(click(&mut history, 1));
        assert!(matches!(event(&journal), JournalEvent::Failed(_)));
        let path = root.path().join("rescued.inplace");
        journal.save_as(path.clone());
        while !matches!(event(&journal), JournalEvent::Saved { .. }) {}
        journal.record(click(&mut history, 2));
        journal.close().unwrap();
        let (_project, reopened) = Project::open(&path).unwrap();
        assert_eq!(reopened.history.labels(), history.labels());
    }

    #[test]
    fn move_to_goes_on_in_the_new_file_and_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        let (old, new) = (
            folder.path().join("auto.inplace"),
            folder.path().join("new.inplace"),
        );
        let (journal, mut history) = start(&old);
        journal.record(click(&mut history, 1));
        journal.move_to(new.clone());
        journal.record(click(&mut history, 2));
        assert_eq!(event(&journal), JournalEvent::Saved { path: new.clone() });
        journal.save_as(folder.path().join("no/such/folder.inplace"));
        assert!(matches!(event(&journal), JournalEvent::Failed(_)));
        journal.record(click(&mut history, 3));
        journal.close().unwrap();
        let files: Vec<_> = fs::read_dir(folder.path())
            .unwrap()
            .map(|f| f.unwrap().file_name())
            .collect();
        assert_eq!(files, ["new.inplace"]);
        let (_project, reopened) = Project::open(&new).unwrap();
        assert_eq!(reopened.history.labels(), history.labels());
    }

    #[test]
    fn a_changed_scene_is_written_before_anything_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("p.inplace");
        let (journal, _) = start(&path);
        journal.save_maps(vec![map(0, 1, 1), map(1, 1, 2)]);
        journal.close().unwrap();
        let (project, saved) = Project::open(&path).unwrap();
        let changed = scene(folder.path(), &["b", "new", "a"]);
        let mut saved = saved.matched(&changed, OpenOptions::default()).unwrap();
        let journal = Journal::start(project, &saved, || ()).unwrap();
        journal.record(Step::Do(saved.history.add_stroke(Stroke::click(1, 1, [0, 0]))));
        journal.close().unwrap();
        let (_project, reopened) = Project::open(&path).unwrap();
        assert_eq!(reopened.scene.stems(), ["b", "new", "a", "c"]);
        assert_eq!(labelled(&reopened), labelled(&saved));
        let labels: Vec<_> = reopened
            .maps
            .iter()
            .map(|map| (map.frame, map.labels()[0]))
            .collect();
        assert_eq!(labels, [(0, 2), (2, 1)]);
    }
}
