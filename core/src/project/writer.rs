//! The thread behind a [`Journal`](super::Journal).

use std::collections::{BTreeMap, VecDeque};
use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, TryRecvError};

use super::contents::Pending;
use super::journal::{JournalEvent, Message, SaveAs};
use super::{Contents, Project, ProjectError, SceneRecord, Step};
use crate::TOLD;
use crate::labels::History;
use crate::session::{FrameMap, ModelState};

/// Time between attempts while the file cannot be written.
const RETRY: Duration = Duration::from_millis(if cfg!(test) { 20 } else { 2000 });

/// Maps are written in pieces of about this many pixels, so that an edit never waits long behind them.
const PIECE_PIXELS: usize = 1 << 20;

/// Owns the project file and everything that is not in it yet.
pub(super) struct Writer {
    project: Project,
    scene: SceneRecord,
    /// The history as it is in the window, written or not.
    history: History,
    received: u64,
    /// Steps that are not in the file.
    steps: Vec<Step>,
    /// The file has to be written anew from `history`.
    rewrite: Option<Pending>,
    save_as: VecDeque<SaveAs>,
    view: Option<String>,
    view_waits: bool,
    model: Option<Arc<ModelState>>,
    maps: BTreeMap<usize, Arc<FrameMap>>,
    failing: Option<ProjectError>,
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
            rewrite: None,
            save_as: VecDeque::new(),
            view: contents.view.clone(),
            view_waits: false,
            model: None,
            maps: BTreeMap::new(),
            failing: None,
            events,
            committed,
            wake,
        };
        if contents.pending != Pending::Nothing {
            writer.rewrite = Some(contents.pending);
        }
        if contents.pending == Pending::All {
            writer.take(Message::Maps(contents.maps.clone()));
        }
        writer
    }

    /// Works until there is nothing left to do and nobody left to ask for more.
    pub(super) fn run(mut self, messages: &Receiver<Message>) -> Result<(), ProjectError> {
        loop {
            let message = if self.is_idle() {
                messages.recv().map_err(|_| TryRecvError::Disconnected)
            } else if self.failing.is_some() {
                messages.recv_timeout(RETRY).map_err(|error| match error {
                    RecvTimeoutError::Timeout => TryRecvError::Empty,
                    RecvTimeoutError::Disconnected => TryRecvError::Disconnected,
                })
            } else {
                messages.try_recv()
            };
            match message {
                Ok(message) => {
                    self.take(message);
                    messages.try_iter().for_each(|message| self.take(message));
                }
                Err(TryRecvError::Empty) => {}
                Err(TryRecvError::Disconnected) => break,
            }
            self.work();
        }
        while !self.is_idle() {
            self.work();
            if self.failing.is_some() && self.save_as.is_empty() {
                break;
            }
        }
        self.failing.map_or(Ok(()), Err)
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

    fn is_idle(&self) -> bool {
        self.steps.is_empty()
            && self.rewrite.is_none()
            && self.save_as.is_empty()
            && !self.view_waits
            && self.model.is_none()
            && self.maps.is_empty()
    }

    /// Does the most urgent thing that waits: edits, then Save As, then a piece of the rest.
    fn work(&mut self) {
        if !self.steps.is_empty() || self.rewrite.is_some() {
            match self.write_history() {
                Ok(()) => self.everything_is_written(),
                Err(error) => self.fail(error),
            }
        } else if self.failing.is_none() && self.save_as.is_empty() {
            if let Err(error) = self.write_results() {
                self.fail(error);
            }
            return;
        }
        if let Some(request) = self.save_as.pop_front() {
            self.save_as(&request);
        }
    }

    fn write_history(&mut self) -> Result<(), ProjectError> {
        match self.rewrite {
            None => self.project.record(&self.steps),
            Some(pending) => {
                if !self.project.path().exists() {
                    self.project = Project::create(self.project.path(), &self.contents())?;
                    return Ok(());
                }
                if pending == Pending::All {
                    self.project.forget_results()?;
                }
                self.project.rewrite(&self.scene, &self.history)
            }
        }
    }

    fn everything_is_written(&mut self) {
        self.steps.clear();
        self.rewrite = None;
        self.committed.store(self.received, Ordering::Release);
        if self.failing.take().is_some() {
            let path = self.project.path().to_path_buf();
            self.tell(JournalEvent::Recovered { path });
        }
        (self.wake)();
    }

    /// Tells a failure once, and has everything written anew later.
    fn fail(&mut self, error: ProjectError) {
        self.rewrite = self.rewrite.max(Some(Pending::Scene));
        if self.failing.as_ref() != Some(&error) {
            self.tell(JournalEvent::Failed(error.to_string()));
        }
        self.failing = Some(error);
    }

    fn save_as(&mut self, request: &SaveAs) {
        match self.saved_as(&request.path) {
            Ok(copy) => {
                if let Some(copy) = copy {
                    let old_path = self.project.path().to_path_buf();
                    self.project = copy;
                    if request.remove_old {
                        // A file that cannot be removed only takes space.
                        let _ = fs::remove_file(old_path);
                    }
                }
                self.failing = None;
                self.everything_is_written();
                let path = request.path.clone();
                self.tell(JournalEvent::Saved { path });
            }
            Err(error) => self.tell(JournalEvent::Failed(error.to_string())),
        }
    }

    /// The project as it is now under another name; `None` when that is its name, and it is written.
    fn saved_as(&self, path: &Path) -> Result<Option<Project>, ProjectError> {
        if same_file(self.project.path(), path) {
            return self.failing.clone().map_or(Ok(None), Err);
        }
        match self.project.copy_to(path) {
            Ok(mut copy) => {
                if self.rewrite.is_some() {
                    copy.rewrite(&self.scene, &self.history)?;
                }
                Ok(Some(copy))
            }
            // The old file may be what is broken.
            Err(_) if self.failing.is_some() => Project::create(path, &self.contents()).map(Some),
            Err(error) => Err(error),
        }
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
            JournalEvent::Failed(sentence) => tracing::error!(target: TOLD, "{sentence}"),
        }
        // The owner may have gone while the rest is being written.
        let _ = self.events.send(event);
        (self.wake)();
    }
}

fn same_file(a: &Path, b: &Path) -> bool {
    a == b || matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}
