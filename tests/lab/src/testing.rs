//! A small capture with ground truth for the tests of measurements.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::{Args, Parser};
use glam::{Affine3A, Vec3};
use inplace_core::field::Preset;
use inplace_core::labels::{Class, ClassId};
use inplace_core::scene::{
    Camera, ColorImage, DepthMap, Frame, GroundTruth, OpenOptions, Pixels, Scene, SceneSource, write_replica,
};
use inplace_core::session::SessionOptions;
use tempfile::TempDir;

/// A command's arguments alone.
#[derive(Parser)]
struct Only<A: Args> {
    #[command(flatten)]
    own: A,
}

/// The arguments of a command, by the words behind its name.
pub fn parsed<A: Args>(words: &str) -> A {
    let words = ["lab"].into_iter().chain(words.split(' '));
    Only::<A>::try_parse_from(words).unwrap().own
}

/// A quick session on a capture.
pub fn options(source: SceneSource) -> SessionOptions {
    SessionOptions {
        source,
        open: OpenOptions::default(),
        preset: Preset::Fast,
        threads: 2,
        seed: 4,
        views: false,
        first_look: false,
        features: None,
        state: None,
    }
}

/// Opens a capture.
pub fn opened(folder: &Path) -> Arc<Scene> {
    let source = SceneSource::Folder(folder.to_path_buf());
    Arc::new(Scene::open(&source, OpenOptions::default(), &|_, _| {}).unwrap())
}

/// A wall two metres away, dark where x < 0 and bright elsewhere, seen by cameras side by side, the
/// first at x = -0.2 m and the last at x = 0.2 m, with depth and a horizontal field of view of 90 degrees.
pub fn wall(frames: usize, width: u32, height: u32) -> Scene {
    let camera = Camera::with_horizontal_fov(width, height, 90.0);
    let frames = (0..frames).map(|number| {
        let x = -0.2 + 0.4 * number as f32 / (frames - 1).max(1) as f32;
        let gray = |index| {
            let direction = camera.pixel_direction(index % width, index / width);
            if x + 2.0 * direction.x > 0.0 { 220 } else { 40 }
        };
        let rgb = (0..camera.pixels() as u32).flat_map(|index| [gray(index); 3]);
        let color = ColorImage::new(width, height, rgb.collect()).unwrap();
        let depth = DepthMap::from_z_depths(&camera, vec![2.0; camera.pixels()]);
        Frame {
            stem: format!("rgb_{number}"),
            path: PathBuf::new(),
            camera,
            camera_to_world: Affine3A::from_translation(Vec3::new(x, 0.0, 0.0)),
            pixels: Pixels::new(color, Some(depth)).into(),
            points: Vec::new(),
            lens: None,
        }
    });
    Scene::new(SceneSource::Demo, "test", frames.collect())
}

/// Writes a capture named "wall", in a folder that is removed in the end: six frames of a wall that is dark on the left and
/// bright on the right, the classes 1 and 2; every other frame is held out.
pub fn capture() -> (TempDir, PathBuf) {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("wall");
    let classes = [Class::new(1, "dark"), Class::new(2, "bright")];
    let scene = wall(6, 64, 48);
    let labels = |frame: &Frame| -> Vec<ClassId> {
        let class = |pixel| classes[usize::from(frame.color().pixel(pixel)[0] > 128)].id;
        (0..frame.camera.pixels()).map(class).collect()
    };
    let labels: Vec<Vec<ClassId>> = scene.frames.iter().map(labels).collect();
    let truth = GroundTruth {
        classes: &classes,
        labels: &|frame| labels[frame].clone(),
        objects: None,
        held_out: &[1, 3, 5],
    };
    write_replica(&scene, &folder, Some(&truth)).unwrap();
    (root, folder)
}
