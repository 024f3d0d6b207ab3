//! Actions that read and write files.

use std::path::{Path, PathBuf};

use inplace_core::scene::SceneSource;

use crate::dialogs::{Dialog, ExportChoice, MovedScene, Purpose};
use crate::effect::Effect;
use crate::jobs::Done;
use crate::messages::About;
use crate::model::{Model, Stage};
use crate::opening::{Target, new_project};
use crate::preferences::{PreferenceChange, RecentPlace};
use crate::project_session::{ProjectSession, Results, SavedState};
use crate::workspace::Workspace;

impl Model {
    /// The system's dialog was answered. Without an answer the path fields are the way.
    pub(crate) fn picked(&mut self, purpose: Purpose, path: Option<PathBuf>) {
        let Some(path) = path else {
            return;
        };
        match (purpose, &mut self.state.dialog) {
            (Purpose::Scene, _) => self.open(Target::Scene(SceneSource::Folder(path))),
            (Purpose::Project, _) => self.open(Target::Project(path)),
            (Purpose::Features, _) => self.prefer(PreferenceChange::Features(Some(path))),
            (Purpose::Classes, Some(Dialog::AddClasses(dialog))) => {
                dialog.path = path.display().to_string();
                self.read_classes(path);
            }
            (Purpose::SaveAs, Some(Dialog::SaveAs(field)))
            | (Purpose::Export, Some(Dialog::Export(ExportChoice { path: field, .. })))
            | (Purpose::Import, Some(Dialog::Import { path: field, .. }))
            | (Purpose::Compare, Some(Dialog::Compare(field)))
            | (Purpose::SaveClasses, Some(Dialog::SaveClasses(field)))
            | (Purpose::Moved, Some(Dialog::Moved(MovedScene { path: field, .. }))) => {
                *field = path.display().to_string();
            }
            // The dialog that asked was closed meanwhile.
            _ => {}
        }
    }

    /// A file or a folder was dropped onto the window: it is what the dialog asks for, or else something to open.
    pub(crate) fn dropped(&mut self, path: PathBuf) {
        match &self.state.dialog {
            None | Some(Dialog::Open(_)) => self.open(Target::Path(path)),
            Some(dialog) => {
                if let Some(purpose) = dialog.purpose() {
                    self.picked(purpose, Some(path));
                }
            }
        }
    }

    pub(crate) fn save(&mut self) {
        let (Some(_), Some(project)) = (self.state.workspace(), &self.state.project) else {
            return;
        };
        if !project.named || project.saved_state() == SavedState::MemoryOnly {
            self.show(Some(Dialog::SaveAs(String::new())));
            return;
        }
        let path = project.path.display().to_string();
        let failing = project.saved_state() == SavedState::Failing;
        self.with_workspace(Workspace::save);
        self.keep_results();
        if failing {
            let sentence =
                format!("{path} still cannot be written; save under another name with \"Save as\".");
            self.state.messages.error(sentence);
        } else {
            self.state.messages.info(format!("Saved to {path}"));
        }
    }

    /// Goes on in this file; `replace` if it may be there already.
    pub(crate) fn save_to(&mut self, path: PathBuf, replace: bool) {
        self.state.dialog = None;
        let (Stage::Open(workspace), Some(project)) = (&mut self.state.stage, &mut self.state.project) else {
            return;
        };
        workspace.save();
        if project.saved_state() != SavedState::MemoryOnly {
            return project.save_to(path, replace);
        }
        // There was no file to keep the work in so far: one is made, and gets all of the history so far.
        self.last_ticket += 1;
        let attempt = self.last_ticket;
        project.attempt = Some(attempt);
        project.told_of_loss = false;
        project.unrecorded.clear();
        let (scene, history) = (project.scene.clone(), workspace.document.history().clone());
        let not_kept = move |sentence| Done::NotKept(attempt, sentence);
        self.start("save", not_kept, move |tools, _| {
            if !replace && path.exists() {
                return Done::IsThere(attempt, path);
            }
            match new_project(path, scene, history, tools.waker()) {
                Ok(project) => Done::Kept(attempt, Box::new(project)),
                Err(error) => Done::NotKept(attempt, error.to_string()),
            }
        });
    }

    /// No file was made of the work in memory, for this reason.
    pub(crate) fn not_kept(&mut self, attempt: u64, sentence: String) {
        let project = self.state.project.as_mut();
        if let Some(project) = project.filter(|project| project.attempt == Some(attempt)) {
            project.attempt = None;
        }
        self.state.messages.error(sentence);
    }

    /// A file is there already under the name that was chosen: the person is asked whether it is to be replaced.
    pub(crate) fn is_there(&mut self, attempt: Option<u64>, path: PathBuf) {
        let project = self.state.project.as_mut();
        // Another file may have been chosen meanwhile.
        let Some(project) = project.filter(|project| project.attempt == attempt) else {
            return;
        };
        project.attempt = None;
        if self.state.dialog.is_none() {
            return self.show(Some(Dialog::ReplaceFile(path)));
        }
        let sentence = format!("{}: already exists, and was not replaced.", path.display());
        self.state.messages.error(sentence);
    }

    /// The work in memory has a file from now on, unless the scene was closed or another file was chosen meanwhile.
    pub(crate) fn project_made(&mut self, attempt: u64, mut project: ProjectSession) {
        let memory_only = self.state.project.as_mut();
        let Some(memory_only) = memory_only.filter(|waiting| waiting.attempt == Some(attempt)) else {
            self.effects.push(Effect::CloseProject(Box::new(project), None));
            return;
        };
        let steps = memory_only.unrecorded.drain(..);
        steps.for_each(|step| project.record(step));
        let (before, path) = (self.state.place(), project.path.clone());
        self.state.project = Some(project);
        self.saved_to(&path, before);
    }

    /// The work is in this file now; `before` is where it was opened from.
    pub(crate) fn saved_to(&mut self, path: &Path, before: Option<RecentPlace>) {
        self.keep_results();
        if let (Some(workspace), Some(project)) = (self.state.workspace(), &self.state.project) {
            project.keep(Results {
                state: workspace.state.clone(),
                ..Results::default()
            });
        }
        // The scene is no longer what goes on with the work.
        if let Some(before) = before {
            self.state.preferences.recents.forget(&before);
        }
        self.note_recent();
        self.state.messages.withdraw(About::Saving);
        self.state.messages.info(format!("Saved to {}", path.display()));
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use inplace_core::labels::{History, Stroke};
    use inplace_core::project::{Contents, JournalEvent};
    use inplace_core::scene::demo::Shot;

    use super::*;
    use crate::dialogs::ClassUse;
    use crate::document::Document;
    use crate::jobs::{Job, JobTools};
    use crate::model::Start;
    use crate::preferences::Preferences;
    use crate::{Command, Input};

    fn job(effects: Vec<Effect>) -> Job {
        let job = effects.into_iter().find_map(|effect| match effect {
            Effect::Start(job) => Some(job),
            _ => None,
        });
        job.unwrap()
    }

    fn run(model: &mut Model, job: Job) {
        let done = Mutex::new(None);
        job.run(&JobTools::of_test(), &|told| *done.lock().unwrap() = Some(told));
        let done = done.into_inner().unwrap();
        model.update(Input::Done(done.unwrap()));
    }

    #[test]
    fn what_is_nothing_to_open_leaves_what_is_open_and_a_dropped_path_is_what_the_dialog_asks_for() {
        let folder = tempfile::tempdir().unwrap();
        let mut model = Model::new(Start::default(), Preferences::default());
        let workspace = Workspace::of_test(Shot::new(1, [16, 16]).scene(&|_, _| {}));
        model.state.stage = Stage::Open(Box::new(workspace));
        let text = folder.path().join("notes.txt");
        std::fs::write(&text, "no project").unwrap();
        for path in [folder.path().to_path_buf(), folder.path().join("gone"), text] {
            model.state.dialog = Some(Dialog::Open(path.display().to_string()));
            let look = job(model.update(Command::Dropped(path.clone())));
            run(&mut model, look);
            assert!(model.workspace().is_some() && model.dialog.is_some());
            let error = &model.messages.shown.last().unwrap().text;
            assert!(error.contains(&*path.display().to_string()), "{error}");
        }
        model.state.dialog = Some(Dialog::import());
        model.update(Command::Dropped(PathBuf::from("labels")));
        assert!(matches!(&model.dialog, Some(Dialog::Import { path, .. }) if path == "labels"));
        model.state.dialog = Some(Dialog::Help);
        assert!(model.update(Command::Dropped(PathBuf::from("labels"))).is_empty());
        model.state.dialog = None;
        let look = job(model.update(Command::Open(Target::Scene(SceneSource::Demo))));
        run(&mut model, look);
        assert!(matches!(model.stage, Stage::Opening(_)));
    }

    #[test]
    fn a_picked_path_goes_to_what_asked_for_it_whatever_dialog_is_shown_by_then() {
        let mut model = Model::new(Start::default(), Preferences::default());
        model.state.dialog = Some(Dialog::SaveAs("mine.inplace".to_owned()));
        let network = PathBuf::from("network.onnx");
        model.update(Input::Done(Done::Picked(
            Purpose::Features,
            Some(network.clone()),
        )));
        model.update(Input::Done(Done::Picked(
            Purpose::Export,
            Some(PathBuf::from("labels")),
        )));
        assert_eq!(model.dialog, Some(Dialog::SaveAs("mine.inplace".to_owned())));
        assert_eq!(model.preferences.features, Some(network));
        model.update(Input::Done(Done::Picked(
            Purpose::SaveAs,
            Some(PathBuf::from("other.inplace")),
        )));
        assert_eq!(model.dialog, Some(Dialog::SaveAs("other.inplace".to_owned())));
    }

    #[test]
    fn work_in_memory_goes_on_in_the_file_that_was_chosen_last_with_every_step() {
        let folder = tempfile::tempdir().unwrap();
        let mut model = Model::new(Start::default(), Preferences::default());
        // The last frame of the capture has vanished since it was labelled.
        let scene = |frames| Shot::new(frames, [16, 16]).scene(&|_, _| {});
        let mut workspace = Workspace::of_test(scene(2));
        let mut history = History::default();
        let (class, _) = history.add_class("chair");
        history.add_stroke(Stroke::click(2, class, [3, 3]));
        workspace.document = Document::new(history, 0);
        model.state.project = Some(ProjectSession::of_test(&scene(3)));
        model.state.stage = Stage::Open(Box::new(workspace));
        std::fs::write(folder.path().join("second.inplace"), "another file").unwrap();
        let add = |model: &mut Model, name: &str| {
            model.update(Command::AddClass(ClassUse::Choose, name.to_owned()));
        };
        let save =
            |model: &mut Model, name: &str| job(model.update(Command::SaveTo(folder.path().join(name))));
        add(&mut model, "wall");
        let first = save(&mut model, "first.inplace");
        add(&mut model, "floor");
        let second = save(&mut model, "second.inplace");
        run(&mut model, first);
        add(&mut model, "door");
        run(&mut model, second);
        let second = folder.path().join("second.inplace");
        assert_eq!(
            model.dialog,
            Some(Dialog::ReplaceFile(second.clone())),
            "that file is there"
        );
        let again = job(model.update(Command::ReplaceFile(second)));
        run(&mut model, again);
        add(&mut model, "lamp");
        // A name that cannot be had changes nothing about the file that there is.
        let sentence = "third.inplace: cannot be saved".to_owned();
        model.update(Input::Journal(JournalEvent::NotSavedAs(sentence)));
        let project = model.state.project.take().unwrap();
        assert_ne!(project.saved_state(), SavedState::Failing);
        let path = project.path.clone();
        assert!(path.ends_with("second.inplace"));
        project.close();
        let kept = Contents::read(&path).unwrap().history;
        assert_eq!(kept.labels().classes.len(), 5);
        let strokes: Vec<usize> = kept
            .labels()
            .strokes
            .values()
            .map(|stroke| stroke.frame)
            .collect();
        assert_eq!(strokes, [2]);
    }
}
