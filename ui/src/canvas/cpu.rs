//! The frame composed on the CPU: what the shader does, for thumbnails and for windows without wgpu.

use std::sync::Arc;

use egui::{Color32, Pos2, Rect, Vec2};
use inplace_core::scene;
use inplace_model::layer::{Layer, Look};
use inplace_model::palette::Palette;
use inplace_model::versioned::Versioned;
use inplace_model::workspace::source::FrameSource;

use super::content::{Content, ShownMap};
use super::plane::{Over, Reading};

/// How much of the colour of a class border is the outline's.
const OUTLINE_STRENGTH: f32 = 0.55;
/// How much of the colour of a pixel without a value is its stripe's.
pub(super) const HATCHING: f32 = 0.4;
/// What black becomes in a dimmed image, of 255, and how much of the brightness stays.
pub(super) const DIMMED_BLACK: f32 = 22.0;
pub(super) const DIMMED_SHARE: f32 = 0.5;

/// How much of the layer's own colour there is, 0..=1.
pub(super) fn strength(look: &Look) -> f32 {
    match look.layer {
        // What is marked stays marked.
        Layer::Disagreement | Layer::Differences => 0.5 + 0.5 * look.opacity,
        _ => look.opacity,
    }
}

/// How much of the colour of a border between classes is the outline's.
pub(super) fn outline(look: &Look) -> f32 {
    if look.outlines && look.opacity > 0.0 {
        OUTLINE_STRENGTH * look.opacity.max(0.5)
    } else {
        0.0
    }
}

/// Pictures of this size of a part of a frame, in its pixels, in these looks, the image alone for layers that need more than
/// a map; `None` where there is no such frame, or its file cannot be read any more.
pub fn pictures<const LOOKS: usize>(
    source: &FrameSource,
    looks: [Look; LOOKS],
    part: Rect,
    size: [usize; 2],
) -> Option<[egui::ColorImage; LOOKS]> {
    let color = source.scene.frames.get(source.frame)?.pixels().ok()?.color;
    // What moves borders by some pixels would hardly show there.
    let is_small = 2.0 * size[0] as f32 <= part.width();
    let map = source.map.as_ref().map(|map| {
        let rough = is_small.then(|| map.rough()).flatten();
        rough.map_or_else(|| Arc::clone(map), Arc::new)
    });
    let map = map.map(Versioned::new).map(ShownMap::new);
    Some(looks.map(|look| {
        let over = map.as_ref().and_then(|map| map.over(look.layer, &source.palette));
        composite(&color, over.as_ref(), &source.palette, look, (part, size))
    }))
}

/// All of an image, in its pixels.
pub fn whole(size: [u32; 2]) -> Rect {
    Rect::from_min_size(Pos2::ZERO, size.map(|side| side as f32).into())
}

/// The size of a picture of a part, at most this and no larger than the part.
pub fn fitted(part: Rect, largest: [f32; 2]) -> [usize; 2] {
    let scale = (Vec2::from(largest) / part.size()).min_elem().min(1.0);
    <[f32; 2]>::from(scale * part.size()).map(|side| (side.round() as usize).max(1))
}

/// A part of the colour image, in its pixels, with what lies over it, at `width` x `height`, nearest-neighbour.
pub fn composite(
    color: &scene::ColorImage,
    over: Option<&Over>,
    palette: &Palette,
    look: Look,
    (part, [width, height]): (Rect, [usize; 2]),
) -> egui::ColorImage {
    let values = over.map(|over| over.texels.values());
    let plane = over.zip(values.as_deref()).map(|(over, values)| Plane {
        over,
        size: over.size.map(|side| side as usize),
        values,
    });
    let image = [color.width(), color.height()].map(|side| side as usize);
    // Where the pixels of the picture are in the image, 0..=1.
    let shares = |[first, extent]: [f32; 2], count: usize, all: usize| {
        (0..count).map(move |at| (first + (at as f32 + 0.5) / count as f32 * extent) / all as f32)
    };
    let nearest = |share: f32, length: usize| ((share * length as f32) as usize).min(length - 1);
    let mut pixels = Vec::with_capacity(width * height);
    for y in shares([part.top(), part.height()], height, image[1]) {
        for x in shares([part.left(), part.width()], width, image[0]) {
            let mut rgb = color.pixel(nearest(y, image[1]) * image[0] + nearest(x, image[0]));
            if let Some(plane) = &plane {
                let [column, row] = [nearest(x, plane.size[0]), nearest(y, plane.size[1])];
                rgb = plane.over(rgb, palette, look, column, row);
            }
            pixels.push(Color32::from_rgb(rgb[0], rgb[1], rgb[2]));
        }
    }
    egui::ColorImage::new([width, height], pixels)
}

/// What lies over an image, with its numbers at hand.
struct Plane<'a> {
    over: &'a Over,
    size: [usize; 2],
    values: &'a [u16],
}

impl Plane<'_> {
    fn over(&self, image: [u8; 3], palette: &Palette, look: Look, column: usize, row: usize) -> [u8; 3] {
        let index = row * self.size[0] + column;
        let value = self.values[index];
        let strength = strength(&look);
        let base = if self.over.greyed { dimmed(image) } else { image };
        match self.over.reading {
            Reading::Classes => {
                let filled = mix(base, palette.class(value), strength);
                if self.is_border(index, column, row) {
                    mix(filled, [255; 4], outline(&look))
                } else {
                    filled
                }
            }
            Reading::Values { hole, .. } if hole == Some(value) => {
                let light = ((column + row) / self.over.stripe() as usize).is_multiple_of(2);
                let stripe = if light { [255; 4] } else { [0, 0, 0, 255] };
                mix(base, stripe, HATCHING * strength)
            }
            Reading::Values { table, scale, .. } => {
                let column = (f32::from(value) * scale) as usize;
                mix(base, palette.value(table, column), strength)
            }
        }
    }

    /// Whether the pixel to the right or the one below is of another class.
    fn is_border(&self, index: usize, column: usize, row: usize) -> bool {
        let [width, height] = self.size;
        let class = self.values[index];
        (column + 1 < width && self.values[index + 1] != class)
            || (row + 1 < height && self.values[index + width] != class)
    }
}

/// A dark grey as bright as the colour was in its surroundings.
fn dimmed([r, g, b]: [u8; 3]) -> [u8; 3] {
    let brightness = 0.299 * f32::from(r) + 0.587 * f32::from(g) + 0.114 * f32::from(b);
    [(DIMMED_BLACK + DIMMED_SHARE * brightness).round() as u8; 3]
}

/// A colour with another one over it.
pub fn mix(base: [u8; 3], over: [u8; 4], opacity: f32) -> [u8; 3] {
    let alpha = opacity * f32::from(over[3]) / 255.0;
    let channel = |c: usize| {
        let (under, over) = (f32::from(base[c]), f32::from(over[c]));
        (under + alpha * (over - under) + 0.5) as u8
    };
    [channel(0), channel(1), channel(2)]
}

/// An image with what lies over it, on the screen; with fewer pixels where it has more than a texture may have.
pub(super) fn texture(
    ctx: &egui::Context,
    image: &scene::ColorImage,
    content: &Content,
    look: Look,
) -> egui::TextureHandle {
    let most = ctx.input(|input| input.max_texture_side);
    let all = [image.width(), image.height()];
    let cut = (whole(all), all.map(|side| most.min(side as usize)));
    let composed = composite(image, content.over.as_ref(), &content.palette, look, cut);
    let options = egui::TextureOptions {
        magnification: egui::TextureFilter::Nearest,
        ..egui::TextureOptions::LINEAR
    };
    ctx.load_texture("frame", composed, options)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::plane::DepthPlane;
    use inplace_model::palette::{Agreement, Table};

    use super::*;
    use inplace_core::labels::Class;
    use inplace_core::session::FrameMap;

    fn frame() -> (scene::ColorImage, FrameMap) {
        let color = scene::ColorImage::new(2, 1, vec![10, 20, 30, 40, 50, 60]).unwrap();
        let map = FrameMap::new(0, 1, [2, 1], vec![1, 0], vec![0, u16::MAX]).unwrap();
        (color, map)
    }

    fn look(layer: Layer, opacity: f32) -> Look {
        Look {
            layer,
            opacity,
            outlines: false,
        }
    }

    fn composed(look: Look) -> Vec<Color32> {
        let (color, map) = frame();
        let mut class = Class::new(1, "wall");
        class.color = [210, 120, 30];
        let palette = Palette::new(&[class]);
        let map = ShownMap::new(Versioned::new(Arc::new(map)));
        let over = map.over(look.layer, &palette);
        composite(&color, over.as_ref(), &palette, look, (whole([2, 1]), [2, 1])).pixels
    }

    #[test]
    fn layers_cover_the_image_by_their_opacity_but_for_void() {
        let image = [Color32::from_rgb(10, 20, 30), Color32::from_rgb(40, 50, 60)];
        let palette = Palette::new(&[]);
        let of_entropy = [0, 255].map(|column| {
            let [r, g, b, _] = palette.value(Table::Entropy, column);
            Color32::from_rgb(r, g, b)
        });
        for (layer, opacity, expected) in [
            (Layer::Labels, 0.5, [Color32::from_rgb(110, 70, 30), image[1]]),
            (Layer::Labels, 0.0, image),
            (Layer::Color, 1.0, image),
            (Layer::Entropy, 1.0, of_entropy),
        ] {
            let pixels = composed(look(layer, opacity));
            assert_eq!(pixels, expected, "{layer:?} at {opacity}");
        }
    }

    /// A row of grey pixels with a layer over them.
    fn over(layer: Layer, over: &Over) -> Vec<Color32> {
        let width = over.size[0];
        let color = scene::ColorImage::new(width, 1, vec![100; 3 * width as usize]).unwrap();
        let cut = (whole([width, 1]), [width as usize, 1]);
        composite(&color, Some(over), &Palette::new(&[]), look(layer, 1.0), cut).pixels
    }

    #[test]
    fn depth_shows_its_colours_and_hatches_holes() {
        let plane = DepthPlane {
            size: [5, 1],
            values: [1, u16::MAX, 0, 0, 0].into(),
            range: None,
        };
        let pixels = over(Layer::Depth, &Over::depth(&Versioned::new(plane)));
        let [near, far] = [0, 255].map(|column| {
            let [r, g, b, _] = Table::Depth.color(column);
            Color32::from_rgb(r, g, b)
        });
        let [light, dark] = [Color32::from_gray(162), Color32::from_gray(60)];
        assert_eq!(pixels, [near, far, dark, dark, light]);
    }

    #[test]
    fn disagreement_marks_what_is_contradicted_on_a_grey_image() {
        let numbers = Agreement::ALL.map(|agreement| agreement as u16);
        let size = [numbers.len() as u32, 1];
        let marks = Over::marks(size, numbers.into(), Table::Disagreement);
        let pixels = over(Layer::Disagreement, &marks);
        let grey = Color32::from_gray(72);
        let [r, g, b, _] = Agreement::ImportContradicted.color();
        assert_eq!((pixels[0], pixels[2]), (grey, Color32::from_rgb(r, g, b)));
        let agreed = pixels[1];
        assert!(agreed.b() > agreed.r() && agreed.b() < Agreement::Agreed.color()[2]);
        assert_ne!(pixels[2], pixels[3]);
    }

    #[test]
    fn borders_between_classes_are_drawn_where_asked_for() {
        let plain = composed(look(Layer::Labels, 0.5));
        let outlined = composed(Look {
            outlines: true,
            ..look(Layer::Labels, 0.5)
        });
        assert_ne!(plain[0], outlined[0]);
        assert_eq!(plain[1], outlined[1]);
    }

    #[test]
    fn a_picture_of_a_part_takes_the_nearest_pixels() {
        let (color, _) = frame();
        let cut = |part| {
            let look = look(Layer::Color, 0.0);
            composite(&color, None, &Palette::new(&[]), look, (part, [1, 1])).pixels
        };
        let [left, right] = [[10, 20, 30], [40, 50, 60]].map(|[r, g, b]| Color32::from_rgb(r, g, b));
        assert_eq!(cut(whole([2, 1])), [right]);
        assert_eq!(cut(whole([1, 1])), [left]);
    }
}
