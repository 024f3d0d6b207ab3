//! COCO instances: a mask for each connected region.

use serde::Serialize;

use super::Refusal;
use super::coco::{self, Dataset, IMAGES, Image};
use super::components::{Neighbours, box_around, components};
use super::layout::{Labelled, Layout, OutputFile, dense_json_file};
use super::original::original;
use super::run_length;
use crate::labels::{Class, ClassId};

/// `instances.json`, and `images/` with copies of the images.
///
/// An annotation is a region of one class in one frame that hangs together by sides and corners of its pixels, however
/// small; its mask is compressed run lengths, so that no pixel is lost.
pub(super) struct CocoInstances;

#[derive(Serialize)]
pub(super) struct Annotation {
    /// Counted from 1 over all frames; 0 as long as only its own frame is known.
    id: usize,
    /// The same of the frame.
    image_id: usize,
    category_id: ClassId,
    segmentation: Segmentation,
    area: u64,
    bbox: [u32; 4],
    iscrowd: u8,
}

#[derive(Serialize)]
struct Segmentation {
    /// Height and width, in this order.
    size: [u32; 2],
    counts: String,
}

impl Layout for CocoInstances {
    type Entry = (Image, Vec<Annotation>);

    fn folders(&self) -> &'static [&'static str] {
        &[IMAGES]
    }

    fn frame(&self, frame: &Labelled<'_>) -> Result<(Vec<OutputFile>, Self::Entry), Refusal> {
        let positions = frame.positions()?;
        let [width, height] = frame.size;
        let annotations = components(&positions, width, Neighbours::SidesAndCorners)
            .into_iter()
            .filter_map(|component| {
                let class = &frame.classes[usize::from(component.label).checked_sub(1)?];
                let counts = run_length::compressed(&run_length::counts(&component.runs, frame.size));
                let size = [height, width];
                Some(Annotation {
                    id: 0,
                    image_id: 0,
                    category_id: class.id,
                    segmentation: Segmentation { size, counts },
                    area: component.area(),
                    bbox: box_around(&component.runs),
                    iscrowd: 0,
                })
            });
        let annotations = annotations.collect();
        let original = original(frame.frame, IMAGES)?;
        let image = Image::of(frame, &original);
        Ok((vec![original], (image, annotations)))
    }

    fn index(&self, classes: &[Class], entries: Vec<Self::Entry>) -> Result<Vec<OutputFile>, Refusal> {
        let mut instances = Dataset {
            images: Vec::with_capacity(entries.len()),
            annotations: Vec::new(),
            categories: coco::categories(classes, true),
        };
        for (image_id, (mut image, annotations)) in (1..).zip(entries) {
            image.id = image_id;
            instances.images.push(image);
            for mut annotation in annotations {
                annotation.id = instances.annotations.len() + 1;
                annotation.image_id = image_id;
                instances.annotations.push(annotation);
            }
        }
        Ok(vec![dense_json_file("instances.json", &instances)?])
    }
}
