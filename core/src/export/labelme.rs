//! Polygons for labelme.

use serde::Serialize;

use super::Refusal;
use super::components::{Component, Neighbours, components};
use super::layout::{Labelled, Layout, OutputFile, dense_json_file};
use super::original::original;
use crate::guide::outline;
use crate::labels::{Class, Pixel, Run};

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

    fn folders(&self) -> &'static [&'static str] {
        &[FOLDER]
    }

    fn check(&self, classes: &[Class]) -> Result<(), Refusal> {
        match classes.iter().find(|class| class.name == BACKGROUND) {
            Some(_) => Err(Refusal::Format(format!(
                "\"{BACKGROUND}\" is void for labelme and cannot be a class; rename it"
            ))),
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
    let (segments, places) = frame.segments()?;
    let [width, height] = frame.size;
    let components = components(&places, width, Neighbours::Sides);
    let mut component_of = vec![0_u32; places.len()];
    for (number, component) in (0..).zip(&components) {
        for run in &component.runs {
            component_of[run.indices(width)].fill(number);
        }
    }
    let shape = |(number, component): (u32, &Component)| {
        let segment = usize::from(component.label)
            .checked_sub(1)
            .map(|place| segments[place]);
        let label = match segment {
            Some(segment) => frame.classes[usize::from(segment.class) - 1].name.as_str(),
            // Nothing can enclose what reaches the border.
            None if at_border(&component.runs, frame.size) => return None,
            None => BACKGROUND,
        };
        let first = component.runs.first()?;
        let inside = |x, y| component_of[y as usize * width as usize + x as usize] == number;
        let border = through_centres(&outline::trace(width, height, [first.first, first.row], inside));
        Some(Shape {
            label,
            points: points(&border),
            group_id: segment.and_then(|segment| segment.thing(frame.classes)),
            description: "",
            shape_type: "polygon",
            flags: Empty {},
            mask: (),
        })
    };
    Ok((0..).zip(&components).filter_map(shape).collect())
}

fn at_border(runs: &[Run], [width, height]: [u32; 2]) -> bool {
    let at_border =
        |run: &Run| [run.row, run.first].contains(&0) || run.row + 1 == height || run.last + 1 == width;
    runs.iter().any(at_border)
}

/// The pixels along the inner side of a border that goes through pixel corners, the region on its right: a closed polygon
/// through their centres, without those on a straight way between two others.
fn through_centres(corners: &[[f32; 2]]) -> Vec<Pixel> {
    let corner = |index: usize| corners[index % corners.len()].map(|v| v as i64);
    let mut pixels: Vec<[i64; 2]> = Vec::with_capacity(corners.len());
    for index in 0..corners.len() {
        let (before, at, after) = (corner(index), corner(index + 1), corner(index + 2));
        let (to, from) = (direction(before, at), direction(at, after));
        let ahead = right_of(at, to);
        // Two pixels where it turns left, one where it turns right.
        pixels.extend([[ahead[0] - to[0], ahead[1] - to[1]], right_of(at, from)]);
    }
    pixels.dedup();
    while pixels.len() > 1 && pixels.first() == pixels.last() {
        pixels.pop();
    }
    let is_corner = |&index: &usize| {
        let at = |index: usize| pixels[index % pixels.len()];
        let before = direction(at(index + pixels.len() - 1), at(index));
        before != direction(at(index), at(index + 1)) || pixels.len() < 3
    };
    let corners = (0..pixels.len()).filter(is_corner);
    corners.map(|index| pixels[index].map(|v| v as u32)).collect()
}

/// One step of a way along an axis or a diagonal.
fn direction(from: [i64; 2], to: [i64; 2]) -> [i64; 2] {
    [(to[0] - from[0]).signum(), (to[1] - from[1]).signum()]
}

/// The pixel on the right of the edge that leaves a pixel corner in a direction, y down.
fn right_of([x, y]: [i64; 2], direction: [i64; 2]) -> [i64; 2] {
    match direction {
        [0, -1] => [x, y - 1],
        [1, 0] => [x, y],
        [0, 1] => [x - 1, y],
        _ => [x - 1, y - 1],
    }
}

/// A polygon of at least three points, which labelme asks for, that paints what one through the centres of these pixels
/// does.
fn points(pixels: &[Pixel]) -> Vec<[f32; 2]> {
    let point = |[x, y]: Pixel, right: f32, down: f32| [x as f32 + right, y as f32 + down];
    match *pixels {
        [only] => vec![
            point(only, 0.25, 0.25),
            point(only, 0.75, 0.25),
            point(only, 0.5, 0.75),
        ],
        [from, to] => [from, to, to].map(|pixel| point(pixel, 0.5, 0.5)).to_vec(),
        _ => pixels.iter().map(|&pixel| point(pixel, 0.5, 0.5)).collect(),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;
    use crate::export::testing::{self, SIZE, WIDTH};
    use crate::labels::{ClassId, VOID, polygon_runs};

    /// The label map that shapes paint one after the other, by the pixels that their points are in.
    fn painted(shapes: &[Value]) -> Vec<ClassId> {
        let mut labels = vec![VOID; testing::labels(0).len()];
        for shape in shapes {
            let name = shape["label"].as_str().unwrap();
            let class = testing::classes().into_iter().find(|class| class.name == name);
            assert_eq!(class.is_none(), name == BACKGROUND);
            let id = class.map_or(VOID, |class| class.id);
            let points = shape["points"].as_array().unwrap();
            assert!(points.len() > 2 && shape["shape_type"] == "polygon");
            let pixels: Vec<Pixel> = points
                .iter()
                .map(|point| [0, 1].map(|axis| point[axis].as_f64().unwrap() as u32))
                .collect();
            for run in polygon_runs(&pixels) {
                labels[run.indices(WIDTH)].fill(id);
            }
        }
        labels
    }

    #[test]
    fn shapes_painted_in_order_are_the_label_map() {
        let scene = testing::scene();
        let classes = testing::classes();
        for number in 0..40 {
            let frame = testing::labelled(&scene, SIZE, &classes, testing::labels(number));
            let shapes = serde_json::to_value(shapes(&frame).unwrap()).unwrap();
            assert_eq!(painted(shapes.as_array().unwrap()), frame.labels, "map {number}");
        }
    }

    #[test]
    fn a_square_has_four_corners_and_a_pixel_one() {
        let square = through_centres(&[[1.0, 1.0], [4.0, 1.0], [4.0, 4.0], [1.0, 4.0]]);
        assert_eq!(square.len(), 4);
        assert!(square.contains(&[1, 1]) && square.contains(&[3, 3]));
        let pixel = [[2.0, 2.0], [3.0, 2.0], [3.0, 3.0], [2.0, 3.0]];
        assert_eq!(through_centres(&pixel), [[2, 2]]);
    }
}
