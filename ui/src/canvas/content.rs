//! What the canvas shows, with a serial number for each part so that only changes are uploaded.

use std::sync::Arc;

use inplace_core::scene::{ColorImage, Scene};
use inplace_core::session::FrameMap;

use super::palette::Palette;

/// A map with a number that no other map has.
#[derive(Clone, Debug)]
pub struct ShownMap {
    /// The map.
    pub map: Arc<FrameMap>,
    /// Never 0, and different for every map.
    pub serial: u64,
}

/// A frame with its map and colours.
#[derive(Clone, Debug)]
pub struct Content {
    scene: Arc<Scene>,
    frame: usize,
    /// Changes with the frame and the scene.
    pub(super) color_serial: u64,
    /// The frame's newest map.
    pub(super) map: Option<ShownMap>,
    /// The classes' colours.
    pub(super) palette: Arc<Palette>,
    /// Changes with the palette.
    pub(super) palette_serial: u64,
}

impl Content {
    /// A frame of a scene; `None` when there is no such frame. `scene_serial` tells scenes apart.
    pub fn new(
        scene: &Arc<Scene>,
        scene_serial: u64,
        frame: usize,
        map: Option<ShownMap>,
        (palette, palette_serial): (&Arc<Palette>, u64),
    ) -> Option<Self> {
        scene.frames.get(frame)?;
        Some(Self {
            scene: Arc::clone(scene),
            frame,
            color_serial: (scene_serial << 32) | frame as u64,
            map,
            palette: Arc::clone(palette),
            palette_serial,
        })
    }

    /// The frame's colour image.
    pub(super) fn image(&self) -> &ColorImage {
        &self.scene.frames[self.frame].color
    }
}
