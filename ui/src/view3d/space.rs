//! What the 3D view of a scene shows.

use glam::Quat;

use super::camera::{Ball, Direction, OrbitCamera};

/// What the 3D view of a scene shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Space {
    /// Whether it is shown in place of the frame.
    pub shown: bool,
    /// Whether what faces away is left out.
    pub see_through: bool,
    /// Whether the cameras of the frames are drawn.
    pub cameras: bool,
    /// `None` = all of the scene is fitted into the view.
    pub(super) camera: Option<OrbitCamera>,
    /// Where a fitted view looks.
    direction: Direction,
}

impl Default for Space {
    fn default() -> Self {
        Self {
            shown: false,
            see_through: true,
            cameras: true,
            camera: None,
            direction: Direction::default(),
        }
    }
}

impl Space {
    /// Shows all of the scene from the side that it is looked at from.
    pub fn fit(&mut self) {
        if let Some(camera) = self.camera.take() {
            self.direction = camera.direction;
        }
    }

    /// The camera; `None` while all of the scene is fitted into the view.
    pub fn camera(&self) -> Option<&OrbitCamera> {
        self.camera.as_ref()
    }

    pub(super) fn camera_or_fitted(&self, ball: Ball, level: Quat) -> OrbitCamera {
        self.camera
            .unwrap_or_else(|| OrbitCamera::fitted(ball, self.direction, level))
    }
}
