//! The camera's way through the room.

use std::f64::consts::TAU;

use glam::{DAffine3, DMat3, DVec3};

/// Number of frames of a round, and of the demo unless more are asked for.
pub(super) const FRAMES: usize = 60;

/// Camera-to-world in a room at a time, in frames of the demo: round after round at eye height, looking across the
/// room, up and down in turn. Later rounds drift: nearer to the middle, higher or lower, looking more to one side.
/// A mirrored room is gone through on the mirrored way.
pub(super) fn pose(time: f64, room_to_world: &DAffine3) -> DAffine3 {
    let turn = TAU * time / FRAMES as f64;
    let later = (time - (FRAMES - 1) as f64).max(0.0) / FRAMES as f64;
    let radius = 1.0 - 0.15 * (1.0 - (1.1 * later).cos());
    let eye = DVec3::new(
        2.5 + radius * 1.15 * turn.cos(),
        1.9 + radius * 0.8 * turn.sin(),
        1.5 + 0.12 * (2.0 * turn).sin() + 0.2 * (0.9 * later).sin(),
    );
    let yaw = turn + 0.5 * TAU + 0.1 - 0.3 * (2.0 * turn + 0.3).sin() + 0.4 * (0.7 * later).sin();
    let pitch = (-17.0 + 15.0 * (5.0 * turn).sin()).to_radians();
    let forward = DVec3::new(yaw.cos() * pitch.cos(), yaw.sin() * pitch.cos(), pitch.sin());
    look(
        room_to_world.transform_point3(eye),
        room_to_world.transform_vector3(forward),
    )
}

/// Camera-to-world with OpenCV axes, upright in a world whose z axis points up.
fn look(eye: DVec3, forward: DVec3) -> DAffine3 {
    let right = forward.cross(DVec3::Z).normalize();
    let down = forward.cross(right);
    DAffine3::from_mat3_translation(DMat3::from_cols(right, down, forward), eye)
}
