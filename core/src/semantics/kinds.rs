//! What kinds of classes there are, which tells what they look like where no label does.

use std::collections::BTreeMap;

use crate::labels::{Class, ClassId, RoomPart, lies_flat};

/// The kinds of those classes that are things.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Kinds(BTreeMap<ClassId, Kind>);

/// What a class looks like by its kind.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Kind {
    /// Whether it ends somewhere, as things do; not where all classes are things, as that tells nothing of any.
    pub(super) ends: bool,
    /// The parts of the room that have classes of their own, so that it does not look like them.
    pub(super) other_than: Room,
}

/// Parts of a room, in the order of [`RoomPart::ALL`].
pub(super) type Room = [bool; RoomPart::ALL.len()];

impl Kinds {
    /// Of these classes, by what is said of them and by their names.
    pub fn new(classes: &[Class]) -> Self {
        let (things, stuff): (Vec<&Class>, Vec<_>) = classes.iter().partition(|class| class.thing);
        let is_part = |part, class: &&Class| RoomPart::named(&class.name) == Some(part);
        let room = RoomPart::ALL.map(|part| stuff.iter().any(|class| is_part(part, class)));
        let kind = |class: &Class| Kind {
            ends: !stuff.is_empty(),
            other_than: if lies_flat(&class.name) {
                Room::default()
            } else {
                room
            },
        };
        Self(things.into_iter().map(|class| (class.id, kind(class))).collect())
    }

    /// The same where no class is part of the room; `None` where that is no different.
    pub(super) fn without_room(&self) -> Option<Self> {
        let mut kinds = self.clone();
        kinds
            .0
            .values_mut()
            .for_each(|kind| kind.other_than = Room::default());
        (kinds != *self).then_some(kinds)
    }

    /// Whether a class is a thing.
    pub(super) fn is_thing(&self, class: ClassId) -> bool {
        self.0.contains_key(&class)
    }

    /// The kind of a class.
    pub fn of(&self, class: ClassId) -> Kind {
        self.0.get(&class).copied().unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn things_that_do_not_lie_flat_are_other_than_the_parts_of_the_room_that_have_classes() {
        let named = |names: &[&str]| {
            let classes: Vec<Class> = (1..).zip(names).map(|(id, name)| Class::new(id, *name)).collect();
            Kinds::new(&classes)
        };
        let kinds = named(&["wall", "chair", "picture", "floor"]);
        let [wall, chair, picture, _] = [1, 2, 3, 4].map(|class| kinds.of(class));
        assert_eq!(wall, Kind::default());
        assert_eq!(
            chair.other_than,
            RoomPart::ALL.map(|part| part != RoomPart::Ceiling)
        );
        assert_eq!(
            picture,
            Kind {
                ends: true,
                ..Kind::default()
            }
        );
        assert_eq!(kinds.without_room().unwrap().of(2), picture);
        assert_eq!(named(&["chair", "grass"]).without_room(), None);
        assert_eq!(named(&["chair"]).of(1), Kind::default());
    }
}
