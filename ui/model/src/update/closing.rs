//! Keeping and closing what is open.

use crate::effect::Effect;
use crate::model::{Model, Stage};
use crate::project_session::Results;

impl Model {
    /// Keeps and closes what is open.
    pub(crate) fn close(&mut self) {
        let results = self.results();
        self.note_recent();
        self.state.stage = Stage::Start;
        if let Some(project) = self.state.project.take() {
            self.effects.push(Effect::CloseProject(
                Box::new(project),
                results.unwrap_or_default(),
            ));
        }
        self.state.importing = None;
        // An export goes on: it has all that it needs.
        if !self.is_exporting() {
            self.state.export = None;
        }
        self.state.dialog = None;
    }

    /// Keeps the newest maps and model, so that the project shows them at once when it is opened again.
    pub(crate) fn keep_results(&mut self) {
        self.effects.extend(self.results().map(Effect::KeepResults));
    }

    fn results(&self) -> Option<Results> {
        let workspace = self.state.workspace()?;
        // Those of other frames would have to be looked up in thousands of files.
        let frames = workspace.scene.keyframes().into_iter();
        Some(Results {
            maps: frames.filter_map(|frame| workspace.newest_map(frame)).collect(),
            state: workspace.state().cloned(),
            view: workspace.kept_view(&self.state.settings),
        })
    }
}
