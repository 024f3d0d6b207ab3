//! What the canvas shows, with a serial number for each part so that only changes are uploaded.

use std::sync::Arc;

use inplace_core::scene::{ColorImage, Scene};
use inplace_core::session::{ENTROPY_STEPS_PER_NAT, FrameMap};

use super::palette::{Palette, Table};
use super::plane::{Over, Reading, Texels};

/// A map that is looked up, with a number that no other map has.
#[derive(Clone, Debug)]
pub struct ShownMap {
    /// The map.
    pub map: Arc<FrameMap>,
    /// Never 0, and different for every map.
    pub serial: u64,
}

impl ShownMap {
    /// The map's classes as what lies over the image.
    pub fn labels(&self) -> Over {
        Over {
            size: [self.map.width, self.map.height],
            texels: Texels::Labels(Arc::clone(&self.map)),
            // Numbers of maps are multiples of four: the next one is free for the entropy.
            serial: self.serial,
            reading: Reading::Classes,
            greyed: false,
        }
    }

    /// The map's entropy as what lies over the image.
    pub fn entropy(&self, palette: &Palette) -> Over {
        Over {
            size: [self.map.width, self.map.height],
            texels: Texels::Entropy(Arc::clone(&self.map)),
            serial: self.serial + 1,
            reading: entropy_reading(palette),
            greyed: false,
        }
    }
}

/// How entropies are read: from none to that of an even guess among all classes.
pub fn entropy_reading(palette: &Palette) -> Reading {
    Reading::Values {
        table: Table::Entropy,
        scale: palette.entropy_scale(),
        hole: None,
    }
}

/// The largest entropy that has a colour of its own, in nats.
pub fn most_entropy(palette: &Palette) -> f32 {
    palette
        .most_entropy()
        .min(f32::from(u16::MAX) / ENTROPY_STEPS_PER_NAT)
}

/// An image as the renderer wants it: RGBA, row-major `[height, width, 4]`.
#[derive(Debug)]
pub struct Picture {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// The bytes.
    pub rgba: Vec<u8>,
    /// Never 0, and different for every picture of this canvas.
    pub serial: u64,
}

impl Picture {
    /// The bytes of an RGB image with the opacity that renderers want beside them.
    pub fn new(color: &ColorImage, serial: u64) -> Self {
        let mut rgba = vec![255; color.bytes().len() / 3 * 4];
        for (rgba, rgb) in rgba.chunks_exact_mut(4).zip(color.bytes().chunks_exact(3)) {
            rgba[..3].copy_from_slice(rgb);
        }
        Self {
            size: [color.width(), color.height()],
            rgba,
            serial,
        }
    }
}

/// An image of a frame.
#[derive(Clone, Debug)]
pub enum Image {
    /// The frame's own.
    OfFrame(Arc<Scene>, usize),
    /// Another one.
    Own(Arc<ColorImage>),
}

impl Image {
    /// Width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        match self {
            Self::OfFrame(scene, frame) => {
                let camera = &scene.frames[*frame].camera;
                [camera.width, camera.height]
            }
            Self::Own(color) => [color.width(), color.height()],
        }
    }

    /// The image; `None` where a file would have to be read for it.
    pub fn color(&self) -> Option<Arc<ColorImage>> {
        match self {
            Self::OfFrame(scene, frame) => Some(scene.frames[*frame].pixels_at_hand()?.color),
            Self::Own(color) => Some(Arc::clone(color)),
        }
    }
}

/// A frame with what lies over it.
#[derive(Clone, Debug)]
pub struct Content {
    /// The image.
    pub image: Image,
    /// Never 0, and different for all images of this canvas.
    pub image_serial: u64,
    /// The image for the renderer; `None` while it is being made.
    pub picture: Option<Arc<Picture>>,
    /// What lies over it.
    pub over: Option<Over>,
    /// The frame's newest map, shown or not: its generation, frame and serial number.
    pub map: Option<(u64, usize, u64)>,
    /// The classes' colours.
    pub palette: Arc<Palette>,
    /// Changes with the palette.
    pub palette_serial: u64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_is_the_image_with_full_opacity() {
        let color = ColorImage::new(2, 1, vec![1, 2, 3, 4, 5, 6]).unwrap();
        let picture = Picture::new(&color, 9);
        assert_eq!(picture.rgba, [1, 2, 3, 255, 4, 5, 6, 255]);
        assert_eq!((picture.size, picture.serial), ([2, 1], 9));
    }
}
