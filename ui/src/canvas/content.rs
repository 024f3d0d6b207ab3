//! What the canvas shows, with a version of each part so that only changes are uploaded.

use std::sync::Arc;

use inplace_core::scene::ColorImage;
use inplace_core::session::FrameMap;
use inplace_model::layer::Layer;
use inplace_model::palette::Palette;
use inplace_model::versioned::{Version, Versioned};

use super::plane::{Over, Texels};

/// A map that is looked up.
#[derive(Clone, Debug)]
pub struct ShownMap {
    /// The map, with the version that it came with.
    pub map: Versioned<Arc<FrameMap>>,
    /// Version of its entropies as what lies over the image.
    entropy: Version,
}

impl ShownMap {
    /// A map that is looked up.
    pub fn new(map: Versioned<Arc<FrameMap>>) -> Self {
        Self {
            map,
            entropy: Version::new(),
        }
    }

    /// What a layer lays over the image that needs nothing but the map.
    pub fn over(&self, layer: Layer, palette: &Palette) -> Option<Over> {
        let map = Arc::clone(&self.map);
        let size = [map.width, map.height];
        match layer {
            Layer::Labels => Some(Over::classes(size, Texels::Labels(map), self.map.version())),
            Layer::Entropy => Some(Over::entropy(size, Texels::Entropy(map), self.entropy, palette)),
            _ => None,
        }
    }
}

/// An image for the renderers.
#[derive(Debug)]
pub struct Picture {
    /// The image.
    pub color: Arc<ColorImage>,
    /// The same as a GPU wants it: RGBA, row-major `[height, width, 4]`.
    pub rgba: Vec<u8>,
    /// Different for every picture.
    pub version: Version,
}

impl Picture {
    /// The bytes of an RGB image with the opacity that renderers want beside them.
    pub fn new(color: Arc<ColorImage>) -> Self {
        let mut rgba = vec![255; color.bytes().len() / 3 * 4];
        for (rgba, rgb) in rgba.chunks_exact_mut(4).zip(color.bytes().chunks_exact(3)) {
            rgba[..3].copy_from_slice(rgb);
        }
        Self {
            color,
            rgba,
            version: Version::new(),
        }
    }
}

/// A frame with what lies over it.
#[derive(Clone, Debug)]
pub struct Content {
    /// The image; `None` while it is being made.
    pub picture: Option<Arc<Picture>>,
    pub over: Option<Over>,
    /// The frame's newest map, shown or not.
    pub map: Option<Versioned<Arc<FrameMap>>>,
    /// The colours of the classes, or of what lies over the image in their place.
    pub palette: Versioned<Arc<Palette>>,
}
