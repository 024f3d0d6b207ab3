//! Actions on single strokes, and the tools.

use inplace_core::labels::{ClassId, StrokeId};

use super::classes::unchanged;
use crate::model::Model;
use crate::tool::Tool;

impl Model {
    pub(crate) fn choose_tool(&mut self, tool: Tool) {
        self.state.settings.choose_tool(tool);
        if tool != Tool::Select {
            self.with_workspace(|workspace| workspace.select(None));
        }
    }

    pub(crate) fn delete_selected(&mut self) {
        let workspace = self.state.workspace();
        if let Some(stroke) = workspace.and_then(|workspace| workspace.selected) {
            self.delete_stroke(stroke);
        }
    }

    pub(crate) fn change_stroke_class(&mut self, stroke: StrokeId, class: ClassId) {
        if !self.locked_refuses_stroke(stroke) && !self.locked_refuses_change(class) {
            self.edit(|history| history.change_stroke_class(stroke, class));
        }
    }

    pub(crate) fn delete_stroke(&mut self, stroke: StrokeId) {
        if !self.locked_refuses_stroke(stroke) {
            self.edit(|history| history.delete_stroke(stroke));
        }
    }

    /// Whether the lock of a stroke's class or object keeps it as it is; then a message says so.
    fn locked_refuses_stroke(&mut self, id: StrokeId) -> bool {
        let locked = self.state.workspace().and_then(|workspace| {
            let stroke = workspace.document.labels().strokes.get(&id)?;
            workspace.locked_by(id, stroke).map(str::to_owned)
        });
        self.refuse(locked.map(unchanged))
    }
}
