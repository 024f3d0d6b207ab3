//! Keeping and closing what is open, also when the program ends.

use std::sync::Arc;
use std::time::{Duration, Instant};

use inplace_core::session::Command;

use super::App;
use crate::keeper::Keeper;
use crate::state::Stage;
use crate::workspace::Workspace;

/// How long the end of the program waits for the worker's model state.
const LAST_STATE: Duration = Duration::from_secs(2);

impl App {
    /// Keeps and closes what is open.
    pub(crate) fn close(&mut self) {
        self.keep_results();
        self.note_recent();
        self.state.stage = Stage::Start;
        self.endings
            .extend(self.state.keeper.take().and_then(Keeper::end));
        self.state.importing = None;
        // An export goes on: it has all that it needs.
        if !self.is_exporting() {
            self.state.export = None;
        }
        self.state.dialog = None;
    }

    /// Keeps the newest maps and model, so that the project shows them at once when it is opened again.
    pub(crate) fn keep_results(&self) {
        let (Some(workspace), Some(keeper)) = (self.state.workspace(), &self.state.keeper) else {
            return;
        };
        // Those of other frames would have to be looked up in thousands of files.
        let frames = workspace.scene().keyframes();
        let maps = workspace.session().maps().map_or_else(Vec::new, |slots| {
            frames.into_iter().filter_map(|frame| slots.get(frame)).collect()
        });
        let view = workspace.kept_view(&self.state.settings);
        keeper.keep_results(maps, workspace.state(), view);
    }

    /// Waits for the model state and for the disk: the window is gone.
    pub(super) fn end(&mut self) {
        if let Stage::Open(workspace) = &mut self.state.stage
            && !workspace.has_ended()
        {
            let before = workspace.state().cloned();
            workspace.session().send(Command::Save);
            let until = Instant::now() + LAST_STATE;
            let is_new = |workspace: &Workspace| match (workspace.state(), &before) {
                (Some(now), Some(before)) => !Arc::ptr_eq(now, before),
                (now, _) => now.is_some(),
            };
            while Instant::now() < until && !is_new(workspace) && !workspace.has_ended() {
                match workspace.session().next_event() {
                    Some(event) => drop(workspace.on_event(event)),
                    None => std::thread::sleep(Duration::from_millis(5)),
                }
            }
        }
        self.keep_results();
        self.keep_preferences();
        self.note_recent_last();
        if let Some(keeper) = self.state.keeper.take() {
            keeper.close();
        }
        self.state.stage = Stage::Start;
    }
}
