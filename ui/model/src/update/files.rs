//! Actions that read and write files.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use inplace_core::scene::SceneSource;

use crate::dialogs::{Dialog, Purpose};
use crate::effect::Effect;
use crate::jobs::Done;
use crate::model::Model;
use crate::opening::{Target, new_project};
use crate::preferences::{PreferenceChange, RecentPlace};
use crate::project_session::{ProjectSession, SavedState};
use crate::workspace::Workspace;

impl Model {
    /// The system's dialog was answered. Without an answer the path fields are the way.
    pub(crate) fn picked(&mut self, purpose: Purpose, path: Option<PathBuf>) {
        let Some(path) = path else {
            return;
        };
        let asks = match &self.state.dialog {
            Some(
                Dialog::SaveAs(_)
                | Dialog::Export(_)
                | Dialog::Import { .. }
                | Dialog::Compare(_)
                | Dialog::Moved(_),
            ) => true,
            Some(Dialog::SaveClasses(_)) => purpose == Purpose::SaveClasses,
            Some(Dialog::AddClasses(_)) => purpose == Purpose::Classes,
            _ => false,
        };
        match (&mut self.state.dialog, purpose) {
            (Some(dialog), _) if asks => {
                dialog.take_path(&path);
                if matches!(dialog, Dialog::AddClasses(_)) {
                    self.read_classes(path);
                }
            }
            (_, Purpose::Scene) => self.open(Target::Scene(SceneSource::Folder(path))),
            (_, Purpose::Features) => self.prefer(PreferenceChange::Features(Some(path))),
            (_, Purpose::Project) => self.open(Target::Project(path)),
            _ => {}
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

    pub(crate) fn save_to(&mut self, path: PathBuf) {
        self.state.dialog = None;
        let (Some(_), Some(project)) = (self.state.workspace(), &self.state.project) else {
            return;
        };
        let has_file = project.saved_state() != SavedState::MemoryOnly;
        self.with_workspace(Workspace::save);
        if has_file {
            self.effects.push(Effect::SaveTo(path));
        } else {
            self.make_project(path);
        }
    }

    /// There was no file to keep the work in so far: make one.
    fn make_project(&mut self, path: PathBuf) {
        if let Some(project) = &mut self.state.project {
            // It gets all of the history so far.
            project.unrecorded.clear();
        }
        let Some(workspace) = self.state.workspace() else {
            return;
        };
        let (serial, scene) = (workspace.serial, Arc::clone(&workspace.scene));
        let (open, history) = (self.read, workspace.document.history().clone());
        self.start("save", move |tools, _| {
            match new_project(path, &scene, open, history, tools.waker()) {
                Ok(project) => Done::Kept(serial, Box::new(project)),
                Err(error) => Done::Failed(error.to_string()),
            }
        });
    }

    /// The work in memory has a file from now on.
    pub(crate) fn project_made(&mut self, serial: u64, project: ProjectSession) {
        if let Some(workspace) = self.state.workspace()
            && workspace.serial == serial
        {
            let before = self.state.place();
            let path = project.path.clone();
            let memory_only = self.state.project.replace(project);
            let since = memory_only.map(|mut project| std::mem::take(&mut project.unrecorded));
            self.effects
                .extend(since.into_iter().flatten().map(Effect::Record));
            self.saved_to(&path, before);
        }
    }

    /// The work is in this file now; `before` is where it was opened from.
    pub(crate) fn saved_to(&mut self, path: &Path, before: Option<RecentPlace>) {
        self.keep_results();
        self.note_named(before);
        self.state.messages.info(format!("Saved to {}", path.display()));
    }
}
