//! Polygons for labelme.

use serde::Serialize;

use super::Refusal;
use super::layout::{Labelled, Layout, OutputFile, dense_json_file};
use super::original::original;
use super::polygons::{Polygon, polygons};
use crate::labels::Class;

const FOLDER: &str = "labelme";
/// The version of labelme whose files these are like.
const VERSION: &str = "5.5.0";
/// What labelme's tools take for class 0.
const BACKGROUND: &str = "_background_";

/// `labelme/<stem>.json` and a copy of the image beside it.
///
/// A shape is the outer border of a region whose pixels hang together by their sides: a polygon through the centres of its
/// outermost pixels, in order from the top, so that what lies inside a region comes after it and covers it, as
/// labelme's `shapes_to_label` paints them. Polygons have no holes there: void inside a region is a shape `_background_`.
/// The shapes of an object have its number as `group_id`.
pub(super) struct Labelme;

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct LabelFile<'a> {
    version: &'static str,
    flags: Empty,
    shapes: Vec<Shape<'a>>,
    image_path: String,
    image_data: (),
    image_height: u32,
    image_width: u32,
}

#[derive(Serialize)]
struct Shape<'a> {
    label: &'a str,
    /// Pixels, x and y; the centre of the top left pixel is at (0.5, 0.5).
    points: Vec<[f32; 2]>,
    group_id: Option<u16>,
    description: &'static str,
    shape_type: &'static str,
    flags: Empty,
    mask: (),
}

/// `{}`.
#[derive(Serialize)]
struct Empty {}

impl Layout for Labelme {
    type Entry = ();
    const FOLDERS: &'static [&'static str] = &[FOLDER];

    fn check(&self, classes: &[Class]) -> Result<(), Refusal> {
        match classes.iter().find(|class| class.name == BACKGROUND) {
            Some(_) => {
                Err(format!("\"{BACKGROUND}\" is void for labelme and cannot be a class; rename it").into())
            }
            None => Ok(()),
        }
    }

    fn frame(&self, frame: &Labelled<'_>) -> Result<(Vec<OutputFile>, ()), Refusal> {
        let [image_width, image_height] = frame.size;
        let original = original(frame.frame, FOLDER)?;
        let file = LabelFile {
            version: VERSION,
            flags: Empty {},
            shapes: shapes(frame)?,
            image_path: original.name(),
            image_data: (),
            image_height,
            image_width,
        };
        let path = format!("{FOLDER}/{}.json", frame.stem());
        Ok((vec![dense_json_file(path, &file)?, original], ()))
    }
}

fn shapes<'a>(frame: &Labelled<'a>) -> Result<Vec<Shape<'a>>, Refusal> {
    let shape = |polygon: Polygon| Shape {
        label: match polygon.segment {
            Some(segment) => &frame.classes[usize::from(segment.class) - 1].name,
            None => BACKGROUND,
        },
        points: polygon.points,
        group_id: polygon.segment.and_then(|segment| segment.thing(frame.classes)),
        description: "",
        shape_type: "polygon",
        flags: Empty {},
        mask: (),
    };
    Ok(polygons(frame)?.into_iter().map(shape).collect())
}
