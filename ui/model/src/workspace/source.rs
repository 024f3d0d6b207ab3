//! What a small picture of a frame is made from.

use std::sync::Arc;

use inplace_core::scene::Scene;
use inplace_core::session::FrameMap;

use super::Workspace;
use crate::layer::{Layer, Look};
use crate::palette::Palette;

/// What a small picture of a frame is made from.
#[derive(Clone, Debug)]
pub struct FrameSource {
    /// The scene.
    pub scene: Arc<Scene>,
    /// Index of the frame.
    pub frame: usize,
    /// The frame's newest map.
    pub map: Option<Arc<FrameMap>>,
    /// The classes' colours.
    pub palette: Arc<Palette>,
    /// How it is composed.
    pub look: Look,
}

impl FrameSource {
    /// A frame of the open scene as it is known now.
    pub fn new(workspace: &Workspace, frame: usize, look: Look) -> Self {
        let needs_map = look.layer != Layer::Color;
        Self {
            scene: Arc::clone(&workspace.scene),
            frame,
            map: needs_map.then(|| workspace.newest_map(frame)).flatten(),
            palette: Arc::clone(workspace.document.palette()),
            look,
        }
    }
}
