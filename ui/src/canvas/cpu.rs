//! The frame composed on the CPU: what the shader does, for thumbnails and for windows without wgpu.

use std::sync::Arc;

use egui::{Color32, Pos2, Rect, Vec2};
use inplace_core::scene;
use inplace_model::layer::{Layer, Look};
use inplace_model::palette::Palette;
use inplace_model::versioned::Versioned;
use inplace_model::workspace::source::FrameSource;

use super::content::ShownMap;
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
    let stride = (part.width() / size[0] as f32) as u32;
    let map = source.map.as_ref().map(|map| {
        let rough = (stride > 1).then(|| map.rough(stride)).flatten();
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

/// A part of the colour image, in its pixels, with what lies over it, at `width` x `height`. Where that is fewer pixels, each
/// is the mean of four of the image, as by the shader; of what lies over it, it is the nearest.
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
    let plane_size = plane.as_ref().map_or([1; 2], |plane| plane.size);
    // Along one side, for each pixel of the picture and one more: two pixels of the image, and that of the plane.
    let under = |[first, extent]: [f32; 2], count: usize, lengths: [usize; 2]| -> Vec<([usize; 2], usize)> {
        let step = extent / count as f32;
        let apart = if step > 1.0 { 0.25 } else { 0.0 };
        let nearest = |at: f32, length: usize| {
            let place = (first + at * step) / lengths[0] as f32 * length as f32;
            (place as usize).min(length - 1)
        };
        let both = |at: f32| [at - apart, at + apart].map(|at| nearest(at, lengths[0]));
        let middles = (0..=count).map(|at| at as f32 + 0.5);
        middles.map(|at| (both(at), nearest(at, lengths[1]))).collect()
    };
    let columns = under([part.left(), part.width()], width, [image[0], plane_size[0]]);
    let rows = under([part.top(), part.height()], height, [image[1], plane_size[1]]);
    let mut pixels = Vec::with_capacity(width * height);
    for row in rows.windows(2) {
        for column in columns.windows(2) {
            let mut rgb = mean_of(color, column[0].0, row[0].0);
            if let Some(plane) = &plane {
                let place = [column, row].map(|beside| [beside[0].1, beside[1].1]);
                rgb = plane.over(rgb, palette, look, place);
            }
            pixels.push(Color32::from_rgb(rgb[0], rgb[1], rgb[2]));
        }
    }
    egui::ColorImage::new([width, height], pixels)
}

/// The mean of the pixels where these columns and rows meet.
fn mean_of(color: &scene::ColorImage, columns: [usize; 2], rows: [usize; 2]) -> [u8; 3] {
    let width = color.width() as usize;
    if columns[0] == columns[1] && rows[0] == rows[1] {
        return color.pixel(rows[0] * width + columns[0]);
    }
    let [a, b, c, d] = [0, 1, 2, 3].map(|k| color.pixel(rows[k / 2] * width + columns[k % 2]));
    let mean = |channel: usize| {
        let sum: u16 = [a, b, c, d].map(|rgb| u16::from(rgb[channel])).iter().sum();
        ((sum + 2) / 4) as u8
    };
    [mean(0), mean(1), mean(2)]
}

/// What lies over an image, with its numbers at hand.
struct Plane<'a> {
    over: &'a Over,
    size: [usize; 2],
    values: &'a [u16],
}

impl Plane<'_> {
    /// A colour of the image with what lies over it at the first of these columns and rows; the others are those of the
    /// next pixel of the picture.
    fn over(&self, image: [u8; 3], palette: &Palette, look: Look, place: [[usize; 2]; 2]) -> [u8; 3] {
        let [[column, right], [row, below]] = place;
        let value = self.at(column, row);
        let strength = strength(&look);
        let base = if self.over.greyed { dimmed(image) } else { image };
        match self.over.reading {
            Reading::Classes => {
                let filled = mix(base, palette.class(value), strength);
                if self.at(right, row) != value || self.at(column, below) != value {
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

    fn at(&self, column: usize, row: usize) -> u16 {
        self.values[row * self.size[0] + column]
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
    fn a_small_picture_has_means_of_colours_and_all_borders() {
        let grey = |column: u8| [10 * (column % 4); 3];
        let color = scene::ColorImage::new(8, 1, (0..8).flat_map(grey).collect()).unwrap();
        let palette = Palette::new(&[Class::new(1, "wall"), Class::new(2, "floor")]);
        let map = FrameMap::new(0, 1, [8, 1], [[1; 4], [2; 4]].concat(), vec![0; 8]).unwrap();
        let map = ShownMap::new(Versioned::new(Arc::new(map)));
        let over = map.over(Layer::Labels, &palette);
        let small = |opacity, outlines| {
            let look = Look {
                outlines,
                ..look(Layer::Labels, opacity)
            };
            composite(&color, over.as_ref(), &palette, look, (whole([8, 1]), [2, 1])).pixels
        };
        // Of the columns 1 and 3.
        assert_eq!(small(0.0, false), [Color32::from_gray(20); 2]);
        let (plain, outlined) = (small(0.5, false), small(0.5, true));
        assert!(plain[0] != outlined[0] && plain[1] == outlined[1]);
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
    fn a_picture_shows_the_pixels_of_a_part_or_their_mean() {
        let (color, _) = frame();
        let cut = |part| {
            let look = look(Layer::Color, 0.0);
            composite(&color, None, &Palette::new(&[]), look, (part, [1, 1])).pixels
        };
        let [left, mean] = [[10, 20, 30], [25, 35, 45]].map(|[r, g, b]| Color32::from_rgb(r, g, b));
        assert_eq!(cut(whole([2, 1])), [mean]);
        assert_eq!(cut(whole([1, 1])), [left]);
    }
}
