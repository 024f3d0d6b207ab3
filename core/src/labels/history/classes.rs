//! Edits of the classes: adding one or many at once, changing, merging and deleting them, and their order.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::{History, unused};
use crate::labels::{Class, ClassId, Edit, ImportChange, ImportedLabels, Label, Stroke, StrokeChange, VOID};

/// What became of classes that were to be added.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AddedClasses {
    /// Those that were added, with the ids that they have now.
    pub added: Vec<Class>,
    /// Those that were left out, because a class of that name is there already.
    pub known: Vec<Class>,
    /// Of those added, the ones that got another id because theirs is taken: the id asked for and the class.
    pub renumbered: Vec<(ClassId, Class)>,
}

impl History {
    /// Adds a class with the next id and colour; returns its id and the edit.
    pub fn add_class(&mut self, name: &str) -> (ClassId, Edit) {
        let id = self.unused_class_id(&[]);
        let mut after = self.labels.classes.clone();
        after.push(Class::new(id, name));
        (id, self.commit_classes(format!("add class {name}"), after))
    }

    /// Adds classes at the end of the list, in one edit; `None` when all of them are there already.
    ///
    /// A class whose name is there already (capitals aside) is left out. Ids are kept where they are free, and
    /// otherwise the next ones above all that are or were in use.
    pub fn add_classes(&mut self, classes: &[Class]) -> (Option<Edit>, AddedClasses) {
        let mut after = self.labels.classes.clone();
        let mut outcome = AddedClasses::default();
        let mut displaced = Vec::new();
        for class in classes {
            if after.iter().any(|present| present.is_named(&class.name))
                || displaced.iter().any(|other: &&Class| other.is_named(&class.name))
            {
                outcome.known.push(class.clone());
            } else if class.id == VOID || self.is_taken(&after, class) {
                displaced.push(class);
            } else {
                outcome.added.push(class.clone());
                after.push(class.clone());
            }
        }
        // Only now, so that no class gets an id that a later one brings.
        let mut used = self.class_ids_ever(&after);
        for class in displaced {
            let id = unused(&used).unwrap_or(ClassId::MAX);
            used.insert(id);
            let renumbered = Class { id, ..class.clone() };
            outcome.renumbered.push((class.id, renumbered.clone()));
            outcome.added.push(renumbered.clone());
            after.push(renumbered);
        }
        let edit = (!outcome.added.is_empty()).then(|| {
            let name = match outcome.added.as_slice() {
                [class] => format!("add class {}", class.name),
                many => format!("add {} classes", many.len()),
            };
            self.commit_classes(name, after)
        });
        (edit, outcome)
    }

    /// Moves a class to a place of the list, counted without it; `None` when there is no such class or it is there
    /// already.
    pub fn move_class(&mut self, id: ClassId, place: usize) -> Option<Edit> {
        let mut after = self.labels.classes.clone();
        let index = after.iter().position(|class| class.id == id)?;
        let class = after.remove(index);
        let place = place.min(after.len());
        if place == index {
            return None;
        }
        let name = format!("move class {}", class.name);
        after.insert(place, class);
        Some(self.commit_classes(name, after))
    }

    /// Changes a class's name and colour; `None` when there is no such class or nothing changes.
    pub fn change_class(&mut self, class: Class) -> Option<Edit> {
        let mut after = self.labels.classes.clone();
        let place = after.iter_mut().find(|candidate| candidate.id == class.id)?;
        if *place == class {
            return None;
        }
        let name = format!("change class {}", class.name);
        *place = class;
        Some(self.commit_classes(name, after))
    }

    /// Deletes a class and its strokes; `None` when there is no such class.
    pub fn delete_class(&mut self, id: ClassId) -> Option<Edit> {
        let name = format!("delete class {}", self.labels.class(id)?.name);
        Some(self.remove_class(id, name, None, None))
    }

    /// Gives all strokes and imported pixels of one class to another and deletes the first; `None` unless both
    /// exist.
    pub fn merge_class(&mut self, from: ClassId, into: ClassId) -> Option<Edit> {
        let (source, target) = (self.labels.class(from)?, self.labels.class(into)?);
        if from == into {
            return None;
        }
        let name = format!("merge class {} into {}", source.name, target.name);
        let says = |images: &&Arc<ImportedLabels>| images.classes().contains(&from);
        let images = self.labels.imported.as_ref().filter(says);
        let becomes = |label: Label| match label.class == from {
            true => Label { class: into, ..label },
            false => label,
        };
        let images = images.map(|images| images.relabelled(becomes));
        let imported = images.map(|images| self.change_import(Some(images)));
        Some(self.remove_class(from, name, Some(into), imported))
    }

    /// Commits an edit that takes a class away, and its strokes and objects unless they become of another one.
    fn remove_class(
        &mut self,
        id: ClassId,
        name: String,
        becomes: Option<ClassId>,
        imported: Option<ImportChange>,
    ) -> Edit {
        let before = self.labels.classes.clone();
        let after = before.iter().filter(|class| class.id != id).cloned().collect();
        let objects = self.labels.objects.clone();
        let mut left = objects.clone();
        match becomes {
            Some(class) => left
                .iter_mut()
                .filter(|object| object.class == id)
                .for_each(|object| object.class = class),
            None => left.retain(|object| object.class != id),
        }
        let strokes = self.labels.strokes.iter();
        let of_class = strokes.filter(|(_, stroke)| stroke.class == id);
        let changes = of_class.map(|(&id, stroke)| {
            let after = becomes.map(|class| Stroke {
                class,
                ..stroke.as_ref().clone()
            });
            StrokeChange::of(id, stroke, after)
        });
        self.commit(Edit {
            name,
            strokes: changes.collect(),
            classes: Some((before, after)),
            objects: (objects != left).then_some((objects, left)),
            imported,
            checked: None,
        })
    }

    /// Commits an edit that leaves these classes.
    fn commit_classes(&mut self, name: String, after: Vec<Class>) -> Edit {
        let before = self.labels.classes.clone();
        self.commit(Edit {
            name,
            classes: Some((before, after)),
            ..Edit::default()
        })
    }

    /// An id that neither these classes nor any earlier one has, also none of those deleted or undone that could come
    /// back.
    pub(super) fn unused_class_id(&self, classes: &[Class]) -> ClassId {
        unused(&self.class_ids_ever(classes)).unwrap_or(ClassId::MAX)
    }

    /// The ids of these classes, of those that are there, and of those that ever were.
    fn class_ids_ever(&self, classes: &[Class]) -> BTreeSet<ClassId> {
        let ever = self.edits.iter().filter_map(|edit| edit.classes.as_ref());
        let ever = ever.flat_map(|(before, after)| before.iter().chain(after));
        let all = ever.chain(&self.labels.classes).chain(classes);
        all.map(|class| class.id).collect()
    }

    /// Whether a class with the id of this one is there, or was there under another name.
    pub(super) fn is_taken(&self, present: &[Class], class: &Class) -> bool {
        // Edits that were undone are forgotten with the next one.
        let in_force = self.edits.iter().take(self.cursor);
        let mut earlier = in_force
            .filter_map(|edit| edit.classes.as_ref())
            .flat_map(|(before, after)| before.iter().chain(after));
        present.iter().any(|other| other.id == class.id)
            || earlier.any(|other| other.id == class.id && !other.is_named(&class.name))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::testing::clicked;

    fn named(history: &History) -> Vec<(ClassId, &str)> {
        let classes = history.labels().classes.iter();
        classes.map(|class| (class.id, class.name.as_str())).collect()
    }

    #[test]
    fn known_names_are_left_out_and_taken_numbers_give_way_to_the_next() {
        let mut history = clicked(&["Wall", "mug"], &[]);
        let brought = [
            Class::new(2, "bed"),
            Class::new(1, "wall "),
            Class::new(7, "lamp"),
            Class::new(3, "door"),
            Class::new(3, "gate"),
        ];
        let (_, outcome) = history.add_classes(&brought);
        assert_eq!(
            named(&history),
            [
                (1, "Wall"),
                (2, "mug"),
                (7, "lamp"),
                (3, "door"),
                (8, "bed"),
                (9, "gate")
            ]
        );
        assert_eq!(outcome.known, [Class::new(1, "wall ")]);
        let renumbered: Vec<_> = outcome
            .renumbered
            .iter()
            .map(|(old, class)| (*old, class.id))
            .collect();
        assert_eq!(renumbered, [(2, 8), (3, 9)]);
    }

    #[test]
    fn a_number_comes_back_to_its_own_name_only() {
        let mut history = History::default();
        let (bed, _) = history.add_class("bed");
        history.delete_class(bed).unwrap();
        history.add_classes(&[Class::new(bed, "sofa")]);
        assert_eq!(named(&history), [(bed + 1, "sofa")]);
        history.add_classes(&[Class::new(bed, "bed")]);
        assert_eq!(named(&history), [(bed + 1, "sofa"), (bed, "bed")]);
        // The highest number does not keep others out.
        let mut history = History::default();
        history.add_classes(&[Class::new(ClassId::MAX, "last"), Class::new(1, "first")]);
        assert_eq!(history.add_class("next").0, 2);
    }

    #[test]
    fn classes_are_moved_and_moved_back() {
        let mut history = clicked(&["wall", "floor", "door"], &[(0, 3, [1, 1])]);
        let order =
            |history: &History| -> Vec<ClassId> { named(history).iter().map(|(id, _)| *id).collect() };
        history.move_class(3, 0).unwrap();
        assert_eq!(order(&history), [3, 1, 2]);
        history.move_class(3, 99).unwrap();
        assert_eq!(order(&history), [1, 2, 3]);
        assert!(history.move_class(3, 2).is_none() && history.move_class(9, 0).is_none());
        history.undo().unwrap();
        history.undo().unwrap();
        assert_eq!(order(&history), [1, 2, 3]);
        assert_eq!(history.labels().strokes.len(), 1);
    }
}
