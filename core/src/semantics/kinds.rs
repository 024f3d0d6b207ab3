//! What kinds of classes there are, which tells what they look like where no label does.

use std::collections::BTreeMap;

use crate::labels::{Class, ClassId, RoomPart, lies_flat};

/// The kinds of classes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Kinds(BTreeMap<ClassId, Kind>);

/// What a class looks like by its kind.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Kind {
    /// Whether it is a thing.
    pub(super) thing: bool,
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
        let parts: Vec<RoomPart> = classes.iter().filter_map(RoomPart::of).collect();
        let has_stuff = classes.iter().any(|class| !class.thing);
        let kind = |class: &Class| {
            let own = RoomPart::of(class);
            let stands_out = own.is_some() || (class.thing && !lies_flat(&class.name));
            Kind {
                thing: class.thing,
                ends: class.thing && has_stuff,
                other_than: RoomPart::ALL
                    .map(|other| stands_out && own != Some(other) && parts.contains(&other)),
            }
        };
        Self(classes.iter().map(|class| (class.id, kind(class))).collect())
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

    /// The kind of a class.
    pub fn of(&self, class: ClassId) -> Kind {
        self.0.get(&class).copied().unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_lie_flat_is_other_than_the_parts_of_the_room_that_have_classes() {
        let named = |names: &[&str]| {
            let classes: Vec<Class> = (1..).zip(names).map(|(id, name)| Class::new(id, *name)).collect();
            Kinds::new(&classes)
        };
        let kinds = named(&["wall", "chair", "picture", "floor", "grass"]);
        let [floor, wall] =
            [RoomPart::Floor, RoomPart::Wall].map(|known| RoomPart::ALL.map(|part| part == known));
        let both = RoomPart::ALL.map(|part| part != RoomPart::Ceiling);
        let of_class = |class| kinds.of(class).other_than;
        assert_eq!(
            [1, 2, 3, 4, 5].map(of_class),
            [floor, both, Room::default(), wall, Room::default()]
        );
        assert!([2, 3].into_iter().all(|class| kinds.of(class).ends));
        assert_eq!(kinds.of(5), Kind::default());
        assert_eq!(kinds.without_room().unwrap().of(2), kinds.of(3));
        assert_eq!(named(&["chair", "grass"]).without_room(), None);
        assert!(!named(&["chair"]).of(1).ends);
    }
}
