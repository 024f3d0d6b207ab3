//! Actions that change what is looked at.

use crate::app::App;
use crate::workspace::Workspace;

impl App {
    pub(crate) fn looked_away(&mut self) {
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
            self.leave_suggestions();
            self.looked_away();
        }
    }

    pub(super) fn find_frame(&mut self, text: &str) {
        let found = self
            .state
            .workspace()
            .and_then(|workspace| workspace.frame_named(text));
        if found.is_some() {
            self.go_to(|_| found);
        } else if !text.trim().is_empty() {
            self.state
                .toasts
                .info(crate::english::frames::not_found(text.trim()));
        }
    }
}
