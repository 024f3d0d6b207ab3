//! The labels with undo and redo over the edits that led to them.

mod classes;
mod imports;
mod objects;
mod strokes;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

pub use classes::AddedClasses;

use super::{CheckChange, Edit, ImportId, ImportedLabels, LabelSet};

/// The labels with the edits that led to them: what the window changes, and what a project keeps.
#[derive(Clone, Debug, Default)]
pub struct History {
    labels: LabelSet,
    edits: Vec<Edit>,
    /// Number of edits that are in force; those after it were undone.
    cursor: usize,
    last_stroke: u64,
    /// All label images that an edit brings or takes away, or that are in force.
    imports: BTreeMap<ImportId, Arc<ImportedLabels>>,
    /// Those in force.
    imported: Option<ImportId>,
    last_import: u64,
}

impl History {
    /// Starts from given labels, with nothing to undo.
    pub fn new(labels: LabelSet) -> Self {
        Self::restored(labels, Vec::new(), 0)
    }

    /// Goes on from saved labels, edits and number of edits in force.
    pub fn restored(labels: LabelSet, edits: Vec<Edit>, cursor: usize) -> Self {
        let in_edits = edits
            .iter()
            .flat_map(|edit| &edit.strokes)
            .map(|change| change.id.0);
        let in_labels = labels.strokes.keys().map(|id| id.0);
        let last_stroke = in_edits.chain(in_labels).max().unwrap_or(0);
        let cursor = cursor.min(edits.len());
        let first = ImportId(1);
        let imports: BTreeMap<_, _> = labels
            .imported
            .iter()
            .map(|images| (first, Arc::clone(images)))
            .collect();
        Self {
            imported: labels.imported.as_ref().map(|_| first),
            last_import: imports.len() as u64,
            imports,
            labels,
            edits,
            cursor,
            last_stroke,
        }
    }

    /// The labels as they are now.
    pub fn labels(&self) -> &LabelSet {
        &self.labels
    }

    /// All edits, and how many of them are in force.
    pub fn edits(&self) -> (&[Edit], usize) {
        (&self.edits, self.cursor)
    }

    /// Name of the edit that [`History::undo`] would take back.
    pub fn undo_name(&self) -> Option<&str> {
        let index = self.cursor.checked_sub(1)?;
        self.edits.get(index).map(|edit| edit.name.as_str())
    }

    /// Name of the edit that [`History::redo`] would do again.
    pub fn redo_name(&self) -> Option<&str> {
        self.edits.get(self.cursor).map(|edit| edit.name.as_str())
    }

    /// Takes the last edit back; returns the change that did so.
    pub fn undo(&mut self) -> Option<Edit> {
        let index = self.cursor.checked_sub(1)?;
        let change = self.edits.get(index)?.inverse();
        self.apply(&change);
        self.cursor = index;
        Some(change)
    }

    /// Does the last undone edit again; returns it.
    pub fn redo(&mut self) -> Option<Edit> {
        let edit = self.edits.get(self.cursor)?.clone();
        self.apply(&edit);
        self.cursor += 1;
        Some(edit)
    }

    /// Takes over an edit that was made elsewhere on the same labels, as if it had been made here.
    pub fn adopt(&mut self, edit: Edit) {
        let ids = edit.strokes.iter().map(|change| change.id.0);
        self.last_stroke = ids.fold(self.last_stroke, u64::max);
        self.commit(edit);
    }

    /// Marks a frame as checked by a person, or takes the mark away.
    pub fn toggle_checked(&mut self, frame: usize) -> Edit {
        let after = !self.labels.checked.contains(&frame);
        let name = if after {
            "mark as checked"
        } else {
            "mark as not checked"
        };
        self.commit(Edit {
            name: name.to_owned(),
            checked: Some(CheckChange { frame, after }),
            ..Edit::default()
        })
    }

    /// Number of the edits in force that changed the maps: a measure of whether they may have changed since.
    pub fn map_edits(&self) -> usize {
        let in_force = self.edits.iter().take(self.cursor);
        in_force.filter(|edit| edit.changes_maps()).count()
    }

    fn commit(&mut self, edit: Edit) -> Edit {
        self.apply(&edit);
        self.edits.truncate(self.cursor);
        self.edits.push(edit.clone());
        self.cursor += 1;
        // Images that only forgotten edits named are forgotten with them.
        let edits = self.edits.iter().filter_map(|edit| edit.imported);
        let named = edits.flat_map(|change| [change.before, change.after]);
        let named: BTreeSet<ImportId> = named.chain([self.imported]).flatten().collect();
        self.imports.retain(|id, _| named.contains(id));
        edit
    }

    fn apply(&mut self, edit: &Edit) {
        edit.apply(&mut self.labels, &self.imports);
        if let Some(change) = &edit.imported {
            self.imported = change.after;
        }
    }
}

/// The next id above all used ones, or the smallest unused one where the highest is in use; `None` where all are.
fn unused(used: &BTreeSet<u16>) -> Option<u16> {
    let next = used.last().map_or(Some(1), |highest| highest.checked_add(1));
    next.or_else(|| (1..=u16::MAX).find(|id| !used.contains(id)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::testing::clicked;
    use crate::labels::{ClassId, Stroke};

    /// A history with the classes wall and floor.
    pub(super) fn history() -> (History, ClassId, ClassId) {
        (clicked(&["wall", "floor"], &[]), 1, 2)
    }

    /// Every edit after the first of these states is undone and done again, and leads to them.
    pub(super) fn assert_walked(history: &mut History, states: &[LabelSet]) {
        for state in states.iter().rev().skip(1) {
            history.undo().unwrap();
            assert_eq!(history.labels(), state);
        }
        for state in states.iter().skip(1) {
            history.redo().unwrap();
            assert_eq!(history.labels(), state);
        }
    }

    #[test]
    fn undo_and_redo_walk_through_the_same_labels() {
        let (mut history, wall, floor) = history();
        let mut states = vec![history.labels().clone()];
        history.add_stroke(Stroke::click(0, wall, [1, 1]));
        states.push(history.labels().clone());
        history.add_stroke(Stroke::click(3, floor, [2, 2]));
        states.push(history.labels().clone());
        history.erase_where(0, &[[1, 1]], 1, |_| true).unwrap();
        states.push(history.labels().clone());
        history.merge_class(floor, wall).unwrap();
        states.push(history.labels().clone());
        history.toggle_checked(3);
        states.push(history.labels().clone());
        history.delete_class(wall).unwrap();
        assert!(history.labels().strokes.is_empty() && history.labels().class(wall).is_none());
        states.push(history.labels().clone());
        assert_walked(&mut history, &states);
        assert!(history.redo().is_none());
    }

    #[test]
    fn stroke_and_class_ids_are_never_used_twice() {
        let (mut history, wall, floor) = history();
        let first = history.add_stroke(Stroke::click(0, wall, [1, 1])).strokes[0].id;
        history.undo();
        let second = history.add_stroke(Stroke::click(0, wall, [2, 2])).strokes[0].id;
        assert!(second > first);
        history.delete_class(floor).unwrap();
        assert!(history.add_class("table").0 > floor);
    }
}
