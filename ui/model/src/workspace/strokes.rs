//! Drawing, erasing, selecting, and the edits that are taken back.

use std::collections::BTreeSet;

use inplace_core::labels::{Edit, History, Pixel, StrokeId, StrokeKind, VOID};

use super::Workspace;
use crate::document::frame_of;

impl Workspace {
    /// Where the newest line of the frame in view ends.
    pub fn line_end(&self) -> Option<Pixel> {
        let mut newest_first = self.document.strokes_on(self.frame_index).rev();
        let (_, newest) = newest_first.find(|(_, stroke)| stroke.kind() != StrokeKind::Polygon)?;
        newest.lines.last()?.last().copied()
    }

    /// Selects a stroke of the frame in view, or none.
    pub fn select(&mut self, stroke: Option<StrokeId>) {
        let strokes = &self.document.labels().strokes;
        let here = |id: &StrokeId| {
            strokes
                .get(id)
                .is_some_and(|stroke| stroke.frame == self.frame_index)
        };
        self.selected = stroke.filter(here);
    }

    /// Shows a stroke and selects it.
    pub fn go_to_stroke(&mut self, id: StrokeId) {
        let Some(stroke) = self.document.labels().strokes.get(&id).cloned() else {
            return;
        };
        // The middle of a scribble is on it; that of a polygon's rows is inside.
        let line = stroke.lines.get(stroke.lines.len() / 2);
        let middle = match line.map(Vec::as_slice) {
            Some(&[[from, y], [to, row]]) if y == row => Some([from.midpoint(to), y]),
            line => line.and_then(|line| line.get(line.len() / 2)).copied(),
        };
        self.space.shown = false;
        self.go_to(stroke.frame);
        if let Some(pixel) = middle {
            self.view.center_on(pixel);
        }
        self.select(Some(id));
    }

    /// Erases along a path on the frame in view: every eraser of the window does it here; `None` when nothing changed.
    pub(crate) fn erase(&mut self, path: &[Pixel], radius: u32) -> Option<Edit> {
        let frame = self.frame_index;
        let strokes = self.document.strokes_on(frame);
        let locked = strokes.filter(|(id, stroke)| self.locked_by(*id, stroke).is_some());
        let locked: BTreeSet<StrokeId> = locked.map(|(id, _)| id).collect();
        self.edit(|history| history.erase_where(frame, path, radius, |id| !locked.contains(&id)))
    }

    /// Changes the labels and tells the worker; `None` when nothing changed.
    pub fn edit(&mut self, change: impl FnOnce(&mut History) -> Option<Edit>) -> Option<Edit> {
        let edit = self.document.edit(change)?;
        self.overview.changed();
        if !edit.changes_maps() {
            return Some(edit);
        }
        let exists = |class| class == VOID || self.document.labels().class(class).is_some();
        if !self.class.is_some_and(exists) {
            self.class = self.document.classes().first().map(|class| class.id);
        }
        self.check_said();
        let of_object = |id| self.document.labels().class(self.object(id)?.object.class);
        let is_one = |id| of_object(id).is_some_and(|class| class.thing);
        if self.class_view.hidden.all_but.is_some_and(|id| !is_one(id)) {
            self.change_class_view(|view| view.hidden.all_but = None);
        }
        self.select(self.selected);
        self.send_labels();
        Some(edit)
    }

    /// Undoes or redoes, and shows the frame where it happened.
    pub fn step_history(&mut self, step: fn(&mut History) -> Option<Edit>) -> Option<Edit> {
        let edit = self.edit(step)?;
        let moved = frame_of(&edit).is_some_and(|frame| self.go_to(frame));
        if let Some(index) = self.suggestions.history_stepped(&edit) {
            self.show_suggestion(index);
        } else if moved && self.suggestions.at().is_some() {
            // Keys answer no place that is out of sight.
            self.suggestions.leave();
        }
        Some(edit)
    }
}
