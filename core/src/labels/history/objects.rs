//! Edits of objects: telling one from the others of its class, naming, merging and deleting them.

use std::collections::BTreeSet;

use super::{History, unused};
use crate::labels::{
    ClassId, Edit, FoundObject, ImportedLabels, Label, Object, ObjectId, Stroke, StrokeChange, StrokeId,
    unused_name,
};

impl History {
    /// The object of a class that would be added now: its number is none that an object ever had, and neither that nor
    /// its name is that of one of the `others`, such as the parts that maps show. `None` where the class is unknown or
    /// stuff, or there are no more numbers.
    pub fn next_object(&self, class: ClassId, others: &[Object]) -> Option<Object> {
        let class = self.labels.class(class).filter(|class| class.thing)?;
        let all = self.objects_ever().chain(others);
        let used = all.map(|object| object.id.number()).collect();
        let names = self.labels.objects.iter().chain(others);
        Some(Object {
            id: ObjectId::new(unused(&used)?)?,
            class: class.id,
            name: unused_name(&class.name, names.map(|object| object.name.as_str())),
        })
    }

    /// Adds [the next object](Self::next_object) with its first stroke, whose class is the object's: "chair 3".
    pub fn add_object(&mut self, stroke: Stroke, others: &[Object]) -> Option<(ObjectId, Edit)> {
        let object = self.next_object(stroke.class, others)?;
        let edit = self.label_object(&object.clone().into(), stroke)?;
        Some((object.id, edit))
    }

    /// Adds a stroke that says an object, which is listed from then on. `None` where its class is unknown or stuff.
    pub fn label_object(&mut self, found: &FoundObject, stroke: Stroke) -> Option<Edit> {
        let listed = self.labels.object(found.object.id).is_some();
        let name = match listed {
            true => self.name_of(&stroke),
            false => format!("add {}", found.object.name),
        };
        self.tell_object(name, found.object.clone(), &[found], Some(stroke))
    }

    /// Renames an object, which is listed from then on; `None` where it has the name, or nothing would say it.
    pub fn rename_object(&mut self, found: &FoundObject, name: &str) -> Option<Edit> {
        if found.object.name == name {
            return None;
        }
        let done = format!("rename {} to {name}", found.object.name);
        let object = Object {
            name: name.to_owned(),
            ..found.object.clone()
        };
        self.tell_object(done, object, &[found], None)
    }

    /// Makes what says one object say another, with its class, and lists only that; `None` where they are the same, or
    /// nothing would say it.
    pub fn merge_object(&mut self, from: &FoundObject, into: &FoundObject) -> Option<Edit> {
        if from.object.id == into.object.id {
            return None;
        }
        let name = format!("merge {} into {}", from.object.name, into.object.name);
        self.tell_object(name, into.object.clone(), &[from, into], None)
    }

    /// Lists an object as it is given here, as what strokes say: those that say one of `found` or lie on it, a click on
    /// each of these that has neither, and `stroke`. Imported images that say one of `found` say it, too, and need no
    /// click. The others of `found` are listed no more. `None` where the class is unknown or stuff, or nothing would say
    /// the object.
    fn tell_object(
        &mut self,
        name: String,
        object: Object,
        found: &[&FoundObject],
        stroke: Option<Stroke>,
    ) -> Option<Edit> {
        self.labels.class(object.class).filter(|class| class.thing)?;
        let mut listed = self.labels.objects.clone();
        let is_gone = |id: ObjectId| id != object.id && found.iter().any(|other| other.object.id == id);
        listed.retain(|other| !is_gone(other.id));
        match listed.iter_mut().find(|own| own.id == object.id) {
            Some(own) => own.clone_from(&object),
            None => listed.push(object.clone()),
        }
        let telling = |stroke: &Stroke| Stroke {
            class: object.class,
            object: Some(object.id),
            ..stroke.clone()
        };
        let images = self.labels.imported.clone();
        let imported = images
            .as_ref()
            .map_or_else(BTreeSet::new, |images| images.objects());
        let mut changes = Vec::new();
        let mut clicks = Vec::new();
        for found in found {
            let lies_on = |id: &StrokeId, stroke: &Stroke| {
                stroke.object.is_none() && stroke.class == found.object.class && found.strokes.contains(id)
            };
            let says = |stroke: &Stroke| stroke.object == Some(found.object.id);
            let strokes = self.labels.strokes.iter();
            let mut own = strokes
                .filter(|(id, own)| says(own) || lies_on(id, own))
                .peekable();
            if own.peek().is_none() && !imported.contains(&found.object.id) {
                clicks.extend(&found.click);
            }
            let told = own.map(|(&id, own)| StrokeChange::of(id, own, Some(telling(own))));
            changes.extend(told);
        }
        for stroke in clicks.into_iter().chain(&stroke) {
            self.last_stroke += 1;
            changes.push(StrokeChange {
                id: StrokeId(self.last_stroke),
                before: None,
                after: Some(telling(stroke)),
            });
        }
        if changes.is_empty() && self.labels.object(object.id).is_none() {
            return None;
        }
        changes.retain(|change| change.before != change.after);
        let becomes = |label: Label| match label.object {
            Some(id) if is_gone(id) => Label::new(object.class, Some(object.id)),
            _ => label,
        };
        let is_said = imported.iter().any(|&id| is_gone(id));
        let images = images.filter(|_| is_said);
        let images = images.map(|images| images.relabelled(becomes));
        Some(self.commit_objects(name, listed, changes, images))
    }

    /// Deletes an object: what says it says only its class from then on. `None` when there is no such object.
    pub fn delete_object(&mut self, id: ObjectId) -> Option<Edit> {
        let name = format!("delete {}", self.labels.object(id)?.name);
        let mut listed = self.labels.objects.clone();
        listed.retain(|object| object.id != id);
        let strokes = self.labels.strokes.iter();
        let own = strokes.filter(|(_, stroke)| stroke.object == Some(id));
        let changes = own.map(|(&id, stroke)| {
            let after = Stroke {
                object: None,
                ..stroke.as_ref().clone()
            };
            StrokeChange::of(id, stroke, Some(after))
        });
        let changes = changes.collect();
        let images = self.labels.imported.as_ref();
        let images = images.filter(|images| images.objects().contains(&id));
        let images = images.map(|images| {
            images.relabelled(|label| Label {
                object: label.object.filter(|own| *own != id),
                ..label
            })
        });
        Some(self.commit_objects(name, listed, changes, images))
    }

    /// Commits an edit that leaves these objects and changes these strokes, and brings these images where there are any.
    fn commit_objects(
        &mut self,
        name: String,
        after: Vec<Object>,
        strokes: Vec<StrokeChange>,
        images: Option<ImportedLabels>,
    ) -> Edit {
        let before = self.labels.objects.clone();
        let imported = images.map(|images| self.change_import(Some(images)));
        self.commit(Edit {
            name,
            strokes,
            objects: (before != after).then_some((before, after)),
            imported,
            ..Edit::default()
        })
    }

    /// The objects that are there, and those that ever were, as they were: those deleted or undone could come back.
    pub(super) fn objects_ever(&self) -> impl Iterator<Item = &Object> {
        let ever = self.edits.iter().filter_map(|edit| edit.objects.as_ref());
        let ever = ever.flat_map(|(before, after)| before.iter().chain(after));
        ever.chain(&self.labels.objects)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::history::tests::assert_walked;
    use crate::labels::testing::{clicked, object};
    use crate::labels::{History, Pixel};

    /// Two chairs with a click each, and a table's click.
    fn two_chairs() -> (History, [ObjectId; 2]) {
        let mut history = clicked(&["chair", "table"], &[(0, 2, [1, 1])]);
        let chairs = [[2, 2], [3, 3]].map(|pixel| {
            let added = history.add_object(Stroke::click(0, 1, pixel), &[]);
            added.unwrap().0
        });
        (history, chairs)
    }

    /// An object as the list has it.
    fn listed(history: &History, id: ObjectId) -> FoundObject {
        history.labels().object(id).unwrap().clone().into()
    }

    fn said(history: &History) -> Vec<(u16, Option<u16>)> {
        let strokes = history.labels().strokes.values();
        strokes
            .map(|stroke| (stroke.class, stroke.object.map(ObjectId::number)))
            .collect()
    }

    #[test]
    fn objects_are_added_renamed_merged_and_deleted_in_one_step_each() {
        let (mut history, [first, second]) = two_chairs();
        assert_eq!(history.undo_name(), Some("add chair 2"));
        assert_eq!(said(&history), [(2, None), (1, Some(1)), (1, Some(2))]);
        let mut states = vec![history.labels().clone()];
        let shown = [object(39, 2, "table 1")];
        let table = history.add_object(Stroke::click(1, 2, [9, 9]), &shown).unwrap().0;
        assert_eq!(table.number(), 40);
        states.push(history.labels().clone());
        let (chair, other) = (listed(&history, second), listed(&history, table));
        history.rename_object(&chair, "armchair").unwrap();
        states.push(history.labels().clone());
        history.merge_object(&listed(&history, second), &other).unwrap();
        assert_eq!(history.undo_name(), Some("merge armchair into table 2"));
        assert_eq!(
            said(&history),
            [(2, None), (1, Some(1)), (2, Some(40)), (2, Some(40))]
        );
        states.push(history.labels().clone());
        history.delete_object(first).unwrap();
        assert_eq!(
            said(&history),
            [(2, None), (1, None), (2, Some(40)), (2, Some(40))],
            "what it was is still a chair"
        );
        states.push(history.labels().clone());
        assert_walked(&mut history, &states);
        assert!(history.merge_object(&other, &other).is_none() && history.delete_object(first).is_none());
        assert!(history.rename_object(&other, "table 2").is_none());
    }

    #[test]
    fn a_part_that_no_stroke_names_is_named_by_the_strokes_on_it_or_else_by_a_click() {
        let (mut history, [first, _]) = two_chairs();
        let plain = history.add_stroke(Stroke::click(1, 1, [4, 4])).strokes[0].id;
        let before = history.labels().clone();
        let part = |number, strokes: &[StrokeId], click: Option<Pixel>| FoundObject {
            strokes: strokes.to_vec(),
            click: click.map(|pixel| Stroke::click(5, 1, pixel)),
            ..object(number, 1, &format!("chair {number}")).into()
        };
        let (drawn_on, bare) = (part(3, &[plain], Some([7, 7])), part(4, &[], Some([8, 8])));
        history.rename_object(&drawn_on, "stool").unwrap();
        assert_eq!(said(&history)[3], (1, Some(3)));
        assert_eq!(said(&history).len(), 4, "a stroke says it already");
        history.undo().unwrap();
        // Two such parts become one; then one of them becomes of a listed object.
        history.merge_object(&bare, &drawn_on).unwrap();
        assert_eq!(said(&history)[3..], [(1, Some(3)), (1, Some(3))]);
        let (_, click) = history.labels().strokes.last_key_value().unwrap();
        assert_eq!((click.frame, click.first_point()), (5, Some([8, 8])));
        history.undo().unwrap();
        assert_eq!(history.labels(), &before);
        history.merge_object(&bare, &listed(&history, first)).unwrap();
        assert_eq!(said(&history)[4], (1, Some(1)));
        assert_eq!(history.labels().objects, before.objects);
        // One that is said from now on takes the strokes along that lie on it.
        history
            .label_object(&drawn_on, Stroke::click(2, 1, [1, 2]))
            .unwrap();
        assert_eq!(history.undo_name(), Some("add chair 3"));
        assert_eq!(
            (said(&history)[3], said(&history)[5]),
            ((1, Some(3)), (1, Some(3)))
        );
        let unseen = part(9, &[], None);
        assert!(
            history.rename_object(&unseen, "x").is_none() && history.merge_object(&unseen, &bare).is_some()
        );
    }

    #[test]
    fn numbers_are_never_used_twice_and_stuff_has_no_objects() {
        let (mut history, [_, second]) = two_chairs();
        history.delete_object(second).unwrap();
        let (third, _) = history.add_object(Stroke::click(0, 1, [5, 5]), &[]).unwrap();
        assert_eq!(
            (third.number(), history.labels().objects[1].name.as_str()),
            (3, "chair 2")
        );
        history.add_class("floor");
        assert!(history.add_object(Stroke::click(0, 3, [5, 5]), &[]).is_none());
        assert!(history.add_object(Stroke::click(0, 9, [5, 5]), &[]).is_none());
    }

    #[test]
    fn objects_go_with_their_class() {
        let (mut history, [first, second]) = two_chairs();
        let stroke = *history.labels().strokes.keys().nth(1).unwrap();
        history.change_stroke_class(stroke, 2).unwrap();
        assert_eq!(said(&history), [(2, None), (2, None), (1, Some(2))]);
        history.merge_class(1, 2).unwrap();
        let classes: Vec<_> = history
            .labels()
            .objects
            .iter()
            .map(|object| object.class)
            .collect();
        assert_eq!(classes, [2, 2]);
        assert_eq!(said(&history)[2], (2, Some(2)));
        history.delete_class(2).unwrap();
        assert!(history.labels().objects.is_empty());
        history.undo().unwrap();
        assert!(
            [first, second]
                .iter()
                .all(|&id| history.labels().object(id).is_some())
        );
    }
}
