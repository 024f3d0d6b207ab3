//! What kinds of classes there are, which tells what they look like where no label does.

use std::collections::BTreeSet;

use crate::labels::{Class, ClassId, RoomPart, lies_flat};

/// The kinds of some classes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Kinds {
    things: BTreeSet<ClassId>,
    /// The things that may look like part of the room.
    flat: BTreeSet<ClassId>,
    /// The stuff that a room consists of.
    room: Room,
    /// Whether some classes are things and others are none: only then that tells something.
    differ: bool,
}

/// What a class looks like by its kind.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Kind {
    /// Whether it ends somewhere, as things do.
    pub(super) ends: bool,
    /// The parts of the room that have classes of their own, so that it does not look like them.
    pub(super) other_than: Room,
}

/// Parts of a room, in the order of [`RoomPart`].
pub(super) type Room = [bool; RoomPart::ALL.len()];

impl Kinds {
    /// Of these classes, by what is said of them and by their names.
    pub fn new(classes: &[Class]) -> Self {
        let (things, stuff): (Vec<_>, Vec<_>) = classes.iter().partition(|class| class.thing);
        let part = |part| {
            stuff
                .iter()
                .any(|class| RoomPart::named(&class.name) == Some(part))
        };
        Self {
            differ: !stuff.is_empty(),
            room: RoomPart::ALL.map(part),
            flat: things
                .iter()
                .filter(|class| lies_flat(&class.name))
                .map(|class| class.id)
                .collect(),
            things: things.iter().map(|class| class.id).collect(),
        }
    }

    /// The same where no class is part of the room; `None` where none is.
    pub(super) fn without_room(&self) -> Option<Self> {
        (self.room != Room::default()).then(|| Self {
            room: Room::default(),
            ..self.clone()
        })
    }

    /// Whether a class is a thing.
    pub(super) fn is_thing(&self, class: ClassId) -> bool {
        self.things.contains(&class)
    }

    /// The kind of a class.
    pub fn of(&self, class: ClassId) -> Kind {
        let is_thing = self.is_thing(class);
        Kind {
            ends: is_thing && self.differ,
            other_than: if is_thing && !self.flat.contains(&class) {
                self.room
            } else {
                Room::default()
            },
        }
    }
}
