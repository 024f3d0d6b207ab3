//! Actions of the 3D view.

use inplace_core::labels::{Pixel, Stroke, VOID};

use crate::app::App;
use crate::dialogs::Dialog;

impl App {
    /// A click of the current class on a frame that need not be in view; asks for the first class.
    pub(super) fn label_seen(&mut self, frame: usize, pixel: Pixel) {
        let Some(workspace) = self.state.workspace() else {
            return;
        };
        let Some(class) = workspace.class() else {
            let waiting = Stroke::click(frame, VOID, pixel);
            let name = String::new();
            self.state.dialog = Some(Dialog::FirstClass { name, waiting });
            return;
        };
        let click = Stroke::click(frame, class, pixel);
        if !self.lock_refuses(&click) {
            self.edit(|history| Some(history.add_stroke(click)));
        }
    }
}
