//! Strokes to pixels, and the eraser.

use std::collections::BTreeMap;

use super::{ClassId, LabelSet, Pixel, Stroke, StrokeId};

/// Row-major indices of the pixels that a stroke covers in an image of this size, ascending.
///
/// A pixel is covered when its centre is within `radius` of the polyline, or is one of the line's own
/// pixels.
pub fn pixels_of(stroke: &Stroke, width: u32, height: u32) -> Vec<u32> {
    let mut pixels = Vec::new();
    for line in &stroke.lines {
        match line.as_slice() {
            [] => {}
            [point] => stamp(*point, stroke.radius, width, height, &mut pixels),
            points => {
                for pair in points.windows(2) {
                    for point in segment(pair[0], pair[1]) {
                        stamp(point, stroke.radius, width, height, &mut pixels);
                    }
                }
            }
        }
    }
    pixels.sort_unstable();
    pixels.dedup();
    pixels
}

/// The labelled pixels of a frame: row-major index to class (void included), later strokes over earlier ones.
pub fn rasterise(
    labels: &LabelSet,
    frame: usize,
    width: u32,
    height: u32,
) -> BTreeMap<u32, (ClassId, StrokeId)> {
    let mut map = BTreeMap::new();
    for (id, stroke) in labels.strokes_of(frame) {
        for pixel in pixels_of(stroke, width, height) {
            map.insert(pixel, (stroke.class, id));
        }
    }
    map
}

/// What remains of a stroke after an eraser of `radius` pixels passed along `path`.
///
/// `None` when nothing changes; a stroke without lines when all of it is erased.
pub fn erase(stroke: &Stroke, path: &[Pixel], radius: u32) -> Option<Stroke> {
    let reach = i64::from(radius) + i64::from(stroke.radius);
    let eraser: Vec<Pixel> = match path {
        [point] => vec![*point],
        points => points
            .windows(2)
            .flat_map(|pair| segment(pair[0], pair[1]))
            .collect(),
    };
    let erased = |point: &Pixel| {
        eraser.iter().any(|centre| {
            let dx = i64::from(centre[0]) - i64::from(point[0]);
            let dy = i64::from(centre[1]) - i64::from(point[1]);
            dx * dx + dy * dy <= reach * reach
        })
    };
    let mut changed = false;
    let mut lines = Vec::new();
    for line in &stroke.lines {
        let dense: Vec<Pixel> = match line.as_slice() {
            [point] => vec![*point],
            points => points
                .windows(2)
                .flat_map(|pair| segment(pair[0], pair[1]))
                .collect(),
        };
        if !dense.iter().any(erased) {
            lines.push(line.clone());
            continue;
        }
        changed = true;
        lines.extend(
            dense
                .split(erased)
                .filter(|piece| !piece.is_empty())
                .map(simplified),
        );
    }
    changed.then(|| Stroke {
        lines,
        ..stroke.clone()
    })
}

/// Pixels within `radius` of `centre`, inside the image.
fn stamp(centre: Pixel, radius: u32, width: u32, height: u32, pixels: &mut Vec<u32>) {
    let radius = i64::from(radius);
    let [x, y] = centre.map(i64::from);
    for row in (y - radius).max(0)..=(y + radius).min(i64::from(height) - 1) {
        for column in (x - radius).max(0)..=(x + radius).min(i64::from(width) - 1) {
            if (column - x).pow(2) + (row - y).pow(2) <= radius * radius {
                pixels.push((row * i64::from(width) + column) as u32);
            }
        }
    }
}

/// The pixels of a straight line, both ends included (Bresenham).
fn segment(from: Pixel, to: Pixel) -> Vec<Pixel> {
    let [mut x, mut y] = from.map(i64::from);
    let [x1, y1] = to.map(i64::from);
    let (dx, dy) = ((x1 - x).abs(), -(y1 - y).abs());
    let (step_x, step_y) = ((x1 - x).signum(), (y1 - y).signum());
    let mut error = dx + dy;
    let mut pixels = vec![from];
    while (x, y) != (x1, y1) {
        let doubled = 2 * error;
        if doubled >= dy {
            error += dy;
            x += step_x;
        }
        if doubled <= dx {
            error += dx;
            y += step_y;
        }
        pixels.push([x as u32, y as u32]);
    }
    pixels
}

/// The polyline of the pixels that a polyline's pixels become; those that become none are left out.
pub(super) fn redrawn(line: &[Pixel], place: impl Fn(Pixel) -> Option<Pixel>) -> Vec<Pixel> {
    let dense = match line {
        [point] => vec![*point],
        points => points
            .windows(2)
            .flat_map(|pair| segment(pair[0], pair[1]))
            .collect(),
    };
    let mut placed: Vec<Pixel> = dense.into_iter().filter_map(place).collect();
    placed.dedup();
    simplified(&placed)
}

/// Drops the inner points of straight runs of neighbouring pixels; covers the same pixels.
fn simplified(points: &[Pixel]) -> Vec<Pixel> {
    let direction = |a: Pixel, b: Pixel| {
        (
            i64::from(b[0]) - i64::from(a[0]),
            i64::from(b[1]) - i64::from(a[1]),
        )
    };
    let mut kept = Vec::new();
    for (index, &point) in points.iter().enumerate() {
        let inner = index > 0
            && index + 1 < points.len()
            && direction(points[index - 1], point) == direction(point, points[index + 1]);
        if !inner {
            kept.push(point);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    fn line(radius: u32, points: &[Pixel]) -> Stroke {
        Stroke {
            frame: 0,
            class: 1,
            radius,
            lines: vec![points.to_vec()],
        }
    }

    #[test]
    fn a_click_of_radius_zero_is_one_pixel() {
        assert_eq!(pixels_of(&Stroke::click(0, 1, [3, 2]), 10, 5), [23]);
    }

    #[test]
    fn a_brush_is_a_disc_and_is_cut_at_the_image_border() {
        assert_eq!(pixels_of(&line(1, &[[0, 0]]), 10, 5), [0, 1, 10]);
        assert_eq!(pixels_of(&line(2, &[[5, 2]]), 10, 5).len(), 13);
    }

    #[test]
    fn a_polyline_has_no_gaps() {
        let pixels = pixels_of(&line(0, &[[0, 0], [9, 4]]), 10, 5);
        assert_eq!(pixels.len(), 10);
        assert!(pixels.contains(&0) && pixels.contains(&49));
    }

    #[test]
    fn later_strokes_cover_earlier_ones() {
        let mut labels = LabelSet::default();
        labels.strokes.insert(StrokeId(1), Arc::new(line(1, &[[5, 2]])));
        let later = Stroke {
            class: 7,
            ..line(0, &[[5, 2]])
        };
        labels.strokes.insert(StrokeId(2), Arc::new(later));
        let map = rasterise(&labels, 0, 10, 5);
        assert_eq!(map[&25], (7, StrokeId(2)));
        assert_eq!(map[&24], (1, StrokeId(1)));
    }

    #[test]
    fn erasing_the_middle_of_a_scribble_leaves_its_two_ends() {
        let rest = erase(&line(0, &[[0, 2], [20, 2]]), &[[10, 2]], 3).unwrap();
        assert_eq!(rest.lines, [vec![[0, 2], [6, 2]], vec![[14, 2], [20, 2]]]);
    }

    #[test]
    fn erasing_elsewhere_changes_nothing_and_erasing_all_leaves_nothing() {
        let stroke = line(1, &[[3, 3]]);
        assert_eq!(erase(&stroke, &[[9, 9]], 2), None);
        assert!(erase(&stroke, &[[4, 3]], 0).unwrap().lines.is_empty());
    }
}
