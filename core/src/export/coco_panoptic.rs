//! COCO panoptic: segments in images, with a list of what they are.

use serde::Serialize;

use super::Refusal;
use super::coco::{self, Dataset, IMAGES, Image};
use super::components::{box_around, label_runs};
use super::layout::{Labelled, Layout, OutputFile, dense_json_file};
use super::original::original;
use crate::labels::{Class, ClassId, Run, png};

const SEGMENTS: &str = "panoptic";

/// `panoptic.json`, `panoptic/<stem>.png` and `images/` with copies of the images.
///
/// A segment is all that a frame shows of a class, which is what COCO has for stuff: all classes are (`isthing` 0). Its
/// number is the class id, red + 256 green + 65536 blue in the PNG; void is 0.
pub(super) struct CocoPanoptic;

#[derive(Serialize)]
pub(super) struct Segment {
    id: ClassId,
    category_id: ClassId,
    area: u64,
    bbox: [u32; 4],
    iscrowd: u8,
}

#[derive(Serialize)]
pub(super) struct Annotation {
    /// Place of the frame in the scene, counted from 1; 0 as long as only the frame is known.
    image_id: usize,
    file_name: String,
    segments_info: Vec<Segment>,
}

impl Layout for CocoPanoptic {
    type Entry = (Image, Annotation);

    fn folders(&self) -> &'static [&'static str] {
        &[SEGMENTS, IMAGES]
    }

    fn frame(&self, frame: &Labelled<'_>) -> Result<(Vec<OutputFile>, Self::Entry), Refusal> {
        let [width, height] = frame.size;
        let mut runs: Vec<Vec<Run>> = vec![Vec::new(); frame.classes.len() + 1];
        for (position, run) in label_runs(&frame.positions()?, width) {
            runs[usize::from(position)].push(run);
        }
        let segment = |(class, runs): (&Class, &Vec<Run>)| Segment {
            id: class.id,
            category_id: class.id,
            area: runs.iter().map(Run::pixels).sum(),
            bbox: box_around(runs),
            iscrowd: 0,
        };
        let shown = frame.classes.iter().zip(&runs[1..]);
        let segments_info = shown.filter(|(_, runs)| !runs.is_empty()).map(segment).collect();
        let number = |id: &ClassId| {
            let [low, high] = id.to_le_bytes();
            [low, high, 0]
        };
        let rgb: Vec<u8> = frame.labels.iter().flat_map(number).collect();
        let image = png::encode_rgb(width, height, &rgb)?;
        let file_name = format!("{}.png", frame.stem());
        let segments = OutputFile::new(format!("{SEGMENTS}/{file_name}"), image);
        let original = original(frame.frame, IMAGES)?;
        let listed = Image::of(frame, &original);
        let annotation = Annotation {
            image_id: 0,
            file_name,
            segments_info,
        };
        Ok((vec![segments, original], (listed, annotation)))
    }

    fn index(&self, classes: &[Class], entries: Vec<Self::Entry>) -> Result<Vec<OutputFile>, Refusal> {
        let mut panoptic = Dataset {
            images: Vec::with_capacity(entries.len()),
            annotations: Vec::with_capacity(entries.len()),
            categories: coco::categories(classes, false),
        };
        for (image_id, (mut image, mut annotation)) in (1..).zip(entries) {
            (image.id, annotation.image_id) = (image_id, image_id);
            panoptic.images.push(image);
            panoptic.annotations.push(annotation);
        }
        Ok(vec![dense_json_file("panoptic.json", &panoptic)?])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::testing;

    #[test]
    fn numbers_above_255_reach_into_the_green() {
        let scene = testing::scene();
        let classes = [Class::new(300, "lobster")];
        let labels = vec![300; testing::labels(0).len()];
        let frame = testing::labelled(&scene, testing::SIZE, &classes, labels);
        let (files, (_, annotation)) = CocoPanoptic.frame(&frame).unwrap();
        let pixel = image::load_from_memory(&files[0].bytes).unwrap().into_rgb8();
        assert_eq!(pixel.get_pixel(0, 0).0, [44, 1, 0]);
        assert_eq!(
            annotation.segments_info[0].bbox,
            [0, 0, testing::WIDTH, testing::HEIGHT]
        );
    }
}
