//! The embedded demo: a furnished room, ray-cast when it is asked for, with exact depth and labels.
//!
//! World axes: x along the room (5 m), y across it (4 m), z up; metres. Nothing here depends on the clock or
//! on chance: every call gives the same room, pictures and clicks.

mod build;
mod cast;
mod click;
mod furniture;
mod light;
mod material;
mod path;
mod render;
mod room;
mod solid;
#[cfg(test)]
mod tests;

use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use super::{Camera, ColorImage, DepthMap, Frame, Scene, SceneSource};
use crate::labels::{Class, ClassId, LabelSet};
use light::LightMap;
use render::View;
use room::Room;

/// Image size of the demo's frames, in pixels.
const SIZE: (u32, u32) = (320, 240);
/// Horizontal field of view of the demo's camera, in degrees.
const FIELD_OF_VIEW: f32 = 78.0;

fn camera() -> Camera {
    Camera::with_horizontal_fov(SIZE.0, SIZE.1, FIELD_OF_VIEW)
}

fn view(room: &Room, frame: usize) -> View<'_> {
    View {
        caster: &room.caster,
        camera: camera(),
        camera_to_world: path::pose(frame),
    }
}

/// Renders the demo scene, depth included; `progress` is called with (frames done, frames in all), from any
/// thread.
pub fn scene(progress: &(dyn Fn(usize, usize) + Sync)) -> Scene {
    progress(0, path::FRAMES);
    let room = room::room();
    let light = LightMap::new(&room.caster, &room.panes, &room.bulbs);
    let done = AtomicUsize::new(0);
    let frames = (0..path::FRAMES)
        .into_par_iter()
        .map(|index| {
            let frame = render_frame(&room, &light, index);
            progress(1 + done.fetch_add(1, Ordering::Relaxed), path::FRAMES);
            frame
        })
        .collect();
    Scene {
        source: SceneSource::Demo,
        format: "demo",
        frames,
        origin: DVec3::ZERO,
        unit: 1.0,
        warnings: Vec::new(),
        notes: Vec::new(),
    }
}

fn render_frame(room: &Room, light: &LightMap, index: usize) -> Frame {
    let view = view(room, index);
    let (rgb, lengths) = view.render(light);
    let (width, height) = SIZE;
    // `render` gives three bytes for each pixel of the camera: the image always exists.
    let color = ColorImage::new(width, height, rgb).unwrap_or_else(|| unreachable!());
    let pose = view.camera_to_world;
    Frame {
        stem: format!("rgb_{index}"),
        path: PathBuf::new(),
        camera: view.camera,
        camera_to_world: glam::Affine3A::from_mat3_translation(
            pose.matrix3.as_mat3(),
            pose.translation.as_vec3(),
        ),
        color,
        depth: Some(DepthMap::from_ray_lengths(width, &lengths)),
        points: Vec::new(),
        lens: None,
    }
}

/// The demo's classes, ids from 1.
pub fn classes() -> Vec<Class> {
    room::CLASSES
        .iter()
        .zip(1..)
        .map(|(&(name, color), id)| Class {
            id,
            name: name.to_owned(),
            color: [(color >> 16) as u8, (color >> 8) as u8, color as u8],
        })
        .collect()
}

/// True classes of every frame, row-major `[height, width]` each, at the pixel centres.
pub fn ground_truth() -> Vec<Vec<ClassId>> {
    let room = room::room();
    (0..path::FRAMES)
        .into_par_iter()
        .map(|frame| view(&room, frame).labels())
        .collect()
}

/// Frames kept for testing: every second one. [`clicks`] are on the others.
pub fn held_out() -> Vec<usize> {
    (0..path::FRAMES).filter(|frame| frame % 2 == 1).collect()
}

/// Clicks that a sensible person would make: up to three pixels a class, well inside it and far apart.
pub fn clicks() -> LabelSet {
    let room = room::room();
    click::clicks(&room, classes())
}
