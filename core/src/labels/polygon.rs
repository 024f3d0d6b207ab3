//! Filled polygons to pixels.

use super::Pixel;
use super::raster::along;
use super::runs::{Coverage, Run};

/// The pixels inside a polygon whose corners are the centres of these pixels; the last corner is joined to the
/// first.
///
/// A pixel is inside when its centre is, by the even-odd rule, or when its centre is on the outline itself: every
/// corner counts, and of the pixels that an edge only grazes none. A polygon without area (fewer than three corners,
/// or all of them on one line) has the pixels of its outline.
pub fn polygon_runs(corners: &[Pixel]) -> Vec<Run> {
    let rows = corners.iter().map(|corner| corner[1]);
    let (Some(top), Some(bottom)) = (rows.clone().min(), rows.max()) else {
        return Vec::new();
    };
    let mut coverage = Coverage::new(top, bottom);
    if on_one_line(corners) {
        for [x, y] in along(corners) {
            coverage.add(y, x, x);
        }
        return coverage.finish();
    }
    // Where the outline crosses the row's centres: the columns below and above, which are one where it meets a centre.
    let mut crossings: Vec<Vec<[i64; 2]>> = vec![Vec::new(); (bottom - top) as usize + 1];
    for (index, &from) in corners.iter().enumerate() {
        let to = corners[(index + 1) % corners.len()];
        coverage.add(from[1], from[0], from[0]);
        if from[1] == to[1] {
            coverage.add(from[1], from[0].min(to[0]), from[0].max(to[0]));
            continue;
        }
        let (upper, lower) = if from[1] < to[1] { (from, to) } else { (to, from) };
        let [x, y] = upper.map(i128::from);
        let (width, height) = (i128::from(lower[0]) - x, i128::from(lower[1]) - y);
        // Each edge has its upper end and not its lower one, so that a corner is crossed once or twice as it should.
        for row in upper[1]..lower[1] {
            let along = (i128::from(row) - y) * width;
            let below = x + along.div_euclid(height);
            let above = below + i128::from(along.rem_euclid(height) != 0);
            crossings[(row - top) as usize].push([below as i64, above as i64]);
        }
    }
    for (row, mut crossed) in (top..).zip(crossings) {
        // Between two columns the order of crossings does not matter: both ways the same centres are inside.
        crossed.sort_unstable();
        for pair in crossed.chunks_exact(2) {
            let (first, last) = (pair[0][1], pair[1][0]);
            if first <= last {
                coverage.add(row, first as u32, last as u32);
            }
        }
    }
    coverage.finish()
}

fn on_one_line(corners: &[Pixel]) -> bool {
    let Some((&[x, y], rest)) = corners.split_first() else {
        return true;
    };
    let away = |&[to_x, to_y]: &Pixel| [i128::from(to_x) - i128::from(x), i128::from(to_y) - i128::from(y)];
    let Some([dx, dy]) = rest.iter().map(away).find(|offset| *offset != [0, 0]) else {
        return true;
    };
    rest.iter().map(away).all(|[x, y]| x * dy == y * dx)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::{Stroke, pixels_of};

    /// The pixels as rows of a picture.
    fn drawn(corners: &[Pixel], width: u32, height: u32) -> Vec<String> {
        let pixels = pixels_of(&Stroke::polygon(0, 1, corners), width, height);
        let mark = |index| if pixels.contains(&index) { '#' } else { '.' };
        (0..height)
            .map(|row| (0..width).map(|column| mark(row * width + column)).collect())
            .collect()
    }

    /// Even-odd or on the outline, pixel by pixel.
    fn inside(corners: &[Pixel], [x, y]: [i64; 2]) -> bool {
        let mut odd = false;
        for (index, from) in corners.iter().enumerate() {
            let [ax, ay] = from.map(i64::from);
            let [bx, by] = corners[(index + 1) % corners.len()].map(i64::from);
            let cross = (bx - ax) * (y - ay) - (by - ay) * (x - ax);
            let within = x >= ax.min(bx) && x <= ax.max(bx) && y >= ay.min(by) && y <= ay.max(by);
            if cross == 0 && within {
                return true;
            }
            if (ay <= y) != (by <= y) && (cross > 0) == (by > ay) {
                odd = !odd;
            }
        }
        odd
    }

    #[test]
    fn every_pixel_is_as_its_centre() {
        // A fixed sequence of corners, crossing and repeating themselves as they like.
        let mut state = 7_u32;
        let mut next = |below: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 16) % below
        };
        for corners in 3..40 {
            let polygon: Vec<Pixel> = (0..corners).map(|_| [next(23), next(19)]).collect();
            let pixels = pixels_of(&Stroke::polygon(0, 1, &polygon), 23, 19);
            for index in 0..23 * 19 {
                let centre = [i64::from(index % 23), i64::from(index / 23)];
                let expected = inside(&polygon, centre);
                assert_eq!(pixels.contains(&index), expected, "{centre:?} of {polygon:?}");
            }
        }
    }

    #[test]
    fn a_polygon_without_area_labels_its_outline() {
        assert_eq!(polygon_runs(&[]), []);
        assert_eq!(drawn(&[[2, 1]], 4, 3), ["....", "..#.", "...."]);
        assert_eq!(drawn(&[[0, 0], [3, 2]], 4, 3), ["#...", ".##.", "...#"]);
        assert_eq!(drawn(&[[0, 0], [2, 2], [1, 1]], 4, 3), ["#...", ".#..", "..#."]);
        assert_eq!(drawn(&[[3, 1], [0, 1], [3, 1]], 4, 3), ["....", "####", "...."]);
    }
}
