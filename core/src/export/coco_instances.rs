//! COCO instances: a mask for each connected region.

use serde::Serialize;

use super::Refusal;
use super::coco::{self, Category, IMAGES, Image};
use super::components::{Neighbours, box_around, components};
use super::layout::{Labelled, Layout, OutputFile, dense_json_file};
use super::original::Original;
use super::run_length;
use crate::labels::{Class, ClassId};

/// `instances.json`, and `images/` with copies of the images.
///
/// An annotation is a region of one class in one frame that hangs together by sides and corners of its pixels, however
/// small; its mask is compressed run lengths, so that no pixel is lost.
pub(super) struct CocoInstances;

/// An annotation that has no numbers yet.
pub(super) struct Region {
    category_id: ClassId,
    area: u64,
    bbox: [u32; 4],
    counts: String,
}

#[derive(Serialize)]
struct Annotation {
    /// Counted from 1 over all frames.
    id: usize,
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

#[derive(Serialize)]
struct Instances<'a> {
    images: Vec<Image>,
    annotations: Vec<Annotation>,
    categories: Vec<Category<'a>>,
}

impl Layout for CocoInstances {
    type Entry = (Image, [u32; 2], Vec<Region>);

    fn folders(&self) -> &'static [&'static str] {
        &[IMAGES]
    }

    fn frame(&self, frame: &Labelled<'_>) -> Result<(Vec<OutputFile>, Self::Entry), Refusal> {
        let positions = frame.positions()?;
        let regions = components(&positions, frame.size[0], Neighbours::SidesAndCorners)
            .into_iter()
            .filter_map(|component| {
                let class = &frame.classes[usize::from(component.label).checked_sub(1)?];
                Some(Region {
                    category_id: class.id,
                    area: component.area(),
                    bbox: box_around(&component.runs),
                    counts: run_length::compressed(&run_length::counts(&component.runs, frame.size)),
                })
            });
        let original = Original::of(frame.frame)?;
        let entry = (Image::of(frame, &original), frame.size, regions.collect());
        Ok((vec![original.into_file(IMAGES)], entry))
    }

    fn index(&self, classes: &[Class], entries: Vec<Self::Entry>) -> Result<Vec<OutputFile>, Refusal> {
        let mut instances = Instances {
            images: Vec::with_capacity(entries.len()),
            annotations: Vec::new(),
            categories: coco::categories(classes, true),
        };
        for (image_id, (image, [width, height], regions)) in (1..).zip(entries) {
            instances.images.push(image.numbered(image_id));
            for region in regions {
                instances.annotations.push(Annotation {
                    id: instances.annotations.len() + 1,
                    image_id,
                    category_id: region.category_id,
                    segmentation: Segmentation {
                        size: [height, width],
                        counts: region.counts,
                    },
                    area: region.area,
                    bbox: region.bbox,
                    iscrowd: 0,
                });
            }
        }
        Ok(vec![dense_json_file("instances.json", &instances)?])
    }
}
