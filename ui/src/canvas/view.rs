//! Where the image lies in the canvas: zoom, pan, and the way between screen and image.

use egui::{Pos2, Rect, Vec2, pos2, vec2};
use inplace_core::labels::Pixel;

/// Points on screen per image pixel at the closest zoom.
const CLOSEST_ZOOM: f32 = 48.0;
/// The farthest zoom, relative to the zoom that fits.
const FARTHEST_OF_FIT: f32 = 0.5;
/// Points kept free around a fitted image.
const FIT_MARGIN: f32 = 16.0;

/// What part of the image the canvas shows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct View {
    part: Part,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Part {
    /// The whole image, fitted.
    #[default]
    Whole,
    /// A rectangle of the image, in pixels, fitted.
    Rectangle(Rect),
    /// Points per pixel, and the image position in the middle of the canvas.
    Free(f32, Pos2),
}

impl View {
    /// The whole image, fitted into whatever space there is.
    pub const FITTED: Self = Self { part: Part::Whole };

    /// A rectangle of the image, in pixels, fitted into whatever space there is; the image around it fills the rest.
    pub fn showing(rectangle: Rect) -> Self {
        Self {
            part: Part::Rectangle(rectangle),
        }
    }

    /// Whether the whole image is fitted into the canvas.
    pub fn is_fitted(&self) -> bool {
        self.part == Part::Whole
    }

    /// Where an image of this size lies in the canvas.
    pub fn place(&self, canvas: Rect, size: Vec2) -> Placement {
        let (zoom, center) = match self.part {
            Part::Whole => (fit_zoom(canvas, size), (0.5 * size).to_pos2()),
            Part::Rectangle(rectangle) => {
                let zoom = fit_zoom(canvas, rectangle.size());
                (zoom, filling(rectangle.center(), canvas.size() / zoom, size))
            }
            Part::Free(zoom, center) => (clamp_zoom(zoom, canvas, size), center),
        };
        let origin = canvas.center() - zoom * center.to_vec2();
        Placement { origin, zoom, size }
    }

    /// Zooms by `factor` so that the image position under `cursor` stays under it.
    pub fn zoom_at(&mut self, canvas: Rect, size: Vec2, cursor: Pos2, factor: f32) {
        let placement = self.place(canvas, size);
        let fixed = placement.to_image(cursor);
        let zoom = clamp_zoom(placement.zoom * factor, canvas, size);
        let center = fixed + (canvas.center() - cursor) / zoom;
        self.set(zoom, center, size);
    }

    /// Moves the image by `delta` points.
    pub fn pan(&mut self, canvas: Rect, size: Vec2, delta: Vec2) {
        let placement = self.place(canvas, size);
        let center = placement.to_image(canvas.center() - delta);
        self.set(placement.zoom, center, size);
    }

    /// Brings an image position into the middle when zoomed in; a fitted image already shows it.
    pub fn center_on(&mut self, position: Pos2) {
        match &mut self.part {
            Part::Whole => {}
            Part::Rectangle(rectangle) => rectangle.set_center(position),
            Part::Free(_, center) => *center = position,
        }
    }

    /// The middle of the canvas always shows a part of the image.
    fn set(&mut self, zoom: f32, center: Pos2, size: Vec2) {
        self.part = Part::Free(zoom, center.clamp(Pos2::ZERO, size.to_pos2()));
    }
}

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
    /// The image's rectangle on screen.
    pub fn rect(&self) -> Rect {
        Rect::from_min_size(self.origin, self.zoom * self.size)
    }

    /// Image position (pixels; the centre of pixel 0 is 0.5) of a screen position.
    pub fn to_image(&self, screen: Pos2) -> Pos2 {
        ((screen - self.origin) / self.zoom).to_pos2()
    }

    /// Screen position of an image position.
    pub fn to_screen(&self, image: Pos2) -> Pos2 {
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
    fn every_pixel_survives_the_way_to_the_screen_and_back() {
        let mut view = View::FITTED;
        for factor in [1.0, 1.7, 3.1, 0.4, 8.0] {
            view.zoom_at(canvas(), SIZE, pos2(400.0, 300.0), factor);
            let placement = view.place(canvas(), SIZE);
            for pixel in [[0, 0], [319, 239], [17, 200], [160, 120]] {
                assert_eq!(placement.pixel_at(placement.pixel_center(pixel)), Some(pixel));
            }
        }
    }

    #[test]
    fn zooming_keeps_what_is_under_the_cursor() {
        let mut view = View::FITTED;
        let cursor = pos2(500.0, 260.0);
        let before = view.place(canvas(), SIZE).to_image(cursor);
        view.zoom_at(canvas(), SIZE, cursor, 4.0);
        let after = view.place(canvas(), SIZE).to_image(cursor);
        assert!((before - after).length() < 1e-3);
    }

    #[test]
    fn a_fitted_image_is_centred_and_wholly_visible() {
        let rect = View::FITTED.place(canvas(), SIZE).rect();
        assert!(canvas().contains_rect(rect));
        assert!((rect.center() - canvas().center()).length() < 1e-3);
    }

    #[test]
    fn a_rectangle_is_wholly_visible_and_as_large_as_it_can_be() {
        let part = Rect::from_min_max(pos2(0.0, 20.0), pos2(80.0, 80.0));
        let placement = View::showing(part).place(canvas(), SIZE);
        let shown = Rect::from_min_max(placement.to_screen(part.min), placement.to_screen(part.max));
        assert!(canvas().expand(1e-3).contains_rect(shown));
        assert!((shown.height() - (canvas().height() - 2.0 * FIT_MARGIN)).abs() < 1e-2);
        // What the rectangle leaves free shows the image, not what lies around it.
        assert!(placement.rect().left() <= canvas().left() + 1e-3);
        let whole = Rect::from_min_size(Pos2::ZERO, SIZE);
        let (all, fitted) = (View::showing(whole), View::FITTED);
        assert_eq!(all.place(canvas(), SIZE), fitted.place(canvas(), SIZE));
    }

    #[test]
    fn the_image_cannot_be_lost_by_panning() {
        let mut view = View::FITTED;
        for _ in 0..50 {
            view.pan(canvas(), SIZE, vec2(700.0, -900.0));
        }
        let rect = view.place(canvas(), SIZE).rect();
        assert!(rect.expand(1.0).contains(canvas().center()));
    }

    #[test]
    fn positions_outside_belong_to_no_pixel_and_snap_to_the_border() {
        let placement = View::FITTED.place(canvas(), SIZE);
        let outside = placement.rect().right_bottom() + vec2(30.0, 40.0);
        assert_eq!(placement.pixel_at(outside), None);
        assert_eq!(placement.nearest_pixel(outside), [319, 239]);
    }
}
