//! What the 3D view of a scene shows, and the camera that looks at it.
//!
//! Camera axes are OpenCV's (x right, y down, z forward), lengths are metres.

use glam::{Quat, Vec2, Vec3};
use inplace_core::scene::Frame;

/// Half of the angle that the shorter side of the view spans, in radians.
pub const HALF_FIELD_OF_VIEW: f32 = 0.48;
/// Nearest and farthest distance from the eye to the pivot, in metres.
const DISTANCES: (f32, f32) = (0.1, 500.0);
/// The camera never looks straight up or down, where left and right would swap.
const STEEPEST: f32 = 1.55;
/// Radians that a drag over a point of the screen turns the scene by.
const TURN_PER_POINT: f32 = 0.006;

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
    pub camera: Option<OrbitCamera>,
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

    /// The camera, which fits all of `ball` into the view until somebody has moved it.
    pub fn camera_or_fitted(&self, ball: Ball, level: Quat) -> OrbitCamera {
        self.camera
            .unwrap_or_else(|| OrbitCamera::fitted(ball, self.direction, level))
    }
}

/// A ball around what is to be seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// Its centre, in metres.
    pub center: Vec3,
    /// Its radius, in metres.
    pub radius: f32,
}

/// Which way the camera looks, relative to level axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direction {
    /// Turn to the right, in radians.
    pub yaw: f32,
    /// Turn upwards, in radians.
    pub pitch: f32,
}

impl Default for Direction {
    /// From above, over the corner of a room.
    fn default() -> Self {
        Self {
            yaw: 0.6,
            pitch: -0.75,
        }
    }
}

impl Direction {
    /// That of a unit vector of the world.
    fn along(level: Quat, forward: Vec3) -> Self {
        let forward = level.inverse() * forward;
        Self {
            yaw: forward.x.atan2(forward.z),
            pitch: (-forward.y).clamp(-1.0, 1.0).asin().clamp(-STEEPEST, STEEPEST),
        }
    }

    fn rotation(self, level: Quat) -> Quat {
        level * Quat::from_rotation_y(self.yaw) * Quat::from_rotation_x(self.pitch)
    }
}

/// A camera that looks at a pivot from a distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrbitCamera {
    /// What it looks at and turns around, in metres.
    pub pivot: Vec3,
    /// From the eye to the pivot, in metres.
    pub distance: f32,
    /// Which way it looks.
    pub direction: Direction,
    /// Level axes to world.
    pub level: Quat,
}

impl OrbitCamera {
    /// Looks at all of a ball.
    pub fn fitted(ball: Ball, direction: Direction, level: Quat) -> Self {
        let distance = ball.radius / HALF_FIELD_OF_VIEW.sin();
        Self {
            pivot: ball.center,
            distance: distance.clamp(DISTANCES.0, DISTANCES.1),
            direction,
            level,
        }
    }

    /// Stands where a frame was taken and looks the same way, at what is this far away; the horizon stays level.
    pub fn at_frame(frame: &Frame, level: Quat, distance: f32) -> Self {
        let forward = Vec3::from(frame.camera_to_world.matrix3.z_axis).normalize_or(Vec3::Z);
        let direction = Direction::along(level, forward);
        let distance = distance.clamp(DISTANCES.0, DISTANCES.1);
        let forward = direction.rotation(level) * Vec3::Z;
        Self {
            pivot: frame.center() + distance * forward,
            distance,
            direction,
            level,
        }
    }

    /// Camera axes to world.
    pub fn rotation(&self) -> Quat {
        self.direction.rotation(self.level)
    }

    /// Where the camera is.
    pub fn eye(&self) -> Vec3 {
        self.pivot - self.distance * (self.rotation() * Vec3::Z)
    }

    /// Turns around the pivot, as a drag over so many points of the screen asks for.
    pub fn orbit(&mut self, drag: Vec2) {
        let yaw = self.direction.yaw + TURN_PER_POINT * drag.x;
        self.direction.yaw = yaw.rem_euclid(std::f32::consts::TAU);
        let pitch = self.direction.pitch - TURN_PER_POINT * drag.y;
        self.direction.pitch = pitch.clamp(-STEEPEST, STEEPEST);
    }

    /// Moves sideways so that the pivot follows a drag over so many points of the screen; `focal` is the focal length
    /// in points.
    pub fn pan(&mut self, drag: Vec2, focal: f32) {
        self.pivot -= self.rotation() * (self.distance / focal * drag.extend(0.0));
    }

    /// Comes `factor` times as near; what is at the pivot's depth and `aside` points from the middle of the view stays
    /// there.
    pub fn zoom(&mut self, aside: Vec2, focal: f32, factor: f32) {
        let distance = (self.distance / factor).clamp(DISTANCES.0, DISTANCES.1);
        let moved = 1.0 - distance / self.distance;
        self.pivot += self.rotation() * (moved * self.distance / focal * aside.extend(0.0));
        self.distance = distance;
    }

    /// A camera on the way to another: `share` 0 is this one and 1 the other. The eye moves along a straight line.
    pub fn towards(&self, other: &Self, share: f32) -> Self {
        let mix = |a: f32, b: f32| a + share * (b - a);
        let turn = (other.direction.yaw - self.direction.yaw + std::f32::consts::PI)
            .rem_euclid(std::f32::consts::TAU)
            - std::f32::consts::PI;
        let direction = Direction {
            yaw: self.direction.yaw + share * turn,
            pitch: mix(self.direction.pitch, other.direction.pitch),
        };
        let distance = mix(self.distance, other.distance);
        let eye = self.eye().lerp(other.eye(), share);
        let pivot = eye + distance * (direction.rotation(other.level) * Vec3::Z);
        Self {
            pivot,
            distance,
            direction,
            level: other.level,
        }
    }
}
