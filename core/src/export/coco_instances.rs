//! COCO instances: a mask for each object of a frame, and one for each connected region of stuff.

use serde::Serialize;

use super::Refusal;
use super::coco::{self, Dataset, IMAGES, Image};
use super::components::{Component, Neighbours, box_around, components};
use super::layout::{About, Labelled, Layout, OutputFile, dense_json_file};
use super::original::original;
use super::run_length;
use crate::labels::ClassId;

/// `instances.json`, and `images/` with copies of the images.
///
/// An annotation of a thing is an object in one frame, in however many pieces; its `object_id` is the same in all frames. Of
/// stuff, and of things of which it is not known which they are, it is a region of one class in one frame that hangs together
/// by sides and corners of its pixels, however small. Masks are compressed run lengths, so that no pixel is lost.
pub(super) struct CocoInstances;

#[derive(Serialize)]
pub(super) struct Annotation {
    /// Counted from 1 over all frames; 0 as long as only its own frame is known.
    id: usize,
    /// Place of the frame in the scene, counted from 1.
    image_id: usize,
    category_id: ClassId,
    #[serde(skip_serializing_if = "Option::is_none")]
    object_id: Option<u16>,
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
    const FOLDERS: &'static [&'static str] = &[IMAGES];
    const INDEX: &'static [&'static str] = &["instances.json"];

    fn frame(&self, frame: &Labelled<'_>) -> Result<(Vec<OutputFile>, Self::Entry), Refusal> {
        let (segments, places) = frame.segments()?;
        let [width, height] = frame.size;
        let mut regions: Vec<Component> = Vec::new();
        let mut region_of: Vec<Option<usize>> = vec![None; segments.len()];
        for component in components(&places, width, Neighbours::SidesAndCorners) {
            let Some(place) = usize::from(component.label).checked_sub(1) else {
                continue;
            };
            match region_of[place] {
                Some(first) => regions[first].runs.extend(component.runs),
                None => {
                    let is_object = segments[place].thing(frame.classes).is_some();
                    region_of[place] = is_object.then_some(regions.len());
                    regions.push(component);
                }
            }
        }
        let annotation = |mut region: Component| {
            region.runs.sort_unstable_by_key(|run| (run.row, run.first));
            let segment = segments[usize::from(region.label) - 1];
            let counts = run_length::compressed(&run_length::counts(&region.runs, frame.size));
            let size = [height, width];
            Annotation {
                id: 0,
                image_id: frame.number,
                category_id: frame.classes[usize::from(segment.class) - 1].id,
                object_id: segment.thing(frame.classes),
                segmentation: Segmentation { size, counts },
                area: region.area(),
                bbox: box_around(&region.runs),
                iscrowd: 0,
            }
        };
        let annotations = regions.into_iter().map(annotation).collect();
        let original = original(frame.frame, IMAGES)?;
        let image = Image::of(frame, &original);
        Ok((vec![original], (image, annotations)))
    }

    fn index(&self, about: About<'_>, entries: Vec<Self::Entry>) -> Result<Vec<OutputFile>, Refusal> {
        let (images, annotations): (_, Vec<Vec<Annotation>>) = entries.into_iter().unzip();
        let mut annotations = annotations.into_iter().flatten().collect::<Vec<_>>();
        for (id, annotation) in (1..).zip(&mut annotations) {
            annotation.id = id;
        }
        let categories = coco::categories(about, true);
        let instances = Dataset {
            images,
            annotations,
            categories,
        };
        Ok(vec![dense_json_file(Self::INDEX[0], &instances)?])
    }
}
