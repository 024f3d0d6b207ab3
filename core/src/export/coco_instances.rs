//! COCO instances: a mask for each connected region.

use serde::Serialize;

use super::Refusal;
use super::coco::{self, Category, IMAGES, Image};
use super::components::{Neighbours, components};
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
                    bbox: coco::bbox(component.bounds()),
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

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;
    use crate::export::Format;
    use crate::export::testing::{self, SIZE};
    use crate::labels::VOID;

    #[test]
    fn the_masks_of_all_annotations_are_the_label_maps() {
        let exported = testing::exported(Format::CocoInstances);
        let json: Value = serde_json::from_slice(&exported.files["instances.json"]).unwrap();
        let mut maps = vec![vec![VOID; exported.labels[0].len()]; 2];
        let mut ids = Vec::new();
        for annotation in json["annotations"].as_array().unwrap() {
            let counts = annotation["segmentation"]["counts"].as_str().unwrap();
            let mask = run_length::decoded(&run_length::decompressed(counts), SIZE);
            let pixels = || mask.iter().enumerate().filter(|(_, inside)| **inside);
            assert_eq!(annotation["area"], pixels().count());
            let column = |(index, _): (usize, _)| index as u32 % SIZE[0];
            let row = |(index, _): (usize, _)| index as u32 / SIZE[0];
            let (x, y) = (
                pixels().map(column).min().unwrap(),
                pixels().map(row).min().unwrap(),
            );
            let [right, bottom] = [
                pixels().map(column).max().unwrap(),
                pixels().map(row).max().unwrap(),
            ];
            let bbox = serde_json::json!([x, y, right - x + 1, bottom - y + 1]);
            assert_eq!(annotation["bbox"], bbox);
            let map = &mut maps[annotation["image_id"].as_u64().unwrap() as usize - 1];
            for (index, _) in pixels() {
                assert_eq!(map[index], VOID, "masks overlap");
                map[index] = annotation["category_id"].as_u64().unwrap() as ClassId;
            }
            ids.push(annotation["id"].as_u64().unwrap());
        }
        assert_eq!(maps, exported.labels);
        assert_eq!(ids, (1..=ids.len() as u64).collect::<Vec<_>>());
        assert_eq!(json["images"][1]["file_name"], "rgb_1.png");
        assert!(exported.files.contains_key("images/rgb_1.png"));
        assert_eq!(
            json["categories"].as_array().unwrap().len(),
            testing::classes().len()
        );
    }
}
