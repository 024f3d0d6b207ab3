//! What is shown of a suggested place: its region on the frame, with some room around it.

use egui::{Rect, Vec2, pos2, vec2};
use inplace_core::labels::Pixel;

/// The smallest part of an image that is shown of a place, along each axis.
const SMALLEST_PART: f32 = 1.0 / 3.0;
/// Room around a region, relative to its reach from the place.
const ROOM: f32 = 1.15;

/// The part of an image, in pixels, that shows a place: as much of its region, which `outline` surrounds, as possible
/// around the place, not less than a third of the image along each axis, with the image's aspect. `size` is that of the
/// image in pixels.
pub fn surroundings(size: Vec2, [x, y]: Pixel, outline: &[[f32; 2]]) -> Rect {
    let center = pos2(x as f32 + 0.5, y as f32 + 0.5);
    let reach = outline.iter().fold(0.0_f32, |reach, &[x, y]| {
        let away = (pos2(x, y) - center).abs() / size.max(Vec2::splat(1.0));
        reach.max(away.max_elem())
    });
    let half = size * (ROOM * reach).clamp(0.5 * SMALLEST_PART, 0.5);
    let center = center.clamp(half.to_pos2(), (size - half).max(half).to_pos2());
    Rect::from_center_size(center, 2.0 * vec2(half.x, half.y))
}

/// Where a horizontal line meets the border of a closed polygon, along x.
pub fn crossings(polygon: &[[f32; 2]], y: f32) -> Vec<f32> {
    let next = polygon.iter().cycle().skip(1);
    let edges = polygon.iter().zip(next);
    edges
        .filter(|(a, b)| (a[1] <= y) != (b[1] <= y))
        .map(|(a, b)| a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_shown_of_a_place_holds_its_region_and_no_less_than_a_third() {
        let size = vec2(300.0, 240.0);
        let small = surroundings(size, [10, 10], &[]);
        assert_eq!(small, Rect::from_min_max(pos2(0.0, 0.0), pos2(100.0, 80.0)));
        let outline = [[80.0, 100.0], [200.0, 100.0], [150.0, 170.0]];
        let region = surroundings(size, [150, 120], &outline);
        for [x, y] in outline {
            assert!(region.contains(pos2(x, y)));
        }
        assert!(region.contains(pos2(150.5, 120.5)) && region.width() < 200.0);
        let outline = [[0.0, 0.0], [300.0, 240.0]];
        let whole = Rect::from_min_size(pos2(0.0, 0.0), size);
        assert_eq!(surroundings(size, [150, 120], &outline), whole);
    }
}
