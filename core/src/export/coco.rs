//! What COCO's two kinds of annotation share.

use serde::Serialize;

use super::layout::{About, Labelled, OutputFile};
use crate::labels::{Class, ClassId};

/// Where the images of the frames lie.
pub(super) const IMAGES: &str = "images";

/// A frame in the list `images`.
#[derive(Serialize)]
pub(super) struct Image {
    /// Place of the frame in the scene, counted from 1.
    id: usize,
    file_name: String,
    width: u32,
    height: u32,
}

impl Image {
    /// A frame with its image.
    pub(super) fn of(frame: &Labelled<'_>, original: &OutputFile) -> Self {
        let [width, height] = frame.size;
        Self {
            id: frame.number,
            file_name: original.name(),
            width,
            height,
        }
    }
}

/// The file that lists everything.
#[derive(Serialize)]
pub(super) struct Dataset<'a, A> {
    pub(super) images: Vec<Image>,
    pub(super) annotations: Vec<A>,
    pub(super) categories: Vec<Category<'a>>,
}

/// A class in the list `categories`.
#[derive(Serialize)]
pub(super) struct Category<'a> {
    id: ClassId,
    name: &'a str,
    supercategory: &'a str,
    color: [u8; 3],
    /// 1 where annotations are objects, 0 where they are all that a frame shows of the class, or regions of that.
    isthing: u8,
}

/// The classes as categories, each its own supercategory; `otherwise` tells whether they are things where nothing is known
/// of objects.
pub(super) fn categories<'a>(about: About<'a>, otherwise: bool) -> Vec<Category<'a>> {
    let category = |class: &'a Class| Category {
        id: class.id,
        name: &class.name,
        supercategory: &class.name,
        color: class.color,
        isthing: u8::from(about.objects.map_or(otherwise, |_| class.thing)),
    };
    about.classes.iter().map(category).collect()
}
