//! The frame composed on the CPU: what the shader does, for thumbnails and for windows without wgpu.

use std::borrow::Cow;

use egui::Color32;
use inplace_core::labels::ClassId;
use inplace_core::scene;
use inplace_core::session::FrameMap;

use super::palette::{Layer, Palette};

/// How much of the colour of a class border is the outline's.
pub(super) const OUTLINE_STRENGTH: f32 = 0.55;

/// How a frame is composed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// What lies over the colour image.
    pub layer: Layer,
    /// How much it covers, 0..=1.
    pub opacity: f32,
    /// Whether borders between classes are drawn.
    pub outlines: bool,
}

/// The colour image with the layer over it, at `width` x `height`, nearest-neighbour.
pub fn composite(
    color: &scene::ColorImage,
    map: Option<&FrameMap>,
    palette: &Palette,
    look: Look,
    [width, height]: [usize; 2],
) -> egui::ColorImage {
    let (color_width, color_height) = (color.width() as usize, color.height() as usize);
    let nearest = |position: usize, length: usize, source: usize| (2 * position + 1) * source / (2 * length);
    let mut pixels = Vec::with_capacity(width * height);
    let planes = map.map(|map| Planes::of(map, look.layer));
    for y in 0..height {
        for x in 0..width {
            let index = nearest(y, height, color_height) * color_width + nearest(x, width, color_width);
            let mut rgb = color.pixel(index);
            if let Some(planes) = &planes {
                let column = nearest(x, width, planes.width);
                let row = nearest(y, height, planes.height);
                rgb = over(rgb, planes, palette, look, column, row);
            }
            pixels.push(Color32::from_rgb(rgb[0], rgb[1], rgb[2]));
        }
    }
    egui::ColorImage::new([width, height], pixels)
}

/// The pixels of a map that a layer shows; the others stay empty.
struct Planes<'a> {
    width: usize,
    height: usize,
    labels: Cow<'a, [ClassId]>,
    entropy: Cow<'a, [u16]>,
}

impl<'a> Planes<'a> {
    fn of(map: &'a FrameMap, layer: Layer) -> Self {
        let empty = || Cow::Borrowed(&[][..]);
        Self {
            width: map.width as usize,
            height: map.height as usize,
            labels: if layer == Layer::Labels {
                map.labels()
            } else {
                empty()
            },
            entropy: if layer == Layer::Entropy {
                map.entropy()
            } else {
                empty()
            },
        }
    }
}

fn over(
    base: [u8; 3],
    map: &Planes<'_>,
    palette: &Palette,
    look: Look,
    column: usize,
    row: usize,
) -> [u8; 3] {
    let width = map.width;
    let index = row * width + column;
    match look.layer {
        Layer::Color => base,
        Layer::Entropy => mix(base, palette.entropy(map.entropy[index]), look.opacity),
        Layer::Labels => {
            let label = map.labels[index];
            let right = if column + 1 < width { index + 1 } else { index };
            let below = if row + 1 < map.height {
                index + width
            } else {
                index
            };
            let border = map.labels[right] != label || map.labels[below] != label;
            let color = palette.class(label);
            let filled = mix(base, color, look.opacity);
            if look.outlines && border && look.opacity > 0.0 {
                mix(filled, [255; 4], OUTLINE_STRENGTH * look.opacity.max(0.5))
            } else {
                filled
            }
        }
    }
}

fn mix(base: [u8; 3], over: [u8; 4], opacity: f32) -> [u8; 3] {
    let alpha = opacity * f32::from(over[3]) / 255.0;
    let channel = |c: usize| {
        let (under, over) = (f32::from(base[c]), f32::from(over[c]));
        (under + alpha * (over - under)).round() as u8
    };
    [channel(0), channel(1), channel(2)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use inplace_core::labels::Class;

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
        composite(&color, Some(&map), &palette, look, [2, 1]).pixels
    }

    #[test]
    fn labels_cover_by_their_opacity_and_void_leaves_the_image() {
        let [labelled, void] = composed(look(Layer::Labels, 0.5))[..] else {
            panic!("two pixels")
        };
        assert_eq!(labelled, Color32::from_rgb(110, 70, 30));
        assert_eq!(void, Color32::from_rgb(40, 50, 60));
    }

    #[test]
    fn the_colour_layer_and_a_transparent_overlay_are_the_image() {
        let image = [Color32::from_rgb(10, 20, 30), Color32::from_rgb(40, 50, 60)];
        assert_eq!(composed(look(Layer::Color, 1.0)), image);
        assert_eq!(composed(look(Layer::Labels, 0.0)), image);
    }

    #[test]
    fn an_opaque_entropy_layer_shows_the_colour_table() {
        let palette = Palette::new(&[]);
        let rgb = |steps| {
            let [r, g, b, _] = palette.entropy(steps);
            Color32::from_rgb(r, g, b)
        };
        assert_eq!(composed(look(Layer::Entropy, 1.0)), [rgb(0), rgb(u16::MAX)]);
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
    fn a_thumbnail_takes_the_nearest_pixel() {
        let (color, _) = frame();
        let look = look(Layer::Color, 0.0);
        let small = composite(&color, None, &Palette::new(&[]), look, [1, 1]);
        assert_eq!(small.pixels, [Color32::from_rgb(40, 50, 60)]);
    }
}
