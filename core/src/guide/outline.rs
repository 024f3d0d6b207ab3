//! Outlines of pixel regions.

use crate::labels::Pixel;

/// Outer border of the connected region around `start`, a closed polygon through pixel corners, with
/// the corners of straight runs left out. `start` must be inside.
pub fn trace(width: u32, height: u32, start: Pixel, inside: impl Fn(u32, u32) -> bool) -> Vec<[f32; 2]> {
    let (width, height) = (i64::from(width), i64::from(height));
    let filled = |x: i64, y: i64| x >= 0 && y >= 0 && x < width && y < height && inside(x as u32, y as u32);
    let [mut x, y] = start.map(i64::from);
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
            corners.push([x as f32, y as f32]);
        }
        (dx, dy) = turned;
        if ((x, y), (dx, dy)) == first {
            break;
        }
    }
    corners
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rectangle_has_its_four_corners() {
        let outline = trace(10, 10, [4, 4], |x, y| (2..6).contains(&x) && (3..7).contains(&y));
        let mut sorted = outline.clone();
        sorted.sort_by(|a, b| a.partial_cmp(b).unwrap());
        assert_eq!(sorted, [[2.0, 3.0], [2.0, 7.0], [6.0, 3.0], [6.0, 7.0]]);
    }

    #[test]
    fn one_pixel_and_the_whole_image_are_regions_too() {
        assert_eq!(trace(5, 5, [0, 0], |x, y| (x, y) == (0, 0)).len(), 4);
        assert_eq!(trace(5, 5, [2, 2], |_, _| true).len(), 4);
    }

    #[test]
    fn an_l_shape_has_six_corners() {
        let inside = |x: u32, y: u32| (x == 1 && (1..5).contains(&y)) || (y == 4 && (1..4).contains(&x));
        assert_eq!(trace(6, 6, [3, 4], inside).len(), 6);
    }
}
