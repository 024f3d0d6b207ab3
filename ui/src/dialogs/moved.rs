//! Asking where the scene of a project is now.

use std::path::PathBuf;

use egui::Ui;

use crate::action::{Action, Actions};
use crate::dialogs::{Purpose, confirm, path_field};
use crate::english::opening as words;

/// The question where the scene of a project is now, with the answer so far.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MovedScene {
    project: PathBuf,
    /// Where it is not.
    missing: PathBuf,
    /// The folder typed so far.
    pub path: String,
    /// What was wrong with the last answer.
    problem: Option<String>,
}

impl MovedScene {
    /// The scene is not at `missing`; `problem` says what was wrong with that as an answer.
    pub fn new(project: PathBuf, missing: PathBuf, problem: Option<String>) -> Self {
        let path = match &problem {
            Some(_) => missing.display().to_string(),
            None => String::new(),
        };
        Self {
            project,
            missing,
            path,
            problem,
        }
    }

    /// Draws the question.
    pub(super) fn show(&mut self, ui: &mut Ui, actions: &mut Actions) {
        match &self.problem {
            Some(problem) => ui.colored_label(ui.visuals().error_fg_color, problem),
            None => ui.label(words::moved(&self.project, &self.missing)),
        };
        ui.label(words::MOVED_EXPLANATION);
        let entered = path_field(ui, &mut self.path, words::MOVED_FIELD);
        if ui.button(crate::english::dialogs::BROWSE).clicked() {
            actions.push(Action::Browse(Purpose::Moved));
        }
        let path = self.path.trim();
        confirm(ui, words::MOVED_OPEN, !path.is_empty(), entered, actions, || {
            Action::OpenMoved(self.project.clone(), PathBuf::from(path))
        });
    }
}
