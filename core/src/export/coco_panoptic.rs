//! COCO panoptic: segments in images, with a list of what they are.

use serde::Serialize;

use super::Refusal;
use super::coco::{self, Dataset, IMAGES, Image};
use super::components::box_around;
use super::layout::{About, Labelled, Layout, OutputFile, dense_json_file};
use super::original::original;
use crate::labels::{ClassId, Run, png, runs_of_equal};

const SEGMENTS: &str = "panoptic";
/// Above all class ids.
const FIRST_OBJECT: u32 = 1 << 16;

/// `panoptic.json`, `panoptic/<stem>.png` and `images/` with copies of the images.
///
/// A segment of a thing is an object, and its number 65536 + the object's, the same in all frames. A segment of stuff is all
/// that a frame shows of a class, and its number the class id; so is that of things of which it is not known which they are,
/// a crowd. Numbers are red + 256 green + 65536 blue in the PNG; void is 0. Where nothing is known of objects all classes are
/// stuff (`isthing` 0).
pub(super) struct CocoPanoptic;

#[derive(Serialize)]
pub(super) struct Segment {
    id: u32,
    category_id: ClassId,
    area: u64,
    bbox: [u32; 4],
    iscrowd: u8,
}

#[derive(Serialize)]
pub(super) struct Annotation {
    /// Place of the frame in the scene, counted from 1.
    image_id: usize,
    file_name: String,
    segments_info: Vec<Segment>,
}

impl Layout for CocoPanoptic {
    type Entry = (Image, Annotation);
    const FOLDERS: &'static [&'static str] = &[SEGMENTS, IMAGES];
    const INDEX: &'static [&'static str] = &["panoptic.json"];

    fn frame(&self, frame: &Labelled<'_>) -> Result<(Vec<OutputFile>, Self::Entry), Refusal> {
        let [width, height] = frame.size;
        let (listed, places) = frame.segments()?;
        let mut runs: Vec<Vec<Run>> = vec![Vec::new(); listed.len() + 1];
        for (place, run) in runs_of_equal(&places, width) {
            runs[usize::from(place)].push(run);
        }
        let mut numbers = vec![0_u32];
        let mut segments_info = Vec::with_capacity(listed.len());
        for (segment, runs) in listed.iter().zip(&runs[1..]) {
            let class = &frame.classes[usize::from(segment.class) - 1];
            let object = segment.thing(frame.classes);
            let id = object.map_or(u32::from(class.id), |object| FIRST_OBJECT + u32::from(object));
            numbers.push(id);
            segments_info.push(Segment {
                id,
                category_id: class.id,
                area: runs.iter().map(Run::pixels).sum(),
                bbox: box_around(runs),
                iscrowd: u8::from(frame.objects.is_some() && class.thing && object.is_none()),
            });
        }
        let number = |&place: &u16| {
            let [red, green, blue, _] = numbers[usize::from(place)].to_le_bytes();
            [red, green, blue]
        };
        let rgb: Vec<[u8; 3]> = places.iter().map(number).collect();
        let image = png::encode_rgb(width, height, rgb.as_flattened())?;
        let file_name = format!("{}.png", frame.stem());
        let segments = OutputFile::new(format!("{SEGMENTS}/{file_name}"), image);
        let original = original(frame.frame, IMAGES)?;
        let listed = Image::of(frame, &original);
        let annotation = Annotation {
            image_id: frame.number,
            file_name,
            segments_info,
        };
        Ok((vec![segments, original], (listed, annotation)))
    }

    fn index(&self, about: About<'_>, entries: Vec<Self::Entry>) -> Result<Vec<OutputFile>, Refusal> {
        let (images, annotations) = entries.into_iter().unzip();
        let categories = coco::categories(about, false);
        let panoptic = Dataset {
            images,
            annotations,
            categories,
        };
        Ok(vec![dense_json_file(Self::INDEX[0], &panoptic)?])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::testing;
    use crate::labels::Class;

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
