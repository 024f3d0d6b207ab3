//! The splats drawn by the processor, for windows without wgpu.
//!
//! As on a GPU the beginning of the splats is drawn larger while the camera moves, as many as the budget allows; at rest all of
//! them are drawn, on a thread of their own.

use egui::{Color32, ColorImage, Painter, Pos2, Rect, TextureHandle, TextureOptions};
use glam::{Vec2, Vec3};
use inplace_model::layer::Layer;
use inplace_model::palette::{Palette, Table};

use super::camera::NEAR;
use super::cloud::Splat;
use super::shot::{LEAST_PIXELS, Picture, SPLAT_RADIUS, Shot, SplatLook};
use crate::background::{Background, Desk, Gone};
use crate::canvas::mix;

/// Most pixels of a picture while the camera moves: the window's thread draws it.
const MOST_PIXELS: f32 = 600_000.0;

/// What is drawn, and how large in physical pixels.
type Wanted = (Picture, [u32; 2]);

/// Draws splats, and keeps their picture until it would differ.
pub struct Rasteriser {
    thread: Background<(Shot, [u32; 2]), (Wanted, ColorImage)>,
    /// What the thread was last asked for in the present view.
    asked: Option<Wanted>,
    shown: Option<Shown>,
}

/// A picture in the window.
struct Shown {
    texture: TextureHandle,
    wanted: Wanted,
    /// Whether all splats are in it.
    whole: bool,
}

impl Rasteriser {
    /// For this window.
    pub fn new(ctx: egui::Context) -> Self {
        Self {
            thread: Background::new(ctx, "splats", draw_all),
            asked: None,
            shown: None,
        }
    }

    /// Draws a view into its area; returns how many splats were drawn for it in this frame of the window, at most `budget`.
    pub fn paint(&mut self, painter: &Painter, shot: &Shot, moving: bool, budget: usize) -> usize {
        let ctx = painter.ctx();
        let wanted = (shot.picture(), shot.size(ctx.pixels_per_point()));
        if let Some((wanted, image)) = self.thread.newest()
            && self.shows_view_of(&wanted)
        {
            self.show(ctx, wanted, image, true);
        }
        let mut drawn = 0;
        let as_wanted = |shown: &Shown| shown.wanted == wanted && (shown.whole || moving);
        if !self.shows_view_of(&wanted) || moving && !self.shown.as_ref().is_some_and(as_wanted) {
            let (count, growth) = shot.beginning(budget);
            let [width, height] = wanted.1;
            let coarser = ((width * height) as f32 / MOST_PIXELS).sqrt().ceil().max(1.0) as u32;
            let size = wanted.1.map(|side| side.div_ceil(coarser));
            let image = raster(shot, size, count, growth);
            self.show(ctx, wanted, image, count == shot.splats() && coarser == 1);
            self.asked = None;
            drawn = count;
            ctx.request_repaint();
        } else if !self.shown.as_ref().is_some_and(as_wanted) && self.asked.as_ref() != Some(&wanted) {
            self.thread.ask((shot.clone(), wanted.1));
            self.asked = Some(wanted);
        }
        if let Some(shown) = &self.shown {
            let whole = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
            painter.image(shown.texture.id(), shot.sight.area, whole, Color32::WHITE);
        }
        drawn
    }

    /// Whether the picture that is shown shows the same splats at the same places.
    fn shows_view_of(&self, (picture, size): &Wanted) -> bool {
        let shown = self.shown.as_ref();
        shown.is_some_and(|shown| shown.wanted.0.same_view(picture) && shown.wanted.1 == *size)
    }

    fn show(&mut self, ctx: &egui::Context, wanted: Wanted, image: ColorImage, whole: bool) {
        let texture = match self.shown.take() {
            Some(Shown { mut texture, .. }) => {
                texture.set(image, TextureOptions::NEAREST);
                texture
            }
            None => ctx.load_texture("splats", image, TextureOptions::NEAREST),
        };
        self.shown = Some(Shown {
            texture,
            wanted,
            whole,
        });
    }
}

fn draw_all(desk: &Desk<(Shot, [u32; 2]), (Wanted, ColorImage)>) -> Result<(), Gone> {
    loop {
        let (shot, size) = desk.newest()?;
        let image = raster(&shot, size, shot.splats(), 1.0);
        desk.tell(((shot.picture(), size), image))?;
    }
}

/// A picture of this size of the first splats, so many times as large: discs along the surface, the nearest in front.
pub fn raster(shot: &Shot, size: [u32; 2], count: usize, growth: f32) -> ColorImage {
    let Shot {
        prepared,
        sight,
        look,
        palette,
    } = shot;
    let [width, height] = size.map(|side| side as usize);
    let focal = sight.focal * size[0] as f32 / sight.area.width();
    let least = growth * LEAST_PIXELS / focal;
    let camera_from_world = sight.rotation.transpose();
    let middle = 0.5 * Vec2::new(width as f32, height as f32);
    let mut image = ColorImage::filled([width, height], look.background);
    let mut depths = vec![f32::INFINITY; width * height];
    let splats = prepared.cloud.splats[..count].iter();
    for (splat, &value) in splats.zip(&prepared.values.values) {
        let towards = sight.eye - Vec3::from(splat.position);
        let center = camera_from_world * -towards;
        let normal = splat.normal().try_normalize();
        let facing = normal.map_or(f32::INFINITY, |normal| normal.dot(towards));
        if center.z <= NEAR || look.see_through && facing <= 0.0 {
            continue;
        }
        let line = towards.normalize();
        let normal = normal.unwrap_or(line);
        let radius = (SPLAT_RADIUS * growth * splat.voxel).max(least * towards.length());
        let (right, down) = normal.any_orthonormal_pair();
        let [right, down] = [right, down].map(|axis| camera_from_world * (radius * axis));
        let corners = [right + down, right - down].map(|corner| [center + corner, center - corner]);
        let corners = corners.as_flattened();
        if corners.iter().any(|corner| corner.z <= NEAR) {
            continue;
        }
        let places = corners
            .iter()
            .map(|corner| middle + focal / corner.z * corner.truncate());
        let (first, last) = places.fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(first, last), place| {
            (first.min(place), last.max(place))
        });
        // The pixels whose centres lie between.
        let [first, after] = [first, last].map(|place| (place - 0.5).ceil().max(Vec2::ZERO));
        let normal_in_camera = camera_from_world * normal;
        let plane = normal_in_camera.dot(center);
        let light = 0.72 + 0.28 * normal.dot(line).abs();
        let [r, g, b] =
            colored(splat, value, *look, palette).map(|channel| (light * f32::from(channel)).round() as u8);
        let color = Color32::from_rgb(r, g, b);
        for y in first.y as usize..height.min(after.y as usize) {
            for x in first.x as usize..width.min(after.x as usize) {
                // Where the ray through the pixel's centre meets the disc's plane.
                let place = Vec2::new(x as f32, y as f32) + 0.5;
                let ray = ((place - middle) / focal).extend(1.0);
                let depth = plane / normal_in_camera.dot(ray);
                let pixel = y * width + x;
                if depth < depths[pixel] && (depth * ray).distance_squared(center) <= radius * radius {
                    depths[pixel] = depth;
                    image.pixels[pixel] = color;
                }
            }
        }
    }
    image
}

/// Column of an entropy in its table.
fn column(steps: u32, palette: &Palette) -> usize {
    (steps as f32 * palette.entropy_scale()) as usize
}

fn colored(splat: &Splat, value: u32, look: SplatLook, palette: &Palette) -> [u8; 3] {
    let over = match look.layer {
        Layer::Labels | Layer::Objects => palette.class((value & 0xffff) as u16),
        Layer::Entropy => palette.value(Table::Entropy, column(value >> 16, palette)),
        _ => [0; 4],
    };
    let [r, g, b, _] = splat.color;
    mix([r, g, b], over, look.opacity)
}

#[cfg(test)]
mod tests {
    use super::super::shot::tests::floor_from;
    use super::*;
    use inplace_core::labels::Class;
    use std::time::{Duration, Instant};

    #[test]
    fn the_beginning_is_drawn_at_once_and_all_of_it_at_rest() {
        let ctx = egui::Context::default();
        let mut rasteriser = Rasteriser::new(ctx.clone());
        let painter = Painter::new(ctx, egui::LayerId::background(), Rect::EVERYTHING);
        let mut shot = floor_from(true, 64);
        assert_eq!(rasteriser.paint(&painter, &shot, true, 500), 500);
        assert_eq!(rasteriser.paint(&painter, &shot, true, 500), 0, "nothing moved");
        let mut rest = |shot: &Shot| {
            let start = Instant::now();
            loop {
                assert_eq!(rasteriser.paint(&painter, shot, false, 500), 0);
                let shown = rasteriser.shown.as_ref().unwrap();
                if shown.whole && shown.wanted.0 == shot.picture() {
                    break;
                }
                assert!(start.elapsed() < Duration::from_secs(20), "it was never drawn");
                std::thread::sleep(Duration::from_millis(1));
            }
        };
        rest(&shot);
        // In other colours the old picture stays until the new one is there.
        shot.look.opacity = 0.5;
        rest(&shot);
        shot.look.see_through = false;
        assert_eq!(rasteriser.paint(&painter, &shot, false, 500), 500);
    }

    #[test]
    fn labels_and_entropy_cover_the_colour_by_their_opacity() {
        let splat = Splat {
            position: [0.0; 3],
            voxel: 0.1,
            color: [10, 20, 30, 255],
            normal: [0; 4],
        };
        let mut class = Class::new(1, "wall");
        class.color = [210, 120, 30];
        let palette = Palette::new(&[class]);
        let look = |layer, opacity| SplatLook {
            layer,
            opacity,
            see_through: true,
            background: Color32::BLACK,
        };
        let [r, g, b, _] = palette.value(Table::Entropy, column(7, &palette));
        for (value, layer, opacity, expected) in [
            (1, Layer::Labels, 0.5, [110, 70, 30]),
            (0, Layer::Labels, 0.5, [10, 20, 30]),
            (1, Layer::Color, 1.0, [10, 20, 30]),
            (7 << 16, Layer::Entropy, 1.0, [r, g, b]),
        ] {
            let color = colored(&splat, value, look(layer, opacity), &palette);
            assert_eq!(color, expected, "{value} in {layer:?}");
        }
    }
}
