//! Which part of the image the canvas shows.

use glam::{Vec2, vec2};
use inplace_core::labels::Pixel;

/// The smallest part of an image that is shown of a place, along each axis.
const SMALLEST_PART: f32 = 1.0 / 3.0;
/// Room around a region, relative to its reach from the place.
const ROOM: f32 = 1.15;

/// A rectangle of an image, in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImagePart {
    /// Its top left corner.
    pub min: Vec2,
    /// Its bottom right corner.
    pub max: Vec2,
}

impl ImagePart {
    /// The part that shows a place: as much of its region, which `outline` surrounds, as possible around the place, not
    /// less than a third of the image along each axis, with the image's aspect. `size` is that of the image in pixels.
    pub fn around(size: Vec2, [x, y]: Pixel, outline: &[[f32; 2]]) -> Self {
        let center = vec2(x as f32 + 0.5, y as f32 + 0.5);
        let reach = outline.iter().fold(0.0_f32, |reach, &[x, y]| {
            let away = (vec2(x, y) - center).abs() / size.max(Vec2::ONE);
            reach.max(away.max_element())
        });
        let half = size * (ROOM * reach).clamp(0.5 * SMALLEST_PART, 0.5);
        let center = center.clamp(half, (size - half).max(half));
        Self {
            min: center - half,
            max: center + half,
        }
    }

    /// Width and height.
    pub fn size(&self) -> Vec2 {
        self.max - self.min
    }
}

/// Zoom and pan of the canvas.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum View {
    /// The whole image, fitted into whatever space there is.
    #[default]
    Whole,
    /// A part of the image, fitted into whatever space there is; the image around it fills the rest.
    Part(ImagePart),
    /// As the person has zoomed and panned.
    Free {
        /// Points of the screen for each pixel of the image.
        zoom: f32,
        /// The image position in the middle of the canvas, in pixels.
        center: Vec2,
    },
}

impl View {
    /// Brings a pixel into the middle when zoomed in; a fitted image already shows it.
    pub fn center_on(&mut self, [x, y]: Pixel) {
        let position = vec2(x as f32 + 0.5, y as f32 + 0.5);
        match self {
            Self::Whole => {}
            Self::Part(part) => {
                let half = 0.5 * part.size();
                (part.min, part.max) = (position - half, position + half);
            }
            Self::Free { center, .. } => *center = position,
        }
    }
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
        let part = |[left, top]: [f32; 2], [right, bottom]: [f32; 2]| ImagePart {
            min: vec2(left, top),
            max: vec2(right, bottom),
        };
        let small = ImagePart::around(size, [10, 10], &[]);
        assert!((small.min - Vec2::ZERO).length() < 1e-3 && (small.max - vec2(100.0, 80.0)).length() < 1e-3);
        let outline = [[80.0, 100.0], [200.0, 100.0], [150.0, 170.0]];
        let region = ImagePart::around(size, [150, 120], &outline);
        for [x, y] in outline {
            let corner = vec2(x, y);
            assert!(region.min.cmple(corner).all() && region.max.cmpge(corner).all());
        }
        assert!(region.size().x < 200.0);
        let outline = [[0.0, 0.0], [300.0, 240.0]];
        let whole = part([0.0, 0.0], [300.0, 240.0]);
        assert_eq!(ImagePart::around(size, [150, 120], &outline), whole);
    }
}
