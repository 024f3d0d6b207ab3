//! The part of a frame that the screen shows, as a texture composed on the CPU.

use egui::{Color32, Painter, Pos2, Rect, TextureFilter, TextureHandle, TextureOptions, Vec2, vec2};
use inplace_model::layer::Look;
use inplace_model::versioned::Version;

use super::content::Content;
use super::cpu::{composite, whole};
use super::gpu::{UploadClock, note_image, note_map};
use super::view::Placement;

/// What is composed beyond each side of what is visible, as a share of its size, so that little is made while the view is
/// panned.
const MARGIN: f32 = 0.125;

/// One side of the canvas, as it was composed last.
#[derive(Default)]
pub struct Side(Option<Composed>);

struct Composed {
    texture: TextureHandle,
    /// The part of the image, in its pixels, and the size of all of it.
    part: Rect,
    all: [u32; 2],
    made_of: MadeOf,
}

/// Versions of the image, of what lies over it and of the palette, the look, and by what every side is divided.
type MadeOf = (Version, Option<Version>, Version, Look, u32);

impl Side {
    /// Paints a frame at this place. It is composed where it or the look is new, or shows a part that was not composed. While
    /// its image is not ready, the frame before stays.
    pub fn paint(
        &mut self,
        painter: &Painter,
        content: &Content,
        placement: Placement,
        look: Look,
        clock: &UploadClock,
    ) {
        if let Some(picture) = &content.picture {
            let all = [picture.color.width(), picture.color.height()];
            let over = content.over.as_ref().map(|over| over.version);
            // About as many pixels as the screen shows.
            let on_screen = placement.rect().width() * painter.pixels_per_point();
            let stride = (all[0] as f32 / on_screen).max(1.0) as u32;
            let made_of = (picture.version, over, content.palette.version(), look, stride);
            let visible = visible(placement, painter.clip_rect(), all);
            let is_like = |composed: &Composed| composed.made_of == made_of;
            let shows = |composed: &Composed| is_like(composed) && composed.part.contains_rect(visible);
            if !self.0.as_ref().is_some_and(shows) {
                let part = around(visible, all, stride);
                let most = painter.ctx().input(|input| input.max_texture_side);
                let size = <[f32; 2]>::from(part.size())
                    .map(|side| most.min((side as usize).div_ceil(stride as usize)));
                let over = content.over.as_ref();
                let pixels = composite(&picture.color, over, &content.palette, look, (part, size));
                let options = TextureOptions {
                    magnification: TextureFilter::Nearest,
                    ..TextureOptions::LINEAR
                };
                let is_new = !self.0.as_ref().is_some_and(is_like);
                self.0 = Some(Composed {
                    texture: painter.ctx().load_texture("frame", pixels, options),
                    part,
                    all,
                    made_of,
                });
                note_image(clock);
                if let Some(map) = content.map.as_ref().filter(|_| is_new) {
                    note_map(clock, map.generation, map.frame);
                }
            }
        }
        if let Some(composed) = &self.0 {
            let pixel = placement.rect().size() / Vec2::from(composed.all.map(|side| side as f32));
            let corner = |at: Pos2| placement.origin + at.to_vec2() * pixel;
            let rect = Rect::from_min_max(corner(composed.part.min), corner(composed.part.max));
            painter.image(composed.texture.id(), rect, whole([1, 1]), Color32::WHITE);
        }
    }
}

/// What a part of the screen shows of an image with this many pixels along each axis, in its pixels.
fn visible(placement: Placement, screen: Rect, all: [u32; 2]) -> Rect {
    let (rect, all) = (placement.rect(), whole(all));
    let per_point = all.size() / rect.size();
    let in_image = |at: Pos2| ((at - rect.min) * per_point).to_pos2();
    let [min, max] = [screen.min, screen.max].map(|at| in_image(at).clamp(all.min, all.max));
    Rect::from_min_max(min, max)
}

/// Whole blocks of `stride` pixels along each axis of an image, with a margin around what is visible of it.
fn around(visible: Rect, all: [u32; 2], stride: u32) -> Rect {
    let stride = stride as f32;
    let margin = MARGIN * visible.size() + Vec2::splat(stride);
    let (min, max) = (visible.min - margin, visible.max + margin);
    let snapped = |at: f32, round: fn(f32) -> f32| stride * round(at / stride);
    let blocks = Rect::from_min_max(
        vec2(snapped(min.x, f32::floor), snapped(min.y, f32::floor)).to_pos2(),
        vec2(snapped(max.x, f32::ceil), snapped(max.y, f32::ceil)).to_pos2(),
    );
    blocks.intersect(whole(all))
}

#[cfg(test)]
mod tests {
    use egui::pos2;

    use super::*;

    fn placement(zoom: f32) -> Placement {
        Placement {
            origin: pos2(-300.0, 50.0),
            zoom,
            size: vec2(1081.0, 1920.0),
        }
    }

    #[test]
    fn what_is_composed_holds_what_is_visible_in_whole_blocks_and_little_more() {
        let screen = Rect::from_min_max(pos2(0.0, 80.0), pos2(800.0, 780.0));
        let all = [1081, 1920];
        for (zoom, stride) in [(48.0, 1), (2.0, 1), (0.7, 1), (0.4, 2), (0.3, 3)] {
            let visible = visible(placement(zoom), screen, all);
            let part = around(visible, all, stride);
            assert!(
                part.contains_rect(visible) && whole(all).contains_rect(part),
                "{zoom}"
            );
            let area = (visible.width() + 4.0 * stride as f32) * (visible.height() + 4.0 * stride as f32);
            assert!(part.area() <= 1.6 * area, "{zoom}: {part:?} for {visible:?}");
            let is_whole = |at: f32, last: u32| at == last as f32 || at % stride as f32 == 0.0;
            for at in [part.min, part.max] {
                assert!(
                    is_whole(at.x, all[0]) && is_whole(at.y, all[1]),
                    "{zoom}: {part:?}"
                );
            }
        }
        // An image that was moved out of sight.
        let beside = Rect::from_min_max(pos2(5000.0, 0.0), pos2(6000.0, 700.0));
        assert!(around(visible(placement(1.0), beside, all), all, 1).is_positive());
    }
}
