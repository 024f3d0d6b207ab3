//! Actions that read and write files.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use inplace_core::scene::SceneSource;

use crate::dialogs::{Dialog, ExportChoice, MovedScene, Purpose};
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
        if project.saved_state() == SavedState::MemoryOnly {
            self.make_project(path);
        } else {
            project.save_to(path);
        }
        self.with_workspace(Workspace::save);
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
    pub(crate) fn project_made(&mut self, serial: u64, mut project: ProjectSession) {
        let workspace = self.state.workspace();
        if workspace.is_none_or(|workspace| workspace.serial != serial) {
            self.effects.push(Effect::CloseProject(Box::new(project)));
            return;
        }
        if let Some(memory_only) = &mut self.state.project {
            memory_only
                .unrecorded
                .drain(..)
                .for_each(|step| project.record(step));
        }
        let (before, path) = (self.state.place(), project.path.clone());
        self.state.project = Some(project);
        self.saved_to(&path, before);
    }

    /// The work is in this file now; `before` is where it was opened from.
    pub(crate) fn saved_to(&mut self, path: &Path, before: Option<RecentPlace>) {
        self.keep_results();
        // The scene is no longer what goes on with the work.
        if let Some(before) = before {
            self.state.preferences.recents.forget(&before);
        }
        self.note_recent();
        self.state.messages.info(format!("Saved to {}", path.display()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Input;
    use crate::model::Start;
    use crate::preferences::Preferences;

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
}
