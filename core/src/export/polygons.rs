//! Polygons around the regions of label maps.

use super::Refusal;
use super::components::{Component, Neighbours, components};
use super::layout::{Labelled, Segment};
use crate::guide::outline;
use crate::labels::{Pixel, Run};

/// The outer border of a region whose pixels hang together by their sides.
pub(super) struct Polygon {
    /// What the region is part of; `None` for void inside a region.
    pub(super) segment: Option<Segment>,
    /// The centres of its outermost pixels, x and y, at least three; the centre of the top left pixel is at (0.5, 0.5).
    pub(super) points: Vec<[f32; 2]>,
}

/// The polygons of a frame in the order of their topmost pixels, so that what lies inside a region comes after it: painted in
/// this order, later ones over earlier ones, they are the label map. Void that no region encloses has none.
///
/// # Errors
/// A class that is not listed.
pub(super) fn polygons(frame: &Labelled<'_>) -> Result<Vec<Polygon>, Refusal> {
    let (segments, places) = frame.segments()?;
    let [width, height] = frame.size;
    let components = components(&places, width, Neighbours::Sides);
    let mut component_of = vec![0_u32; places.len()];
    for (number, component) in (0..).zip(&components) {
        for run in &component.runs {
            component_of[run.indices(width)].fill(number);
        }
    }
    let polygon = |(number, component): (u32, &Component)| {
        let place = usize::from(component.label).checked_sub(1);
        // Nothing can enclose what reaches the border.
        if place.is_none() && at_border(&component.runs, frame.size) {
            return None;
        }
        let first = component.runs.first()?;
        let inside = |x, y| component_of[y as usize * width as usize + x as usize] == number;
        let border = through_centres(&outline::trace(width, height, [first.first, first.row], inside));
        Some(Polygon {
            segment: place.map(|place| segments[place]),
            points: points(&border),
        })
    };
    Ok((0..).zip(&components).filter_map(polygon).collect())
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

/// A polygon of at least three points, which readers ask for, that paints what one through the centres of these pixels
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
    use super::*;

    #[test]
    fn a_square_has_four_corners_and_a_pixel_one() {
        let square = through_centres(&[[1.0, 1.0], [4.0, 1.0], [4.0, 4.0], [1.0, 4.0]]);
        assert_eq!(square.len(), 4);
        assert!(square.contains(&[1, 1]) && square.contains(&[3, 3]));
        let pixel = [[2.0, 2.0], [3.0, 2.0], [3.0, 3.0], [2.0, 3.0]];
        assert_eq!(through_centres(&pixel), [[2, 2]]);
    }
}
