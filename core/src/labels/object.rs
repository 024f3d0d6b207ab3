//! Objects: which chair, not only chair.

use std::num::NonZeroU16;

use rustc_hash::FxHashSet;
use serde::{Deserialize, Serialize};

use super::{ClassId, Stroke, StrokeId};

/// An object's number, never 0: the pixel value in exported object maps, unique in the scene and the same in all frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct ObjectId(NonZeroU16);

impl ObjectId {
    /// The object with this number; `None` for 0, which stands for no object.
    pub fn new(number: u16) -> Option<Self> {
        NonZeroU16::new(number).map(Self)
    }

    /// Its number.
    pub fn number(self) -> u16 {
        self.0.get()
    }
}

/// One of the things of a class, told apart by the strokes that name it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Object {
    /// Pixel value in object maps; stable for the life of a project.
    pub id: ObjectId,
    /// Its class, the same as that of all its strokes.
    pub class: ClassId,
    /// Name for people.
    pub name: String,
}

/// An object as maps show it: one that strokes name, or a part of a thing that nothing joins to the others of its class.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FoundObject {
    /// Its number, class and name.
    pub object: Object,
    /// Number of the keyframes that show it.
    pub frames: usize,
    /// Number of their pixels that do.
    pub pixels: u64,
    /// The strokes of its class that lie on it and name no object.
    pub strokes: Vec<StrokeId>,
    /// A click of its class on the frame with most of its pixels, far inside of it; `None` where no frame shows it.
    pub click: Option<Stroke>,
}

impl From<Object> for FoundObject {
    /// One of which it is not known where it is.
    fn from(object: Object) -> Self {
        Self {
            object,
            frames: 0,
            pixels: 0,
            strokes: Vec::new(),
            click: None,
        }
    }
}

/// The first of "chair 1", "chair 2" and so on that is not among these names.
pub(crate) fn unused_name<'a>(class: &str, names: impl Iterator<Item = &'a str>) -> String {
    let taken: FxHashSet<&str> = names.collect();
    let numbered = (1_u32..).map(|number| format!("{class} {number}"));
    let mut unused = numbered.filter(|name| !taken.contains(name.as_str()));
    unused.next().unwrap_or_default()
}

/// What a stroke says of its pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Label {
    /// The class.
    pub class: ClassId,
    /// The object of the class, where it says which one.
    pub object: Option<ObjectId>,
}

impl Label {
    /// What says this class, and this object of it where it says which one.
    pub fn new(class: ClassId, object: Option<ObjectId>) -> Self {
        Self { class, object }
    }
}

impl From<ClassId> for Label {
    fn from(class: ClassId) -> Self {
        Self::new(class, None)
    }
}
