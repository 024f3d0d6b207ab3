//! What the unit tests look at.

use inplace_core::scene::{Camera, ColorImage, Frame, Pixels, Scene, SceneSource};

/// A scene with a frame for each image, called 0, 1, ..., all taken from the origin with a horizontal field of view of
/// 90 degrees.
pub fn scene(images: impl IntoIterator<Item = ColorImage>) -> Scene {
    let frame = |(index, color): (usize, ColorImage)| Frame {
        stem: index.to_string(),
        path: Default::default(),
        camera: Camera::with_horizontal_fov(color.width(), color.height(), 90.0),
        camera_to_world: Default::default(),
        pixels: Pixels::new(color, None).into(),
        points: Vec::new(),
        lens: None,
    };
    let frames = images.into_iter().enumerate().map(frame);
    Scene::new(SceneSource::Demo, "test", frames.collect())
}
