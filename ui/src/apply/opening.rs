//! What does not open: back to the start page, or asking where the scene of a project is now.

use std::path::PathBuf;

use inplace_core::scene::SceneSource;

use crate::app::App;
use crate::dialogs::{Dialog, MovedScene};
use crate::opening::Target;
use crate::state::Stage;

impl App {
    /// Opening failed for this reason; a scene that has moved is asked for again.
    pub(crate) fn opening_failed(&mut self, ticket: u64, sentence: String) {
        let Some(target) = self.stop_opening(ticket) else {
            self.state.toasts.error(sentence);
            return;
        };
        match target {
            Target::Moved { project, folder } => self.ask_where(project, folder, Some(sentence)),
            _ => self.state.toasts.error(sentence),
        }
    }

    /// Goes back to the start page if this is what is being opened; returns what it was.
    fn stop_opening(&mut self, ticket: u64) -> Option<Target> {
        match &self.state.stage {
            Stage::Opening(opening) if opening.ticket == ticket => {
                let target = opening.target.clone();
                self.state.stage = Stage::Start;
                Some(target)
            }
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
            (Some(_), _) => self.state.toasts.error(sentence),
            (None, _) => {}
        }
    }

    /// Asks where the scene of a project is now; `last` is where it is not.
    fn ask_where(&mut self, project: PathBuf, last: PathBuf, problem: Option<String>) {
        self.give_up_focus();
        self.state.dialog = Some(Dialog::Moved(MovedScene::new(project, last, problem)));
    }
}
