//! Actions that change what is looked at.

use crate::app::App;
use crate::workspace::Workspace;

impl App {
    pub(super) fn looked_away(&mut self) {
        if let Some(stats) = &mut self.state.stats {
            stats.looked_away();
        }
    }

    pub(super) fn go_to(&mut self, frame: impl FnOnce(&Workspace) -> Option<usize>) {
        let mut moved = false;
        self.with_workspace(|workspace| {
            if let Some(frame) = frame(workspace) {
                moved = workspace.go_to(frame);
            }
        });
        if moved {
            self.looked_away();
        }
    }

    pub(super) fn next_suggestion(&mut self) {
        let Some(workspace) = self.state.workspace_mut() else {
            return;
        };
        if workspace.go_to_next_suggestion() {
            self.looked_away();
        } else {
            self.state
                .toasts
                .info("There are no suggestions yet: label something first.");
        }
    }
}
