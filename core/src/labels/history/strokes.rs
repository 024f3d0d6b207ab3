//! Edits of strokes: drawing, erasing, deleting, and giving them to another class.

use super::History;
use crate::labels::{ClassId, Edit, Pixel, Stroke, StrokeChange, StrokeId, VOID, erase};

impl History {
    /// Adds a stroke; returns the edit.
    pub fn add_stroke(&mut self, stroke: Stroke) -> Edit {
        let name = self.name_of(&stroke);
        self.last_stroke += 1;
        let change = StrokeChange {
            id: StrokeId(self.last_stroke),
            before: None,
            after: Some(stroke),
        };
        self.commit_strokes(name, vec![change])
    }

    /// Erases along a path on one frame, but only strokes of classes that may be erased; `None` when none of them
    /// was under the eraser.
    pub fn erase_where(
        &mut self,
        frame: usize,
        path: &[Pixel],
        radius: u32,
        may_erase: impl Fn(StrokeId) -> bool,
    ) -> Option<Edit> {
        let strokes: Vec<StrokeChange> = self
            .labels
            .strokes_of(frame)
            .filter(|(id, _)| may_erase(*id))
            .filter_map(|(id, stroke)| {
                let rest = erase(stroke, path, radius)?;
                let after = (!rest.lines.is_empty()).then_some(rest);
                Some(StrokeChange::of(id, stroke, after))
            })
            .collect();
        (!strokes.is_empty()).then(|| self.commit_strokes("erase".to_owned(), strokes))
    }

    /// Deletes one stroke; `None` when there is no such stroke.
    pub fn delete_stroke(&mut self, id: StrokeId) -> Option<Edit> {
        let stroke = self.labels.strokes.get(&id)?;
        let name = format!("delete {}", self.name_of(stroke));
        let change = StrokeChange::of(id, stroke, None);
        Some(self.commit_strokes(name, vec![change]))
    }

    /// Makes one stroke say another class, which may be void, and no object; `None` when there is no such stroke or class, or
    /// nothing changes.
    pub fn change_stroke_class(&mut self, id: StrokeId, class: ClassId) -> Option<Edit> {
        let stroke = self.labels.strokes.get(&id)?;
        let known = class == VOID || self.labels.class(class).is_some();
        if !known || stroke.class == class {
            return None;
        }
        let name = format!("change {} to {}", self.name_of(stroke), self.class_name(class));
        let after = Stroke {
            class,
            object: None,
            ..stroke.as_ref().clone()
        };
        let change = StrokeChange::of(id, stroke, Some(after));
        Some(self.commit_strokes(name, vec![change]))
    }

    /// Commits an edit of strokes alone.
    fn commit_strokes(&mut self, name: String, strokes: Vec<StrokeChange>) -> Edit {
        self.commit(Edit {
            name,
            strokes,
            ..Edit::default()
        })
    }

    /// What a stroke is and says: "scribble wall".
    pub(super) fn name_of(&self, stroke: &Stroke) -> String {
        format!("{} {}", stroke.kind().name(), self.class_name(stroke.class))
    }

    fn class_name(&self, id: ClassId) -> String {
        self.labels
            .class(id)
            .map_or_else(|| "void".to_owned(), |class| class.name.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::history::tests::history;

    #[test]
    fn one_stroke_is_deleted_or_changed_and_undo_brings_it_back() {
        let (mut history, wall, floor) = history();
        let polygon = Stroke::polygon(2, wall, &[[1, 1], [5, 1], [5, 4]]);
        let [click, region] =
            [Stroke::click(0, wall, [1, 1]), polygon].map(|stroke| history.add_stroke(stroke).strokes[0].id);
        assert_eq!(history.undo_name(), Some("polygon wall"));
        let before = history.labels().clone();

        history.change_stroke_class(region, floor).unwrap();
        assert_eq!(history.undo_name(), Some("change polygon wall to floor"));
        let changed = &history.labels().strokes[&region];
        assert_eq!(
            (changed.class, &changed.lines),
            (floor, &before.strokes[&region].lines)
        );
        history.delete_stroke(click).unwrap();
        assert_eq!(history.undo_name(), Some("delete click wall"));
        assert_eq!(history.labels().strokes.len(), 1);
        history.change_stroke_class(region, VOID).unwrap();
        assert_eq!(history.undo_name(), Some("change polygon floor to void"));

        let edits = history.edits().1;
        assert!(history.delete_stroke(click).is_none());
        assert!(history.change_stroke_class(click, floor).is_none());
        assert!(history.change_stroke_class(region, VOID).is_none());
        assert!(history.change_stroke_class(region, 999).is_none());
        assert_eq!(history.edits().1, edits, "what changes nothing is no edit");
        for _ in 0..3 {
            history.undo().unwrap();
        }
        assert_eq!(history.labels(), &before);
    }
}
