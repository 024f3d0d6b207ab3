//! What COCO's two kinds of annotation share.

use serde::Serialize;

use super::layout::{Labelled, OutputFile};
use crate::labels::{Class, ClassId};

/// Where the images of the frames lie.
pub(super) const IMAGES: &str = "images";

/// A frame in the list `images`.
#[derive(Serialize)]
pub(super) struct Image {
    /// Place of the frame in the scene, counted from 1.
    pub(super) id: usize,
    file_name: String,
    width: u32,
    height: u32,
}

impl Image {
    /// A frame that has no number yet, with its image.
    pub(super) fn of(frame: &Labelled<'_>, original: &OutputFile) -> Self {
        let [width, height] = frame.size;
        Self {
            id: 0,
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
    /// 1 where each annotation is an object of its own, 0 where it is all that a frame shows of the class.
    isthing: u8,
}

/// The classes as categories, each its own supercategory.
pub(super) fn categories(classes: &[Class], isthing: bool) -> Vec<Category<'_>> {
    classes
        .iter()
        .map(|Class { id, name, color, .. }| Category {
            id: *id,
            name,
            supercategory: name,
            color: *color,
            isthing: u8::from(isthing),
        })
        .collect()
}
