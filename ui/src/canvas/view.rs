//! Where the image lies in the canvas: zoom, pan, and the way between screen and image.

use egui::{Pos2, Rect, Vec2, pos2, vec2};
use inplace_core::labels::Pixel;
use inplace_model::view::{ImagePart, View};

/// Points on screen per image pixel at the closest zoom.
const CLOSEST_ZOOM: f32 = 48.0;
/// The farthest zoom, relative to the zoom that fits.
const FARTHEST_OF_FIT: f32 = 0.5;
/// Points kept free around a fitted image.
const FIT_MARGIN: f32 = 16.0;

/// The middle nearest to this one for which the image fills as much as it can of what is visible, in pixels.
fn filling(center: Pos2, visible: Vec2, size: Vec2) -> Pos2 {
    let along = |center: f32, visible: f32, size: f32| {
        if visible >= size {
            0.5 * size
        } else {
            center.clamp(0.5 * visible, size - 0.5 * visible)
        }
    };
    pos2(
        along(center.x, visible.x, size.x),
        along(center.y, visible.y, size.y),
    )
}

fn fit_zoom(canvas: Rect, size: Vec2) -> f32 {
    let room = (canvas.size() - Vec2::splat(2.0 * FIT_MARGIN)).max(Vec2::splat(1.0));
    (room / size.max(Vec2::splat(1.0))).min_elem().min(CLOSEST_ZOOM)
}

fn clamp_zoom(zoom: f32, canvas: Rect, size: Vec2) -> f32 {
    let farthest = FARTHEST_OF_FIT * fit_zoom(canvas, size);
    zoom.clamp(farthest, CLOSEST_ZOOM.max(farthest))
}

/// A part of an image, in pixels, as a rectangle.
pub fn rect_of(part: ImagePart) -> Rect {
    Rect::from_min_max(pos2(part.min.x, part.min.y), pos2(part.max.x, part.max.y))
}

/// The view that is zoomed by `factor` so that the image position under `cursor` stays under it.
pub fn zoomed_at(view: View, canvas: Rect, size: Vec2, cursor: Pos2, factor: f32) -> View {
    let placement = Placement::new(view, canvas, size);
    let fixed = placement.to_image(cursor);
    let zoom = clamp_zoom(placement.zoom * factor, canvas, size);
    free(zoom, fixed + (canvas.center() - cursor) / zoom, size)
}

/// The view whose image is moved by `delta` points.
pub fn panned(view: View, canvas: Rect, size: Vec2, delta: Vec2) -> View {
    let placement = Placement::new(view, canvas, size);
    let center = placement.to_image(canvas.center() - delta);
    free(placement.zoom, center, size)
}

/// The middle of the canvas always shows a part of the image.
fn free(zoom: f32, center: Pos2, size: Vec2) -> View {
    let center = center.clamp(Pos2::ZERO, size.to_pos2());
    View::Free {
        zoom,
        center: glam::vec2(center.x, center.y),
    }
}

/// An image's place on screen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Screen position of the image's top left corner, in points.
    pub origin: Pos2,
    /// Points per image pixel.
    pub zoom: f32,
    /// Image size in pixels.
    pub size: Vec2,
}

impl Placement {
    /// Where an image of this size lies in the canvas.
    pub fn new(view: View, canvas: Rect, size: Vec2) -> Self {
        let (zoom, center) = match view {
            View::Whole => (fit_zoom(canvas, size), (0.5 * size).to_pos2()),
            View::Part(part) => {
                let part = rect_of(part);
                let zoom = fit_zoom(canvas, part.size());
                (zoom, filling(part.center(), canvas.size() / zoom, size))
            }
            View::Free { zoom, center } => {
                // The frame before may have been larger.
                let center = pos2(center.x, center.y).clamp(Pos2::ZERO, size.to_pos2());
                (clamp_zoom(zoom, canvas, size), center)
            }
        };
        let origin = canvas.center() - zoom * center.to_vec2();
        Self { origin, zoom, size }
    }

    /// The image's rectangle on screen.
    pub fn rect(&self) -> Rect {
        Rect::from_min_size(self.origin, self.zoom * self.size)
    }

    /// Image position (pixels; the centre of pixel 0 is 0.5) of a screen position.
    pub fn to_image(self, screen: Pos2) -> Pos2 {
        ((screen - self.origin) / self.zoom).to_pos2()
    }

    /// Screen position of an image position.
    pub fn to_screen(self, image: Pos2) -> Pos2 {
        self.origin + self.zoom * image.to_vec2()
    }

    /// Screen position of a pixel's centre.
    pub fn pixel_center(&self, [x, y]: Pixel) -> Pos2 {
        self.to_screen(Pos2::new(x as f32 + 0.5, y as f32 + 0.5))
    }

    /// The pixel under a screen position; `None` outside the image.
    pub fn pixel_at(&self, screen: Pos2) -> Option<Pixel> {
        let position = self.to_image(screen);
        let inside =
            position.x >= 0.0 && position.y >= 0.0 && position.x < self.size.x && position.y < self.size.y;
        inside.then_some([position.x as u32, position.y as u32])
    }

    /// The pixel of the image that is nearest to a screen position.
    pub fn nearest_pixel(&self, screen: Pos2) -> Pixel {
        let last = (self.size - vec2(1.0, 1.0)).max(Vec2::ZERO).to_pos2();
        let position = self.to_image(screen).clamp(Pos2::ZERO, self.size.to_pos2());
        [position.x.min(last.x) as u32, position.y.min(last.y) as u32]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: Vec2 = vec2(320.0, 240.0);

    fn canvas() -> Rect {
        Rect::from_min_size(pos2(240.0, 80.0), vec2(800.0, 500.0))
    }

    #[test]
    fn zooming_keeps_what_is_under_the_cursor_and_every_pixel_finds_its_way_back() {
        let mut view = View::Whole;
        let cursor = pos2(400.0, 300.0);
        let under = Placement::new(view, canvas(), SIZE).to_image(cursor);
        for factor in [1.0, 1.7, 3.1, 0.4, 8.0] {
            view = zoomed_at(view, canvas(), SIZE, cursor, factor);
            let placement = Placement::new(view, canvas(), SIZE);
            assert!((placement.to_image(cursor) - under).length() < 1e-3);
            for pixel in [[0, 0], [319, 239], [17, 200], [160, 120]] {
                assert_eq!(placement.pixel_at(placement.pixel_center(pixel)), Some(pixel));
            }
        }
    }

    #[test]
    fn a_rectangle_is_wholly_visible_and_as_large_as_it_can_be() {
        let image_part = ImagePart {
            min: glam::vec2(0.0, 20.0),
            max: glam::vec2(80.0, 80.0),
        };
        let part = rect_of(image_part);
        let placement = Placement::new(View::Part(image_part), canvas(), SIZE);
        let shown = Rect::from_min_max(placement.to_screen(part.min), placement.to_screen(part.max));
        assert!(canvas().expand(1e-3).contains_rect(shown));
        assert!((shown.height() - (canvas().height() - 2.0 * FIT_MARGIN)).abs() < 1e-2);
        // What the rectangle leaves free shows the image, not what lies around it.
        assert!(placement.rect().left() <= canvas().left() + 1e-3);
        let whole = ImagePart {
            min: glam::Vec2::ZERO,
            max: glam::vec2(SIZE.x, SIZE.y),
        };
        assert_eq!(
            Placement::new(View::Part(whole), canvas(), SIZE),
            Placement::new(View::Whole, canvas(), SIZE)
        );
    }

    #[test]
    fn the_image_cannot_be_lost_by_panning() {
        let mut view = View::Whole;
        for _ in 0..50 {
            view = panned(view, canvas(), SIZE, vec2(700.0, -900.0));
        }
        let rect = Placement::new(view, canvas(), SIZE).rect();
        assert!(rect.expand(1.0).contains(canvas().center()));
        // Nor by going on to a smaller one.
        let rect = Placement::new(view, canvas(), 0.5 * SIZE).rect();
        assert!(rect.expand(1.0).contains(canvas().center()));
    }

    #[test]
    fn a_fitted_image_is_wholly_visible_and_positions_outside_snap_to_its_border() {
        let placement = Placement::new(View::Whole, canvas(), SIZE);
        assert!(canvas().contains_rect(placement.rect()));
        assert!((placement.rect().center() - canvas().center()).length() < 1e-3);
        let outside = placement.rect().right_bottom() + vec2(30.0, 40.0);
        assert_eq!(placement.pixel_at(outside), None);
        assert_eq!(placement.nearest_pixel(outside), [319, 239]);
    }
}
