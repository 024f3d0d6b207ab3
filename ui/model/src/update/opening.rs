//! Opening a scene or a project: find what is kept, start a session, fit what is kept to the scene, show it. What does
//! not open leads back to the start page, or to the question where the scene of a project is now. And keeping and closing
//! what is open.

use std::path::PathBuf;
use std::sync::Arc;

use inplace_core::cores;
use inplace_core::scene::reprojection::Agreement;
use inplace_core::scene::{OpenOptions, Scene, SceneSource};
use inplace_core::session::{Saved, SessionOptions};
use serde::Deserialize;
use serde_json::Value;

use crate::class_view::ClassView;
use crate::dialogs::{Dialog, MovedScene};
use crate::document::Document;
use crate::effect::Effect;
use crate::jobs::Done;
use crate::messages::About;
use crate::model::{Model, Opening, Stage};
use crate::opening::{Attached, Prepared, Refusal, Target, attach, prepare, prepare_whole};
use crate::preferences::usual_threads;
use crate::project_session::{Results, SavedState};
use crate::workspace::Workspace;

impl Model {
    /// Opens something in place of what is open, if it looks like something to open.
    pub(crate) fn open(&mut self, target: Target) {
        if self.state.workspace().is_none() || target == Target::Scene(SceneSource::Demo) {
            return self.open_at_once(target);
        }
        self.start("look", Done::Failed, move |_, _| {
            Done::LookedAt(target.problem().map_or(Ok(target), Err))
        });
    }

    /// Starts opening something; what was open is kept and closed.
    pub(crate) fn open_at_once(&mut self, target: Target) {
        if self.loses_labels() {
            return;
        }
        self.close();
        let ticket = self.begin(target.clone());
        let open = self.start.read;
        self.start("open", not_opened(ticket), move |tools, _| {
            let prepared = prepare(target, open, tools);
            Done::Prepared(ticket, Box::new(prepared))
        });
    }

    /// Something is being opened from now on; returns its ticket.
    fn begin(&mut self, target: Target) -> u64 {
        self.last_ticket += 1;
        self.state.stage = Stage::Opening(Box::new(Opening {
            ticket: self.last_ticket,
            target,
            progress: (0, 0),
            session: None,
            prepared: None,
            opened: None,
        }));
        self.last_ticket
    }

    /// Whether labels that are on no disk are still in the way of closing what is open: the first time a message says so,
    /// and a file can be chosen, unless they are being written to one. Whoever closes again without labelling more means it.
    pub(crate) fn loses_labels(&mut self) -> bool {
        let (Stage::Open(workspace), Some(project)) = (&self.state.stage, &mut self.state.project) else {
            return false;
        };
        let is_on_disk = matches!(project.saved_state(), SavedState::Saved | SavedState::Writing);
        if is_on_disk
            || !workspace.document.labels().says_anything()
            || std::mem::replace(&mut project.told_of_loss, true)
        {
            return false;
        }
        if project.attempt.is_some() {
            let sentence =
                "Your labels are being saved. They may be lost if you close again before that is done.";
            self.state.messages.warning(sentence);
            return true;
        }
        let sentence = "Your labels are in memory only: save them under a name that can be written. They are lost if you close again.";
        self.state.messages.error_about(About::Saving, sentence);
        self.show(Some(Dialog::SaveAs(String::new())));
        true
    }

    /// Keeps and closes what is open.
    pub(crate) fn close(&mut self) {
        self.note_recent();
        self.leave();
    }

    /// Keeps and closes what is open, which is not worth remembering.
    pub(crate) fn leave(&mut self) {
        self.keep_results();
        self.state.messages.withdraw(About::Saving);
        self.state.messages.withdraw(About::Scene);
        self.give_up_export();
        let session = match std::mem::take(&mut self.state.stage) {
            Stage::Open(workspace) if workspace.has_learnt() => Some(workspace.session),
            _ => None,
        };
        let project = self.state.project.take().map(Box::new);
        let ending = project.map(|project| Effect::CloseProject(project, session));
        self.effects.extend(ending);
        self.state.importing = None;
        self.stop_beginning_comparison();
        // An export that writes goes on: it has all that it needs.
        if !self.is_exporting() {
            self.state.export = None;
        }
        self.state.dialog = None;
    }

    /// Keeps the newest maps, so that the project shows them at once when it is opened again.
    pub(crate) fn keep_results(&mut self) {
        let (Some(workspace), Some(project)) = (self.state.workspace(), &self.state.project) else {
            return;
        };
        // Those of other frames would have to be looked up in thousands of files.
        let frames = workspace.scene.keyframes().into_iter();
        let maps = frames.filter_map(|frame| workspace.following_map(frame));
        project.keep(Results {
            view: Some(workspace.kept_view(&self.state.settings)),
            maps: maps.collect(),
            state: None,
        });
    }

    /// How a session works on a scene: as the command line says, or else as preferred.
    pub(crate) fn session_options(
        &self,
        source: SceneSource,
        open: OpenOptions,
        state: Option<Saved>,
    ) -> SessionOptions {
        let preferred = &self.state.preferences;
        let threads = preferred.threads.map(|threads| threads.min(cores()));
        let threads = self.start.threads.or(threads).unwrap_or_else(usual_threads);
        let features = self.start.features.as_ref().or(preferred.features.as_ref());
        SessionOptions {
            source,
            open,
            preset: self.start.preset,
            threads: threads.max(1),
            seed: self.start.seed,
            views: false,
            first_look: true,
            features: features.cloned(),
            state,
        }
    }

    pub(crate) fn start_session(&mut self, ticket: u64, prepared: Prepared) {
        let options = self.session_options(prepared.source.clone(), prepared.open, prepared.state());
        let Some(opening) = self.opening(ticket) else {
            return;
        };
        opening.prepared = Some(prepared);
        self.read = options.open;
        self.effects.push(Effect::StartSession(Box::new(options)));
    }

    /// The scene is listed, or else read: fit what is kept to it, on a thread, unless that was done.
    pub(crate) fn attach(&mut self, scene: Arc<Scene>) {
        let Stage::Opening(opening) = &mut self.state.stage else {
            return;
        };
        let (Some(prepared), Some(session)) = (opening.prepared.take(), &opening.session) else {
            return;
        };
        let maps = Arc::clone(session.maps());
        let ticket = opening.ticket;
        self.start("attach", not_opened(ticket), move |tools, _| {
            let attached = attach(prepared, &scene, &maps, tools.waker());
            Done::Attached(ticket, scene, Box::new(attached))
        });
    }

    pub(crate) fn show_workspace(&mut self, ticket: u64, scene: Arc<Scene>, attached: Attached) {
        let opening = self.opening(ticket);
        let taken = opening.and_then(|opening| Some((opening.session.take()?, opening.opened.take())));
        let Some((session, opened)) = taken else {
            // So that it is waited for when it is opened again.
            self.effects
                .push(Effect::CloseProject(Box::new(attached.project), None));
            return;
        };
        for note in &attached.notes {
            self.state.messages.warning(note);
        }
        for problem in attached.problems {
            self.state.messages.error(problem);
        }
        if let Some(sentence) = attached.unsaved {
            self.state.messages.error_about(About::Saving, sentence);
        }
        let mut settings = self.state.preferences.settings();
        // What no window wrote is left out.
        let view = attached.view.as_deref().map(serde_json::from_str::<Value>);
        let view = view.and_then(Result::ok).unwrap_or_default();
        settings.take_json(&view);
        self.state.settings = settings;
        let document = Document::new(attached.history, attached.generation);
        let mut workspace = Workspace::new(scene, ticket, session, document);
        workspace.overview.log.take_json(&view["progress"]);
        workspace.auditing.audit = Option::deserialize(&view["audit"]).unwrap_or_default();
        workspace.change_class_view(|classes| *classes = ClassView::from_json(&view));
        workspace.parts = attached.parts.into();
        self.state.project = Some(attached.project);
        self.state.stage = Stage::Open(Box::new(workspace));
        // Another scene is exported elsewhere, in the same way.
        self.state.export_choice.path.clear();
        if let Some(scene) = opened {
            self.scene_opened(scene);
        }
    }

    /// All of the scene in view is read: from now on the worker is told of the labels.
    pub(crate) fn scene_opened(&mut self, scene: Arc<Scene>) {
        let Some(workspace) = self.state.workspace_mut() else {
            return;
        };
        if !scene.has_frames_of(&workspace.scene) {
            return self.open_whole();
        }
        workspace.take_scene(Arc::clone(&scene));
        let serial = workspace.serial;
        for warning in &scene.warnings {
            self.state.messages.warning(warning);
        }
        if let Some(refinement) = &scene.pose_refinement {
            self.state.messages.info(format!("Poses refined: {refinement}"));
        }
        if scene.source != SceneSource::Demo {
            self.start("poses", Done::Failed, move |_, _| {
                Done::PosesChecked(serial, Agreement::of(&scene).warnings)
            });
        }
        self.note_recent();
    }

    /// The scene lacks frames that were listed, so that the others have other numbers: it is opened once more, without being
    /// shown before all of it is read, and what was said meanwhile is fitted to it by the names of the frames.
    fn open_whole(&mut self) {
        let (stage, project) = (&mut self.state.stage, self.state.project.take());
        let (Stage::Open(workspace), Some(project)) = (std::mem::replace(stage, Stage::Start), project)
        else {
            return;
        };
        let ticket = self.begin(Target::Scene(workspace.scene.source.clone()));
        self.give_up_export();
        (self.state.dialog, self.state.importing) = (None, None);
        self.stop_beginning_comparison();
        let (open, view) = (self.read, workspace.kept_view(&self.state.settings));
        self.start("open", not_opened(ticket), move |_, _| {
            let history = workspace.document.history().clone();
            let source = workspace.scene.source.clone();
            let prepared = prepare_whole(project, source, open, (history, view));
            Done::Prepared(ticket, Box::new(Ok(prepared)))
        });
    }

    /// The poses of a scene were held against its images; what does not fit stays on the screen until it is dismissed.
    pub(crate) fn poses_checked(&mut self, serial: u64, problems: Vec<String>) {
        if self.state.workspace_numbered(serial).is_some() {
            for problem in problems {
                self.state.messages.error_about(About::Scene, problem);
            }
        }
    }

    /// Opening failed for this reason; a scene that has moved is asked for again.
    pub(crate) fn opening_failed(&mut self, ticket: u64, sentence: String) {
        match self.stop_opening(ticket) {
            Some(Target::Moved { project, folder }) => self.ask_where(project, folder, Some(sentence)),
            _ => self.state.messages.error(sentence),
        }
    }

    /// Goes back to the start page if this is what is being opened; returns what it was.
    fn stop_opening(&mut self, ticket: u64) -> Option<Target> {
        let target = self.opening(ticket)?.target.clone();
        self.state.stage = Stage::Start;
        Some(target)
    }

    /// What is being opened, if it has this ticket.
    fn opening(&mut self, ticket: u64) -> Option<&mut Opening> {
        match &mut self.state.stage {
            Stage::Opening(opening) if opening.ticket == ticket => Some(opening),
            _ => None,
        }
    }

    /// The scene of a project is not where it was.
    pub(crate) fn scene_gone(&mut self, ticket: u64, project: PathBuf, missing: PathBuf) {
        if self.stop_opening(ticket).is_some() {
            self.ask_where(project, missing, None);
        }
    }

    /// A folder was opened that is not the scene of the project.
    pub(crate) fn other_scene(&mut self, ticket: u64, source: &SceneSource, sentence: String) {
        match (self.stop_opening(ticket), source) {
            (
                Some(Target::Moved { project, .. } | Target::Project(project) | Target::Path(project)),
                SceneSource::Folder(folder),
            ) => self.ask_where(project, folder.clone(), Some(sentence)),
            (Some(_), _) => self.state.messages.error(sentence),
            (None, _) => {}
        }
    }

    /// Asks where the scene of a project is now; `last` is where it is not.
    fn ask_where(&mut self, project: PathBuf, last: PathBuf, problem: Option<String>) {
        self.give_up_focus();
        self.state.dialog = Some(Dialog::Moved(MovedScene::new(project, last, problem)));
    }
}

/// What is told of an attempt to open something that breaks off.
fn not_opened(ticket: u64) -> impl Fn(String) -> Done {
    move |sentence| Done::Prepared(ticket, Box::new(Err(Refusal::Sentence(sentence))))
}
