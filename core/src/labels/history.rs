//! The labels with undo and redo over the edits that led to them.

mod classes;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

pub use classes::AddedClasses;

use super::{
    Class, ClassId, Edit, ImportChange, ImportId, ImportedLabels, LabelImages, LabelSet, Pixel, Stroke,
    StrokeChange, StrokeId, Trust, VOID, erase,
};

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

    /// The same history with the label images that its edits name; `imported` are those in force.
    #[must_use]
    pub fn with_imports(
        mut self,
        imports: BTreeMap<ImportId, Arc<ImportedLabels>>,
        imported: Option<ImportId>,
    ) -> Self {
        self.labels.imported = imported.and_then(|id| imports.get(&id)).cloned();
        self.imported = imported.filter(|id| imports.contains_key(id));
        let named = self.edits.iter().filter_map(|edit| edit.imported);
        let named = named.flat_map(|change| [change.before, change.after]).flatten();
        let ever = named.chain(imports.keys().copied()).map(|id| id.0);
        self.last_import = ever.max().unwrap_or(0);
        self.imports = imports;
        self
    }

    /// The label images that the edits name, and which of them are in force.
    pub fn imports(&self) -> (&BTreeMap<ImportId, Arc<ImportedLabels>>, Option<ImportId>) {
        (&self.imports, self.imported)
    }

    /// The label images that an edit brings.
    pub fn brought_by(&self, edit: &Edit) -> Option<(ImportId, &Arc<ImportedLabels>)> {
        let id = edit.imported?.after?;
        Some((id, self.imports.get(&id)?))
    }

    /// Takes label images over that an edit to [`History::adopt`] names.
    pub fn adopt_import(&mut self, id: ImportId, images: Arc<ImportedLabels>) {
        self.last_import = self.last_import.max(id.0);
        self.imports.insert(id, images);
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

    /// Adds a stroke; returns the edit.
    pub fn add_stroke(&mut self, stroke: Stroke) -> Edit {
        let name = self.name_of(&stroke);
        self.last_stroke += 1;
        self.commit(Edit {
            name,
            strokes: vec![StrokeChange {
                id: StrokeId(self.last_stroke),
                before: None,
                after: Some(stroke),
            }],
            ..Edit::default()
        })
    }

    /// Erases along a path on one frame; `None` when nothing was under the eraser.
    pub fn erase(&mut self, frame: usize, path: &[Pixel], radius: u32) -> Option<Edit> {
        self.erase_where(frame, path, radius, |_| true)
    }

    /// Erases along a path on one frame, but only strokes of classes that may be erased; `None` when none of them
    /// was under the eraser.
    pub fn erase_where(
        &mut self,
        frame: usize,
        path: &[Pixel],
        radius: u32,
        may_erase: impl Fn(ClassId) -> bool,
    ) -> Option<Edit> {
        let strokes: Vec<StrokeChange> = self
            .labels
            .strokes_of(frame)
            .filter(|(_, stroke)| may_erase(stroke.class))
            .filter_map(|(id, stroke)| {
                let rest = erase(stroke, path, radius)?;
                Some(StrokeChange {
                    id,
                    before: Some(stroke.clone()),
                    after: (!rest.lines.is_empty()).then_some(rest),
                })
            })
            .collect();
        (!strokes.is_empty()).then(|| {
            self.commit(Edit {
                name: "erase".to_owned(),
                strokes,
                ..Edit::default()
            })
        })
    }

    /// Deletes one stroke; `None` when there is no such stroke.
    pub fn delete_stroke(&mut self, id: StrokeId) -> Option<Edit> {
        let stroke = self.labels.strokes.get(&id)?;
        let name = format!("delete {}", self.name_of(stroke));
        Some(self.commit(Edit {
            name,
            strokes: vec![StrokeChange {
                id,
                before: Some(stroke.as_ref().clone()),
                after: None,
            }],
            ..Edit::default()
        }))
    }

    /// Makes one stroke say another class, which may be void; `None` when there is no such stroke or class, or
    /// nothing changes.
    pub fn change_stroke_class(&mut self, id: StrokeId, class: ClassId) -> Option<Edit> {
        let stroke = self.labels.strokes.get(&id)?;
        let known = class == VOID || self.labels.class(class).is_some();
        if !known || stroke.class == class {
            return None;
        }
        let name = format!("change {} to {}", self.name_of(stroke), self.class_name(class));
        let before = stroke.as_ref().clone();
        let after = Stroke {
            class,
            ..before.clone()
        };
        Some(self.commit(Edit {
            name,
            strokes: vec![StrokeChange {
                id,
                before: Some(before),
                after: Some(after),
            }],
            ..Edit::default()
        }))
    }

    /// Changes a class's name and colour; `None` when there is no such class or nothing changes.
    pub fn change_class(&mut self, class: Class) -> Option<Edit> {
        let before = self.labels.classes.clone();
        let mut after = before.clone();
        let place = after.iter_mut().find(|candidate| candidate.id == class.id)?;
        if *place == class {
            return None;
        }
        let name = format!("change class {}", class.name);
        *place = class;
        Some(self.commit(Edit {
            name,
            classes: Some((before, after)),
            ..Edit::default()
        }))
    }

    /// Deletes a class and its strokes; `None` when there is no such class.
    pub fn delete_class(&mut self, id: ClassId) -> Option<Edit> {
        let name = format!("delete class {}", self.labels.class(id)?.name);
        let before = self.labels.classes.clone();
        let after = before.iter().filter(|class| class.id != id).cloned().collect();
        let strokes = self.changes_of_class(id, |_| None);
        Some(self.commit(Edit {
            name,
            strokes,
            classes: Some((before, after)),
            ..Edit::default()
        }))
    }

    /// Gives all strokes and imported pixels of one class to another and deletes the first; `None` unless both
    /// exist.
    pub fn merge_class(&mut self, from: ClassId, into: ClassId) -> Option<Edit> {
        let (source, target) = (self.labels.class(from)?, self.labels.class(into)?);
        if from == into {
            return None;
        }
        let name = format!("merge class {} into {}", source.name, target.name);
        let before = self.labels.classes.clone();
        let after = before.iter().filter(|class| class.id != from).cloned().collect();
        let strokes = self.changes_of_class(from, |stroke| {
            Some(Stroke {
                class: into,
                ..stroke.clone()
            })
        });
        let says = |images: &&Arc<ImportedLabels>| {
            let mut classes = images.maps.iter().flat_map(|map| map.runs());
            classes.any(|(class, _)| class == from)
        };
        let images = self.labels.imported.as_ref().filter(says);
        let images = images.map(|images| images.relabelled(|class| if class == from { into } else { class }));
        let imported = images.map(|images| self.change_import(Some(images)));
        Some(self.commit(Edit {
            name,
            strokes,
            classes: Some((before, after)),
            imported,
        }))
    }

    /// Takes label images from elsewhere over, in place of earlier ones.
    ///
    /// An id that comes with a name is the class of that name (capitals aside), and otherwise a new class, with
    /// another id if its own is taken. An id without a name is the class with that id, or a new one.
    pub fn import(&mut self, images: LabelImages) -> Edit {
        let what = match images.labels.trust {
            Trust::Trusted => "labels",
            Trust::Votes => "predictions",
        };
        let before = self.labels.classes.clone();
        let mut classes = before.clone();
        let mut becomes = BTreeMap::new();
        let mut displaced = Vec::new();
        for id in images.labels.classes() {
            let has = |class: &Class| class.id == id;
            match images.classes.iter().find(|class| class.id == id) {
                Some(named) => match classes.iter().find(|known| known.is_named(&named.name)) {
                    Some(known) => {
                        becomes.insert(id, known.id);
                    }
                    None if classes.iter().any(has) => displaced.push(named),
                    None => classes.push(named.clone()),
                },
                None if classes.iter().any(has) => {}
                None => classes.push(Class::new(id, format!("class {id}"))),
            }
        }
        // Only now, so that no id is given that an image uses.
        for named in displaced {
            let id = self.unused_class_id(&classes);
            becomes.insert(named.id, id);
            classes.push(Class { id, ..named.clone() });
        }
        let images = images
            .labels
            .relabelled(|class| becomes.get(&class).copied().unwrap_or(class));
        let imported = self.change_import(Some(images));
        self.commit(Edit {
            name: format!("import {what}"),
            strokes: Vec::new(),
            classes: (before != classes).then_some((before, classes)),
            imported: Some(imported),
        })
    }

    /// Removes the label images from elsewhere; `None` when there are none.
    pub fn remove_imported(&mut self) -> Option<Edit> {
        self.imported?;
        let imported = self.change_import(None);
        Some(self.commit(Edit {
            name: "remove imported labels".to_owned(),
            imported: Some(imported),
            ..Edit::default()
        }))
    }

    /// A change to these images, which get an id.
    fn change_import(&mut self, images: Option<ImportedLabels>) -> ImportChange {
        let after = images.map(|images| {
            self.last_import += 1;
            let id = ImportId(self.last_import);
            self.imports.insert(id, Arc::new(images));
            id
        });
        ImportChange {
            before: self.imported,
            after,
        }
    }

    fn changes_of_class(&self, id: ClassId, after: impl Fn(&Stroke) -> Option<Stroke>) -> Vec<StrokeChange> {
        self.labels
            .strokes
            .iter()
            .filter(|(_, stroke)| stroke.class == id)
            .map(|(&id, stroke)| StrokeChange {
                id,
                before: Some(stroke.as_ref().clone()),
                after: after(stroke),
            })
            .collect()
    }

    /// What a stroke is and says: "scribble wall".
    fn name_of(&self, stroke: &Stroke) -> String {
        format!("{} {}", stroke.kind().name(), self.class_name(stroke.class))
    }

    fn class_name(&self, id: ClassId) -> String {
        self.labels
            .class(id)
            .map_or_else(|| "void".to_owned(), |class| class.name.clone())
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::ImportedMap;

    fn history() -> (History, ClassId, ClassId) {
        let mut history = History::default();
        let (wall, _) = history.add_class("wall");
        let (floor, _) = history.add_class("floor");
        (history, wall, floor)
    }

    #[test]
    fn undo_and_redo_walk_through_the_same_labels() {
        let (mut history, wall, floor) = history();
        let mut states = vec![history.labels().clone()];
        history.add_stroke(Stroke::click(0, wall, [1, 1]));
        states.push(history.labels().clone());
        history.add_stroke(Stroke::click(3, floor, [2, 2]));
        states.push(history.labels().clone());
        history.erase(0, &[[1, 1]], 1).unwrap();
        states.push(history.labels().clone());
        history.merge_class(floor, wall).unwrap();
        states.push(history.labels().clone());
        for state in states.iter().rev().skip(1) {
            history.undo().unwrap();
            assert_eq!(history.labels(), state);
        }
        for state in states.iter().skip(1) {
            history.redo().unwrap();
            assert_eq!(history.labels(), state);
        }
        assert!(history.redo().is_none());
    }

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
        assert_eq!(history.labels().strokes[&region].class, floor);
        assert_eq!(
            history.labels().strokes[&region].lines,
            before.strokes[&region].lines
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

    #[test]
    fn a_new_edit_drops_what_was_undone() {
        let (mut history, wall, _) = history();
        history.add_stroke(Stroke::click(0, wall, [1, 1]));
        history.undo();
        history.add_stroke(Stroke::click(0, wall, [5, 5]));
        assert!(history.redo_name().is_none());
        assert_eq!(history.labels().strokes.len(), 1);
    }

    #[test]
    fn an_adopted_edit_is_like_one_made_here() {
        let (mut history, wall, _) = history();
        let mut mirror = history.clone();
        let edit = history.add_stroke(Stroke::click(0, wall, [1, 1]));
        mirror.adopt(edit);
        assert_eq!(mirror.labels(), history.labels());
        let next = |history: &mut History| history.add_stroke(Stroke::click(0, wall, [2, 2]));
        assert_eq!(next(&mut mirror), next(&mut history));
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

    #[test]
    fn an_import_is_undone_redone_merged_and_removed_like_any_edit() {
        let (mut history, wall, floor) = history();
        let images = ImportedLabels {
            maps: vec![ImportedMap::new(1, &[wall, floor, 9])],
            trust: Trust::Votes,
        };
        let mut classes = history.labels().classes.clone();
        classes.push(Class::new(9, "lamp"));
        let mut mirror = history.clone();
        let edit = history.import(LabelImages {
            labels: images.clone(),
            classes: vec![Class::new(9, "lamp")],
            unmatched: 0,
        });
        let (id, brought) = history.brought_by(&edit).unwrap();
        mirror.adopt_import(id, Arc::clone(brought));
        mirror.adopt(edit);
        assert_eq!(mirror.labels(), history.labels());
        let imported = history.labels().clone();
        assert_eq!(
            (imported.imported.as_deref(), &imported.classes),
            (Some(&images), &classes)
        );
        history.undo().unwrap();
        assert_eq!(history.labels().classes.len(), 2);
        assert!(!history.labels().says_anything());
        history.redo().unwrap();
        assert_eq!(history.labels(), &imported);

        history.merge_class(floor, wall).unwrap();
        let merged = history.labels().imported.clone().unwrap();
        assert_eq!(merged.maps[0].labels(), [wall, wall, 9]);
        history.remove_imported().unwrap();
        assert!(history.labels().imported.is_none() && history.remove_imported().is_none());
        assert_eq!(history.imports().0.len(), 2);
        for _ in 0..3 {
            history.undo().unwrap();
        }
        assert!(history.labels().imported.is_none());
        history.add_class("door");
        assert!(history.imports().0.is_empty(), "images of forgotten edits stay");
    }

    #[test]
    fn deleting_a_class_takes_its_strokes_and_undo_brings_both_back() {
        let (mut history, wall, floor) = history();
        history.add_stroke(Stroke::click(0, wall, [1, 1]));
        history.add_stroke(Stroke::click(0, floor, [2, 2]));
        let before = history.labels().clone();
        history.delete_class(wall).unwrap();
        assert_eq!(history.labels().strokes.len(), 1);
        assert!(history.labels().class(wall).is_none());
        history.undo();
        assert_eq!(history.labels(), &before);
    }
}
