//! The frame composed on the CPU: what the shader does, for thumbnails and for windows without wgpu.

use egui::Color32;
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
    for y in 0..height {
        for x in 0..width {
            let index = nearest(y, height, color_height) * color_width + nearest(x, width, color_width);
            let mut rgb = color.pixel(index);
            if let Some(map) = map {
                let column = nearest(x, width, map.width as usize);
                let row = nearest(y, height, map.height as usize);
                rgb = over(rgb, map, palette, look, column, row);
            }
            pixels.push(Color32::from_rgb(rgb[0], rgb[1], rgb[2]));
        }
    }
    egui::ColorImage::new([width, height], pixels)
}

fn over(base: [u8; 3], map: &FrameMap, palette: &Palette, look: Look, column: usize, row: usize) -> [u8; 3] {
    let width = map.width as usize;
    let index = row * width + column;
    match look.layer {
        Layer::Color => base,
        Layer::Entropy => mix(base, palette.entropy(map.entropy[index]), look.opacity),
        Layer::Labels => {
            let label = map.labels[index];
            let right = if column + 1 < width { index + 1 } else { index };
            let below = if row + 1 < map.height as usize {
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
        let map = FrameMap {
            frame: 0,
            generation: 1,
            width: 2,
            height: 1,
            labels: vec![1, 0],
            entropy: vec![0, u16::MAX],
        };
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
