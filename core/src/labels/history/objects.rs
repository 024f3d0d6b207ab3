//! Edits of objects: telling one from the others of its class, naming, merging and deleting them.

use std::collections::BTreeSet;

use super::History;
use crate::labels::{ClassId, Edit, Object, ObjectId, Stroke, StrokeChange, StrokeId, unused_name};

impl History {
    /// The object of a class that would be added now: its number is none that an object ever had, and neither that nor
    /// its name is that of one of the `others`, such as the parts that maps show. `None` where the class is unknown or
    /// stuff, or there are no more numbers.
    pub fn next_object(&self, class: ClassId, others: &[Object]) -> Option<Object> {
        let class = self.labels.class(class).filter(|class| class.thing)?;
        let mut used = self.object_ids_ever();
        used.extend(others.iter().map(|object| object.id));
        let names = self.labels.objects.iter().chain(others);
        Some(Object {
            id: unused(&used)?,
            class: class.id,
            name: unused_name(&class.name, names.map(|object| object.name.as_str())),
        })
    }

    /// Adds [the next object](Self::next_object) with its first stroke, whose class is the object's: "chair 3".
    pub fn add_object(&mut self, stroke: Stroke, others: &[Object]) -> Option<(ObjectId, Edit)> {
        let object = self.next_object(stroke.class, others)?;
        let id = object.id;
        self.last_stroke += 1;
        let change = StrokeChange {
            id: StrokeId(self.last_stroke),
            before: None,
            after: Some(Stroke {
                object: Some(id),
                ..stroke
            }),
        };
        let name = format!("add {}", object.name);
        let mut after = self.labels.objects.clone();
        after.push(object);
        Some((id, self.commit_objects(name, after, vec![change])))
    }

    /// Renames an object; `None` when there is no such object or nothing changes.
    pub fn rename_object(&mut self, id: ObjectId, name: &str) -> Option<Edit> {
        let mut after = self.labels.objects.clone();
        let object = after.iter_mut().find(|object| object.id == id)?;
        if object.name == name {
            return None;
        }
        let done = format!("rename {} to {name}", object.name);
        name.clone_into(&mut object.name);
        Some(self.commit_objects(done, after, Vec::new()))
    }

    /// Gives all strokes of one object to another, with its class, and deletes the first; `None` unless both exist.
    pub fn merge_object(&mut self, from: ObjectId, into: ObjectId) -> Option<Edit> {
        let (source, target) = (self.labels.object(from)?, self.labels.object(into)?);
        if from == into {
            return None;
        }
        let (name, class) = (
            format!("merge {} into {}", source.name, target.name),
            target.class,
        );
        let becomes = |stroke: Stroke| Stroke {
            class,
            object: Some(into),
            ..stroke
        };
        Some(self.remove_object(from, name, Some(&becomes)))
    }

    /// Deletes an object and its strokes; `None` when there is no such object.
    pub fn delete_object(&mut self, id: ObjectId) -> Option<Edit> {
        let name = format!("delete {}", self.labels.object(id)?.name);
        Some(self.remove_object(id, name, None))
    }

    /// Makes one stroke say an object, and its class; `None` when there is no such stroke or object, or nothing changes.
    pub fn change_stroke_object(&mut self, id: StrokeId, object: ObjectId) -> Option<Edit> {
        let stroke = self.labels.strokes.get(&id)?;
        let object = self.labels.object(object)?;
        if stroke.object == Some(object.id) {
            return None;
        }
        let name = format!("change {} to {}", self.name_of(stroke), object.name);
        let before = stroke.as_ref().clone();
        let after = Stroke {
            class: object.class,
            object: Some(object.id),
            ..before.clone()
        };
        Some(self.commit_stroke(name, id, Some(before), Some(after)))
    }

    /// Commits an edit that takes an object away, and its strokes unless they become something else.
    fn remove_object(
        &mut self,
        id: ObjectId,
        name: String,
        becomes: Option<&dyn Fn(Stroke) -> Stroke>,
    ) -> Edit {
        let objects = self.labels.objects.iter();
        let after = objects.filter(|object| object.id != id).cloned().collect();
        let strokes = self.labels.strokes.iter();
        let of_object = strokes.filter(|(_, stroke)| stroke.object == Some(id));
        let changes = of_object.map(|(&id, stroke)| StrokeChange {
            id,
            before: Some(stroke.as_ref().clone()),
            after: becomes.map(|becomes| becomes(stroke.as_ref().clone())),
        });
        let changes = changes.collect();
        self.commit_objects(name, after, changes)
    }

    /// Commits an edit that leaves these objects and changes these strokes.
    fn commit_objects(&mut self, name: String, after: Vec<Object>, strokes: Vec<StrokeChange>) -> Edit {
        let before = self.labels.objects.clone();
        self.commit(Edit {
            name,
            strokes,
            objects: Some((before, after)),
            ..Edit::default()
        })
    }

    /// The ids of the objects that are there, and of those that ever were: those deleted or undone could come back.
    fn object_ids_ever(&self) -> BTreeSet<ObjectId> {
        let ever = self.edits.iter().filter_map(|edit| edit.objects.as_ref());
        let ever = ever.flat_map(|(before, after)| before.iter().chain(after));
        ever.chain(&self.labels.objects).map(|object| object.id).collect()
    }
}

/// The next id above all used ones, or the smallest unused one where the highest is in use.
fn unused(used: &BTreeSet<ObjectId>) -> Option<ObjectId> {
    let next = used
        .last()
        .map_or(Some(1), |highest| highest.number().checked_add(1));
    next.and_then(ObjectId::new).or_else(|| {
        let mut all = (1..=u16::MAX).filter_map(ObjectId::new);
        all.find(|id| !used.contains(id))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::History;

    /// Two chairs with a click each, and a table's click.
    fn two_chairs() -> (History, [ObjectId; 2]) {
        let mut history = History::default();
        history.add_class("chair");
        history.add_class("table");
        history.add_stroke(Stroke::click(0, 2, [1, 1]));
        let chairs = [[2, 2], [3, 3]].map(|pixel| {
            let added = history.add_object(Stroke::click(0, 1, pixel), &[]);
            added.unwrap().0
        });
        (history, chairs)
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
        let shown = [Object {
            id: ObjectId::new(39).unwrap(),
            class: 2,
            name: "table 1".to_owned(),
        }];
        let table = history.add_object(Stroke::click(1, 2, [9, 9]), &shown).unwrap().0;
        assert_eq!(table.number(), 40);
        states.push(history.labels().clone());
        history.rename_object(second, "armchair").unwrap();
        states.push(history.labels().clone());
        history.merge_object(second, table).unwrap();
        assert_eq!(history.undo_name(), Some("merge armchair into table 2"));
        assert_eq!(
            said(&history),
            [(2, None), (1, Some(1)), (2, Some(40)), (2, Some(40))]
        );
        states.push(history.labels().clone());
        history.delete_object(first).unwrap();
        assert_eq!(said(&history).len(), 3);
        states.push(history.labels().clone());
        let before = history.labels().strokes.keys().next().copied().unwrap();
        history.change_stroke_object(before, table).unwrap();
        assert_eq!(history.undo_name(), Some("change click table to table 2"));
        for state in states.iter().rev() {
            history.undo().unwrap();
            assert_eq!(history.labels(), state);
        }
        for state in states.iter().skip(1) {
            history.redo().unwrap();
            assert_eq!(history.labels(), state);
        }
        assert!(history.merge_object(first, table).is_none() && history.rename_object(first, "x").is_none());
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
