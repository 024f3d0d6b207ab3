//! Outlines of pixel regions.

use crate::labels::Pixel;

/// Outer border of the connected region around `start`, a closed polygon through pixel corners, with
/// the corners of straight runs left out. `start` must be inside.
pub fn trace(width: u32, height: u32, start: Pixel, inside: impl Fn(u32, u32) -> bool) -> Vec<[f32; 2]> {
    let (width, height) = (i64::from(width), i64::from(height));
    let filled = |x: i64, y: i64| x >= 0 && y >= 0 && x < width && y < height && inside(x as u32, y as u32);
    let mut from = start.map(i64::from);
    loop {
        let corners = border_left_of(from, [width, height], &filled);
        match left_of_hole(&corners) {
            // The region goes on to the left of a hole in it.
            Some(beyond) => from = beyond,
            None => return corners.into_iter().map(|[x, y]| [x as f32, y as f32]).collect(),
        }
    }
}

/// The border, outer or of a hole, that is met to the left of a pixel of a region.
fn border_left_of(
    [mut x, y]: [i64; 2],
    [width, height]: [i64; 2],
    filled: &impl Fn(i64, i64) -> bool,
) -> Vec<[i64; 2]> {
    while filled(x - 1, y) {
        x -= 1;
    }
    // Walk along pixel edges with the region on the right: up its left side first.
    let first = ((x, y + 1), (0, -1));
    let ((mut x, mut y), (mut dx, mut dy)) = first;
    let mut corners = Vec::new();
    let limit = 4 * (width * height) as usize;
    for _ in 0..limit {
        (x, y) = (x + dx, y + dy);
        // The pixels ahead on the right and on the left of the corner.
        let (right, left) = match (dx, dy) {
            (0, -1) => ((x, y - 1), (x - 1, y - 1)),
            (1, 0) => ((x, y), (x, y - 1)),
            (0, 1) => ((x - 1, y), (x, y)),
            _ => ((x - 1, y - 1), (x - 1, y)),
        };
        let turned = if !filled(right.0, right.1) {
            (-dy, dx)
        } else if filled(left.0, left.1) {
            (dy, -dx)
        } else {
            (dx, dy)
        };
        if turned != (dx, dy) {
            corners.push([x, y]);
        }
        (dx, dy) = turned;
        if ((x, y), (dx, dy)) == first {
            break;
        }
    }
    corners
}

/// The pixel of the region beside the leftmost side of a hole; `None` for an outer border, which goes around the other
/// way.
fn left_of_hole(corners: &[[i64; 2]]) -> Option<[i64; 2]> {
    let sides = || corners.iter().zip(corners.iter().cycle().skip(1));
    let twice_area: i64 = sides().map(|([ax, ay], [bx, by])| ax * by - bx * ay).sum();
    if twice_area >= 0 {
        return None;
    }
    let upright = sides().filter(|(a, b)| a[0] == b[0]);
    let (a, b) = upright.min_by_key(|(a, _)| a[0])?;
    Some([a[0] - 1, a[1].min(b[1])])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn straight_runs_have_no_corners() {
        let rectangle = |x: u32, y: u32| (2..6).contains(&x) && (3..7).contains(&y);
        let mut outline = trace(10, 10, [4, 4], rectangle);
        outline.sort_by(|a, b| a.partial_cmp(b).unwrap());
        assert_eq!(outline, [[2.0, 3.0], [2.0, 7.0], [6.0, 3.0], [6.0, 7.0]]);
        assert_eq!(trace(5, 5, [0, 0], |x, y| (x, y) == (0, 0)).len(), 4, "one pixel");
        assert_eq!(trace(5, 5, [2, 2], |_, _| true).len(), 4, "the whole image");
        let l_shape = |x: u32, y: u32| (x == 1 && (1..5).contains(&y)) || (y == 4 && (1..4).contains(&x));
        assert_eq!(trace(6, 6, [3, 4], l_shape).len(), 6);
    }

    #[test]
    fn the_outline_of_a_region_with_holes_is_its_outer_border() {
        let hole = |x: u32, y: u32| {
            ((5..7).contains(&x) && (2..9).contains(&y)) || ((10..13).contains(&x) && (3..6).contains(&y))
        };
        let inside = |x: u32, y: u32| (1..19).contains(&x) && (1..11).contains(&y) && !hole(x, y);
        let border = [[1.0, 1.0], [1.0, 11.0], [19.0, 1.0], [19.0, 11.0]];
        for start in [[2, 4], [8, 4], [15, 4], [14, 10]] {
            let mut outline = trace(20, 12, start, inside);
            outline.sort_by(|a, b| a.partial_cmp(b).unwrap());
            assert_eq!(outline, border, "from {start:?}");
        }
    }
}
