//! Edits of the label images from elsewhere, and those images themselves.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::{History, unused};
use crate::labels::{
    Class, ClassId, Edit, ImportChange, ImportId, ImportedLabels, Label, LabelImages, Object, ObjectId,
};

impl History {
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

    /// Takes label images from elsewhere over, in place of earlier ones.
    ///
    /// An id that comes with a name is the class of that name (capitals aside), and otherwise a new class, with
    /// another id if its own is taken or was that of another class. An id without a name is the class with that id, or a
    /// new one. In the same way an object is that of its name and class, or a new one.
    pub fn import(&mut self, images: LabelImages) -> Edit {
        let what = if images.labels.trust.is_right() {
            "labels"
        } else {
            "predictions"
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
                    None if self.is_taken(&classes, named) => displaced.push(named),
                    None => classes.push(named.clone()),
                },
                None if classes.iter().any(has) => {}
                None => classes.push(Class::unnamed(id)),
            }
        }
        // Only now, so that no id is given that an image uses.
        for named in displaced {
            let id = self.unused_class_id(&classes);
            becomes.insert(named.id, id);
            classes.push(Class { id, ..named.clone() });
        }
        let class = |id: ClassId| becomes.get(&id).copied().unwrap_or(id);
        let mut objects = self.labels.objects.clone();
        let same = self.imported_objects(&images.objects, &mut objects, class);
        let keep_classes = becomes.iter().all(|(own, new)| own == new);
        let keep_objects = || images.labels.objects().iter().all(|id| same.get(id) == Some(id));
        // The window waits while millions of probabilities are copied.
        let labels = if keep_classes && keep_objects() {
            images.labels
        } else {
            images.labels.relabelled(|label| Label {
                class: class(label.class),
                object: label.object.and_then(|id| same.get(&id).copied()),
            })
        };
        let objects = self.objects_after(Some(&labels), objects);
        let imported = self.change_import(Some(labels));
        self.commit(Edit {
            name: format!("import {what}"),
            classes: (before != classes).then_some((before, classes)),
            objects,
            imported: Some(imported),
            ..Edit::default()
        })
    }

    /// The ids that the objects of images get, which are added to the list where it lacks them. Their classes become those
    /// by `class`. One for which there is no number left is missing.
    fn imported_objects(
        &self,
        imported: &[Object],
        listed: &mut Vec<Object>,
        class: impl Fn(ClassId) -> ClassId,
    ) -> BTreeMap<ObjectId, ObjectId> {
        let ids = listed
            .iter()
            .map(|object| ((object.class, object.name.clone()), object.id));
        let mut known: BTreeMap<(ClassId, String), ObjectId> = ids.collect();
        let mut used: BTreeSet<u16> = listed.iter().map(|object| object.id.number()).collect();
        let mut ever: BTreeMap<ObjectId, BTreeSet<(ClassId, &str)>> = BTreeMap::new();
        for object in self.objects_ever() {
            let names = ever.entry(object.id).or_default();
            names.insert((object.class, &object.name));
        }
        let mut same = BTreeMap::new();
        let mut displaced = Vec::new();
        for object in imported {
            let own = Object {
                class: class(object.class),
                ..object.clone()
            };
            let is_another = |name: &(ClassId, &str)| *name != (own.class, own.name.as_str());
            let had = ever.get(&own.id);
            if let Some(id) = known.remove(&(own.class, own.name.clone())) {
                same.insert(own.id, id);
            } else if used.contains(&own.id.number()) || had.is_some_and(|names| names.iter().any(is_another))
            {
                displaced.push(own);
            } else {
                used.insert(own.id.number());
                same.insert(own.id, own.id);
                listed.push(own);
            }
        }
        // Only now, so that no number is given that an image brings.
        used.extend(ever.into_keys().map(ObjectId::number));
        for own in displaced {
            if let Some(id) = unused(&used).and_then(ObjectId::new) {
                used.insert(id.number());
                same.insert(own.id, id);
                listed.push(Object { id, ..own });
            }
        }
        same
    }

    /// The list of objects before and after these images are the ones in force, `listed` without those that only the images
    /// of before said; `None` where nothing changes.
    fn objects_after(
        &self,
        images: Option<&ImportedLabels>,
        mut listed: Vec<Object>,
    ) -> Option<(Vec<Object>, Vec<Object>)> {
        let before = self.labels.imported.as_ref();
        let mut gone = before.map_or_else(BTreeSet::new, |images| images.objects());
        gone.retain(|id| {
            let mut strokes = self.labels.strokes.values();
            !strokes.any(|stroke| stroke.object == Some(*id))
        });
        if let Some(images) = images {
            let said = images.objects();
            gone.retain(|id| !said.contains(id));
        }
        listed.retain(|object| !gone.contains(&object.id));
        (listed != self.labels.objects).then(|| (self.labels.objects.clone(), listed))
    }

    /// Removes the label images from elsewhere; `None` when there are none.
    pub fn remove_imported(&mut self) -> Option<Edit> {
        self.imported?;
        let objects = self.objects_after(None, self.labels.objects.clone());
        let imported = self.change_import(None);
        Some(self.commit(Edit {
            name: "remove imported labels".to_owned(),
            objects,
            imported: Some(imported),
            ..Edit::default()
        }))
    }

    /// A change to these images, which get an id.
    pub(super) fn change_import(&mut self, images: Option<ImportedLabels>) -> ImportChange {
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::history::tests::history;
    use crate::labels::testing::{clicked, label_images, named, object};
    use crate::labels::{FoundObject, ImportedMap, Stroke, Trust};

    #[test]
    fn an_import_is_undone_redone_merged_and_removed_like_any_edit() {
        let (mut history, wall, floor) = history();
        let images = LabelImages {
            classes: vec![Class::new(9, "lamp")],
            ..label_images(vec![ImportedMap::new(1, &[wall, floor, 9])], Trust::VOTES)
        };
        let mut classes = history.labels().classes.clone();
        classes.push(Class::new(9, "lamp"));
        let mut mirror = history.clone();
        let edit = history.import(images.clone());
        let (id, brought) = history.brought_by(&edit).unwrap();
        mirror.adopt_import(id, Arc::clone(brought));
        mirror.adopt(edit);
        assert_eq!(mirror.labels(), history.labels());
        let imported = history.labels().clone();
        assert_eq!(imported.imported.as_deref(), Some(&images.labels));
        assert_eq!(imported.classes, classes);
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

    /// Images with a chair and a stool, by these numbers.
    fn seats([chair, stool]: [u16; 2]) -> LabelImages {
        let objects = vec![object(chair, 5, "chair 1"), object(stool, 5, "stool")];
        let label = |number| Label::new(5, ObjectId::new(number));
        let map = ImportedMap::with_objects(0, &[label(0), label(chair), label(stool)]);
        LabelImages {
            classes: vec![Class::new(5, "chair")],
            objects,
            ..label_images(vec![map], Trust::VOTES)
        }
    }

    /// The listed objects, and the numbers that the images in force say.
    fn known(history: &History) -> (Vec<(u16, &str)>, Vec<u16>) {
        let labels = history.labels();
        let said = labels.imported.iter().flat_map(|images| images.objects());
        (named(&labels.objects), said.map(ObjectId::number).collect())
    }

    #[test]
    fn an_imported_class_does_not_get_the_number_of_a_deleted_one() {
        let mut history = clicked(&["wall", "floor", "door", "sky", "lamp"], &[]);
        history.delete_class(5).unwrap();
        history.import(seats([1, 2]));
        let chair = history.labels().classes.last().unwrap().clone();
        assert_eq!((chair.id, chair.name.as_str()), (6, "chair"));
        let imported = history.labels().imported.clone().unwrap();
        assert_eq!(imported.classes(), [6].into());
    }

    #[test]
    fn imported_objects_are_those_of_their_names_and_keep_their_numbers_where_these_are_free() {
        let mut history = History::default();
        history.add_class("chair");
        let click = Stroke::click(0, 1, [1, 1]);
        let (first, _) = history.add_object(click.clone(), &[]).unwrap();
        history.import(seats([7, 9]));
        assert_eq!(known(&history), (vec![(1, "chair 1"), (9, "stool")], vec![1, 9]));
        assert!(
            history.labels().objects.iter().all(|object| object.class == 1),
            "chair is 1 here"
        );
        // Another import of the same: nothing is new. Of other numbers: the names tell.
        history.import(seats([1, 9]));
        history.import(seats([9, 1]));
        assert_eq!(known(&history), (vec![(1, "chair 1"), (9, "stool")], vec![1, 9]));
        // What no stroke says goes with the images, and comes back with its number.
        history.remove_imported().unwrap();
        assert_eq!(known(&history), (vec![(1, "chair 1")], vec![]));
        history.import(seats([7, 9]));
        assert_eq!(known(&history).0, [(1, "chair 1"), (9, "stool")]);
        history
            .rename_object(&history.labels().object(first).unwrap().clone().into(), "bench")
            .unwrap();
        history.remove_imported().unwrap();
        history.import(seats([1, 9]));
        assert_eq!(
            known(&history),
            (vec![(1, "bench"), (9, "stool"), (10, "chair 1")], vec![9, 10])
        );
    }

    #[test]
    fn imported_objects_are_renamed_merged_and_deleted_without_a_click() {
        let mut history = History::default();
        history.import(seats([1, 2]));
        let imported = history.labels().clone();
        let found = |history: &History, number| -> FoundObject {
            let object = history.labels().object(ObjectId::new(number).unwrap()).unwrap();
            FoundObject {
                click: Some(Stroke::click(0, 5, [0, 0])),
                ..object.clone().into()
            }
        };
        let (chair, stool) = (found(&history, 1), found(&history, 2));
        history.rename_object(&stool, "bench").unwrap();
        assert_eq!(known(&history), (vec![(1, "chair 1"), (2, "bench")], vec![1, 2]));
        history.merge_object(&stool, &chair).unwrap();
        assert_eq!(known(&history), (vec![(1, "chair 1")], vec![1]));
        history.delete_object(chair.object.id).unwrap();
        assert_eq!(known(&history), (vec![], vec![]));
        let images = history.labels().imported.clone().unwrap();
        assert_eq!(images.maps[0].labels(), [5; 3]);
        assert!(history.labels().strokes.is_empty());
        (0..3).for_each(|_| drop(history.undo().unwrap()));
        assert_eq!(history.labels(), &imported);
    }
}
