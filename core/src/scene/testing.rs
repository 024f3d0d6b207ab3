//! A small capture for the core's own tests.

use std::path::PathBuf;

use glam::{Affine3A, DVec3, Vec3};

use super::{Camera, ColorImage, DepthMap, Frame, Scene, SceneSource};

/// A wall two metres away, dark where x < 0 and bright elsewhere, seen by cameras side by side, the
/// first at x = -0.2 m and the last at x = 0.2 m, with depth and a horizontal field of view of 90 degrees.
pub fn wall(frames: usize, width: u32, height: u32) -> Scene {
    let camera = Camera::with_horizontal_fov(width, height, 90.0);
    let frames = (0..frames)
        .map(|number| {
            let x = -0.2 + 0.4 * number as f32 / (frames - 1).max(1) as f32;
            let mut rgb = Vec::new();
            for index in 0..camera.pixels() as u32 {
                let direction = camera.pixel_direction(index % width, index / width);
                let bright = x + 2.0 * direction.x > 0.0;
                rgb.extend([if bright { 220 } else { 40 }; 3]);
            }
            Frame {
                stem: format!("rgb_{number}"),
                path: PathBuf::new(),
                camera,
                camera_to_world: Affine3A::from_translation(Vec3::new(x, 0.0, 0.0)),
                color: ColorImage::new(width, height, rgb).unwrap(),
                depth: Some(DepthMap::from_z_depths(&camera, vec![2.0; camera.pixels()])),
                points: Vec::new(),
                lens: None,
            }
        })
        .collect();
    Scene {
        source: SceneSource::Demo,
        format: "test",
        frames,
        origin: DVec3::ZERO,
        unit: 1.0,
        warnings: Vec::new(),
        notes: Vec::new(),
    }
}
