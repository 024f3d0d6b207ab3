//! Actions that change what is looked at.

use crate::frames::find;
use crate::model::Model;
use crate::workspace::Workspace;

impl Model {
    pub(crate) fn go_to(&mut self, frame: impl FnOnce(&Workspace) -> Option<usize>) {
        let moved = |workspace: &mut Workspace| frame(workspace).is_some_and(|frame| workspace.go_to(frame));
        if self.with_workspace(moved) {
            self.leave_suggestions();
        }
    }

    pub(crate) fn find_frame(&mut self, text: &str) {
        let found = self.state.workspace().and_then(|workspace| {
            let stems = workspace.scene.frames.iter().map(|frame| frame.stem.as_str());
            find(&stems.collect::<Vec<_>>(), text, workspace.frame_index)
        });
        if found.is_some() {
            self.go_to(|_| found);
        } else if !text.trim().is_empty() {
            let text = text.trim();
            let sentence = format!("No frame has this number, or a name with \"{text}\" in it.");
            self.state.messages.info(sentence);
        }
    }
}
