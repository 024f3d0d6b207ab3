//! The thread behind a [`Journal`](super::Journal).

use std::collections::{BTreeMap, VecDeque};
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender};

use super::backups::Backups;
use super::contents::Pending;
use super::location::{backups_folder, same_file};
use super::{Contents, FORGET_MAPS, FORGET_RESULTS, Project, ProjectError, SceneRecord, Step};
use crate::TOLD;
use crate::labels::History;
use crate::session::{FrameMap, ModelState};

/// Time between attempts while the file cannot be written.
const RETRY: Duration = Duration::from_millis(if cfg!(test) { 20 } else { 2000 });

/// Maps are written in pieces of about this many pixels, so that an edit never waits long behind them.
const PIECE_PIXELS: usize = 1 << 20;

/// What the journal tells.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum JournalEvent {
    /// [`save_as`](super::Journal::save_as) is done; the journal goes on in this file.
    Saved {
        /// The new file.
        path: PathBuf,
    },
    /// The file could not be written. The sentence names it; the work is in memory, and the journal goes
    /// on trying.
    Failed(String),
    /// [`save_as`](super::Journal::save_as) has changed nothing, as this file is there and was not to be replaced.
    IsThere(PathBuf),
    /// [`save_as`](super::Journal::save_as) has failed and changed nothing. The sentence names the new file.
    NotSavedAs(String),
    /// Something beside the edits could not be written: the newest maps and model, or a backup, which is told once. The
    /// sentence names the file; the edits are written.
    Problem(String),
    /// After a failure everything is on the disk again.
    Recovered {
        /// The project file.
        path: PathBuf,
    },
}

/// What the writer is asked to keep.
pub(super) enum Message {
    Step(Step),
    Maps(Vec<Arc<FrameMap>>),
    Model(Arc<ModelState>),
    View(String),
    SaveAs(SaveAs),
}

/// Another name for a project.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SaveAs {
    /// The new file.
    pub path: PathBuf,
    /// Whether a file that is there is replaced.
    pub replace: bool,
    /// For work that had no name yet ([`autosave_path`](super::autosave_path)): whether its file goes. Of several requests,
    /// the first that succeeds heeds it.
    pub remove_old: bool,
}

/// Owns the project file and everything that is not in it yet.
pub(super) struct Writer {
    project: Project,
    scene: SceneRecord,
    /// The history as it is in the window, written or not.
    history: History,
    received: u64,
    /// Steps that are not in the file.
    steps: Vec<Step>,
    /// Number of edits in the file, and how many of them are in force there.
    written: (usize, usize),
    /// Whether the file has to be written anew from `history`, and how much of it is outdated.
    rewrite: Pending,
    save_as: VecDeque<SaveAs>,
    /// Whether the file was saved under another name than its first one.
    renamed: bool,
    view: Option<String>,
    view_waits: bool,
    model: Option<Arc<ModelState>>,
    maps: BTreeMap<usize, Arc<FrameMap>>,
    failing: Option<ProjectError>,
    backups: Backups,
    events: Sender<JournalEvent>,
    committed: Arc<AtomicU64>,
    wake: Box<dyn Fn() + Send>,
}

impl Writer {
    pub(super) fn new(
        project: Project,
        contents: &Contents,
        events: Sender<JournalEvent>,
        committed: Arc<AtomicU64>,
        wake: Box<dyn Fn() + Send>,
    ) -> Self {
        let mut writer = Self {
            project,
            scene: contents.scene.clone(),
            history: contents.history.clone(),
            received: 0,
            steps: Vec::new(),
            written: position(&contents.history),
            rewrite: contents.pending,
            save_as: VecDeque::new(),
            renamed: false,
            view: contents.view.clone(),
            view_waits: false,
            model: None,
            maps: BTreeMap::new(),
            failing: None,
            backups: Backups::default(),
            events,
            committed,
            wake,
        };
        if contents.pending == Pending::All {
            writer.take(Message::Maps(contents.maps.clone()));
        }
        writer
    }

    /// Works until there is nothing left to do and nobody left to ask for more.
    pub(super) fn run(mut self, messages: &Receiver<Message>) -> Result<(), ProjectError> {
        loop {
            let message = match self.pause() {
                Some(pause) => messages.recv_timeout(pause),
                None => messages.recv().map_err(RecvTimeoutError::from),
            };
            match message {
                Ok(message) => {
                    self.take(message);
                    messages.try_iter().for_each(|message| self.take(message));
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
            self.work();
            self.back_up(false);
        }
        while !self.is_idle() {
            self.work();
            if self.failing.is_some() && self.save_as.is_empty() {
                break;
            }
        }
        self.back_up(true);
        self.failing.map_or(Ok(()), Err)
    }

    /// How long to wait for a message before there is something else to do; `None`: for as long as it takes.
    fn pause(&self) -> Option<Duration> {
        if self.is_idle() {
            return self.backups.pause();
        }
        Some(match self.failing {
            Some(_) => RETRY,
            None => Duration::ZERO,
        })
    }

    /// Has a backup written where one is due, or, `at_the_end`, where the last one lacks something.
    fn back_up(&mut self, at_the_end: bool) {
        // What is not in the project file is not backed up either.
        if self.failing.is_some() {
            return;
        }
        let mut backups = std::mem::take(&mut self.backups);
        let (path, contents) = (self.project.path(), || self.contents());
        let failure = match at_the_end {
            true => backups.finish(path, contents),
            false => backups.work(path, contents),
        };
        self.backups = backups;
        if let Some(sentence) = failure {
            self.tell(JournalEvent::Problem(sentence));
        }
    }

    fn take(&mut self, message: Message) {
        match message {
            Message::Step(step) => {
                match &step {
                    Step::Import(id, images) => self.history.adopt_import(*id, Arc::clone(images)),
                    Step::Do(edit) => self.history.adopt(edit.clone()),
                    Step::Undo => drop(self.history.undo()),
                    Step::Redo => drop(self.history.redo()),
                }
                self.received += 1;
                self.steps.push(step);
                // They are of the labels of before.
                self.maps.clear();
            }
            Message::Maps(maps) => self.maps.extend(maps.into_iter().map(|map| (map.frame, map))),
            Message::Model(model) => self.model = Some(model),
            Message::View(view) => {
                self.view = Some(view);
                self.view_waits = true;
            }
            Message::SaveAs(request) => self.save_as.push_back(request),
        }
    }

    /// Whether the file lacks something that was said.
    fn is_behind(&self) -> bool {
        !self.steps.is_empty() || self.rewrite != Pending::Nothing
    }

    fn is_idle(&self) -> bool {
        !self.is_behind()
            && self.save_as.is_empty()
            && !self.view_waits
            && self.model.is_none()
            && self.maps.is_empty()
    }

    /// Does the most urgent thing that waits: edits, then Save As, then a piece of the rest.
    fn work(&mut self) {
        if self.is_behind() {
            match self.guarded(Self::write_history) {
                Ok(()) => self.everything_is_written(),
                Err(error) => self.fail(error),
            }
        } else if self.failing.is_none() && self.save_as.is_empty() {
            match self.guarded(Self::write_results) {
                Ok(()) => {}
                // All edits are in the file, and there may be room for more of them.
                Err(error) if self.project.ensure_in_place().is_ok() => {
                    (self.model, self.view_waits) = (None, false);
                    self.maps.clear();
                    let (path, reason) = (self.project.path().display(), error.reason());
                    self.tell(JournalEvent::Problem(format!(
                        "{path}: has all labels, but not its newest maps and model: {reason}"
                    )));
                }
                Err(error) => {
                    self.rewrite = self.rewrite.max(Pending::Scene);
                    self.fail(error);
                }
            }
            return;
        }
        if let Some(request) = self.save_as.pop_front() {
            self.save_as(&request);
        }
    }

    /// Writes something. A panic is an error like others, so that everything else is still written, or all of it elsewhere.
    fn guarded<T>(
        &mut self,
        write: impl FnOnce(&mut Self) -> Result<T, ProjectError>,
    ) -> Result<T, ProjectError> {
        catch_unwind(AssertUnwindSafe(|| write(self))).unwrap_or_else(|_| {
            let reason = "an internal error stopped it; save it somewhere else";
            Err(ProjectError::unwritable(self.project.path(), reason))
        })
    }

    /// Adds the steps that wait. Everything is written anew only where the file is gone, or is not as it was left: that
    /// takes more room on a disk that may be full.
    fn write_history(&mut self) -> Result<(), ProjectError> {
        let failed = self.failing.is_some();
        if failed && !self.project.path().exists() {
            self.project = Project::create(self.project.path(), &self.contents())?;
            return Ok(());
        }
        // A commit that failed in its last moment may be in the file all the same.
        if self.rewrite == Pending::Nothing && (!failed || self.project.position()? == self.written) {
            return self.project.record(&self.steps);
        }
        let outdated = self.outdated();
        self.project.rewrite(&self.scene, &self.history, outdated)
    }

    /// SQL that forgets the results in the file that do not follow from what is written anew.
    fn outdated(&self) -> &'static str {
        match self.rewrite {
            Pending::All => FORGET_RESULTS,
            _ if !self.steps.is_empty() => FORGET_MAPS,
            _ => "",
        }
    }

    fn everything_is_written(&mut self) {
        if !self.steps.is_empty() {
            self.backups.note_edit();
        }
        self.steps.clear();
        self.written = position(&self.history);
        self.rewrite = Pending::Nothing;
        self.committed.store(self.received, Ordering::Release);
        if self.failing.take().is_some() {
            let path = self.project.path().to_path_buf();
            self.tell(JournalEvent::Recovered { path });
        }
        (self.wake)();
    }

    /// Tells a failure once; what waits is tried again later.
    fn fail(&mut self, error: ProjectError) {
        if self.failing.as_ref() != Some(&error) {
            self.tell(JournalEvent::Failed(error.to_string()));
        }
        self.failing = Some(error);
    }

    fn save_as(&mut self, request: &SaveAs) {
        let is_own = || same_file(self.project.path(), &request.path);
        if !request.replace && request.path.exists() && !is_own() {
            return self.tell(JournalEvent::IsThere(request.path.clone()));
        }
        match self.guarded(|writer| writer.saved_as(&request.path)) {
            Ok(copy) => {
                if let Some(copy) = copy {
                    // Another file may have taken its place.
                    let is_own = self.project.ensure_in_place().is_ok();
                    let old_path = std::mem::replace(&mut self.project, copy).path;
                    self.backups.restart();
                    if request.remove_old && is_own && !self.renamed {
                        // Files that cannot be removed only take space.
                        let _ = fs::remove_dir_all(backups_folder(&old_path));
                        let _ = fs::remove_file(old_path);
                    }
                }
                self.renamed = true;
                self.failing = None;
                self.everything_is_written();
                let path = request.path.clone();
                self.tell(JournalEvent::Saved { path });
            }
            Err(error) => self.tell(JournalEvent::NotSavedAs(error.to_string())),
        }
    }

    /// The project as it is now under another name; `None` when it is written under that name already.
    fn saved_as(&self, path: &Path) -> Result<Option<Project>, ProjectError> {
        if same_file(self.project.path(), path) {
            if self.project.ensure_in_place().is_ok() {
                return self.failing.clone().map_or(Ok(None), Err);
            }
            // Another file may have the name, and the person wants this one to have it.
            return Project::create(path, &self.contents()).map(Some);
        }
        let copied = self.project.copy_to(path).and_then(|mut copy| {
            if self.is_behind() {
                copy.rewrite(&self.scene, &self.history, self.outdated())?;
            }
            Ok(copy)
        });
        let saved = match copied {
            // The old file may be what is broken, or what can be made again may have filled this disk, too.
            Err(_) if self.failing.is_some() => Project::create(path, &self.contents()),
            copied => copied,
        };
        saved.map(Some)
    }

    fn contents(&self) -> Contents {
        let mut contents = Contents::new(self.scene.clone(), self.history.clone());
        contents.view.clone_from(&self.view);
        contents
    }

    /// Writes one piece of what can be made again; a piece that fails is dropped.
    fn write_results(&mut self) -> Result<(), ProjectError> {
        if std::mem::take(&mut self.view_waits) {
            return self.project.save_view(self.view.as_deref().unwrap_or_default());
        }
        if let Some(model) = self.model.take() {
            return self.project.save_model(&model);
        }
        let mut piece = Vec::new();
        let mut pixels = 0;
        while pixels < PIECE_PIXELS
            && let Some((_, map)) = self.maps.pop_first()
        {
            pixels += map.width as usize * map.height as usize;
            piece.push(map);
        }
        self.project.save_maps(&piece)
    }

    fn tell(&self, event: JournalEvent) {
        match &event {
            JournalEvent::Saved { path } => tracing::info!(path = %path.display(), "the project is saved"),
            JournalEvent::Recovered { path } => {
                tracing::info!(path = %path.display(), "the project can be written again");
            }
            JournalEvent::IsThere(path) => {
                tracing::info!(path = %path.display(), "is there and not replaced");
            }
            JournalEvent::Failed(sentence)
            | JournalEvent::NotSavedAs(sentence)
            | JournalEvent::Problem(sentence) => {
                tracing::error!(target: TOLD, "{sentence}");
            }
        }
        // The owner may have gone while the rest is being written.
        let _ = self.events.send(event);
        (self.wake)();
    }
}

/// Number of edits, and how many of them are in force.
fn position(history: &History) -> (usize, usize) {
    let (edits, in_force) = history.edits();
    (edits.len(), in_force)
}
