//! Writing the layout.

use std::collections::BTreeMap;
use std::fmt::{Display, Write as _};
use std::fs;
use std::path::{Path, PathBuf};

use glam::DVec3;
use image::ExtendedColorType;
use rayon::prelude::*;
use serde_json::json;

use crate::labels::{Class, ClassId};
use crate::scene::error::{refusal, refuse};
use crate::scene::{Camera, DepthMap, Frame, Scene, SceneError};

/// What is known to be true of a scene, for measuring against.
#[derive(Clone, Copy)]
pub struct GroundTruth<'a> {
    /// The classes, void not among them; ids up to 255.
    pub classes: &'a [Class],
    /// Classes of the pixels of the frame with this index, row-major `[height, width]`, 0 = void; from any thread.
    pub labels: &'a (dyn Fn(usize) -> Vec<ClassId> + Sync),
    /// The objects, where they are known too.
    pub objects: Option<TrueObjects<'a>>,
    /// Indices of the frames kept for testing; the others are for training.
    pub held_out: &'a [usize],
}

/// The true objects of a scene.
#[derive(Clone, Copy)]
pub struct TrueObjects<'a> {
    /// The class of each object, by its number from 1 on. All of a class that is stuff is one object.
    pub listed: &'a BTreeMap<u16, ClassId>,
    /// Objects of the pixels of the frame with this index, row-major `[height, width]`, 0 = void; from any thread.
    pub of_frame: &'a (dyn Fn(usize) -> Vec<u16> + Sync),
}

/// Writes a scene in the Replica layout into a new or empty folder; frame N of the scene becomes `rgb_N`.
///
/// With ground truth, also `semantic_class/semantic_class_N.png` (8 bit), `classes.json` and `split.json`; with objects
/// `semantic_instance/semantic_instance_N.png` (16 bit) and `objects.json`, a list of `{"id", "class_id", "class_name",
/// "thing"}`.
/// Everything is written under a temporary name beside the folder and renamed at the end: no half-written
/// scene is ever found under the folder's name.
///
/// # Errors
/// A folder that is not empty, frames with different cameras, ground truth that does not fit the scene, a
/// disk that cannot be written: a sentence that names the file.
pub fn write(scene: &Scene, folder: &Path, truth: Option<&GroundTruth<'_>>) -> Result<(), SceneError> {
    check(scene, folder)?;
    let exists = folder.exists();
    let is_empty = || fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_none());
    if exists && !is_empty() {
        refuse!(
            folder,
            "already exists and is not an empty folder; give the name of a new one"
        );
    }
    let Some(name) = folder.file_name() else {
        refuse!(folder, "is not a name for a new folder; give one");
    };
    let mut hidden = std::ffi::OsString::from(".");
    hidden.push(name);
    hidden.push(format!(".{}.partial", std::process::id()));
    let partial = Partial(folder.with_file_name(hidden));
    create_folder(&partial.0)?;
    write_files(scene, &partial.0, truth)?;
    if exists {
        fs::remove_dir(folder).map_err(|error| cannot_write(folder, &error))?;
    }
    fs::rename(&partial.0, folder).map_err(|error| cannot_write(folder, &error))
}

/// A folder that is removed unless it was renamed.
struct Partial(PathBuf);

impl Drop for Partial {
    fn drop(&mut self) {
        // After the rename there is nothing to remove; after a failure that one is reported already.
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Refuses what the layout cannot hold.
fn check(scene: &Scene, folder: &Path) -> Result<(), SceneError> {
    let Some(first) = scene.frames.first() else {
        refuse!(folder, "cannot be written: the scene has no frames");
    };
    if scene.frames.iter().any(|frame| frame.camera != first.camera) {
        refuse!(
            folder,
            "cannot be written: the layout holds one camera, and the scene's frames have several"
        );
    }
    Ok(())
}

/// The classes of a frame as the layout holds them.
fn label_bytes(folder: &Path, frame: &Frame, labels: &[ClassId]) -> Result<Vec<u8>, SceneError> {
    if labels.len() != frame.camera.pixels() {
        refuse!(
            folder,
            "cannot be written: the ground truth does not have one label for each pixel of each frame"
        );
    }
    let ids: Result<Vec<u8>, _> = labels.iter().map(|&id| u8::try_from(id)).collect();
    ids.map_err(|_| {
        refusal!(
            folder,
            "cannot be written: the layout holds class ids up to 255, and the ground truth has larger ones"
        )
    })
}

fn write_files(scene: &Scene, folder: &Path, truth: Option<&GroundTruth<'_>>) -> Result<(), SceneError> {
    let depth = scene.has_depth().then_some("depth");
    let labels = truth.map(|_| "semantic_class");
    let objects = truth.and_then(|truth| truth.objects);
    let instances = objects.map(|_| "semantic_instance");
    for name in [Some("rgb"), depth, labels, instances].into_iter().flatten() {
        create_folder(&folder.join(name))?;
    }
    scene
        .frames
        .par_iter()
        .enumerate()
        .try_for_each(|(number, frame)| {
            let (width, height) = (frame.camera.width, frame.camera.height);
            let save = |path: PathBuf, bytes: &[u8], kind: ExtendedColorType| {
                image::save_buffer(&path, bytes, width, height, kind)
                    .map_err(|error| cannot_write(&path, &error))
            };
            let pixels = frame.pixels()?;
            let rgb = folder.join(format!("rgb/rgb_{number}.png"));
            save(rgb, pixels.color.bytes(), ExtendedColorType::Rgb8)?;
            if let Some(depth) = pixels.depth {
                let millimetres = z_millimetres(frame, &depth);
                let depth = folder.join(format!("depth/depth_{number}.png"));
                save(depth, bytemuck::cast_slice(&millimetres), ExtendedColorType::L16)?;
            }
            if let Some(truth) = truth {
                let ids = label_bytes(folder, frame, &(truth.labels)(number))?;
                let labels = folder.join(format!("semantic_class/semantic_class_{number}.png"));
                save(labels, &ids, ExtendedColorType::L8)?;
            }
            if let Some(objects) = objects {
                let numbers = (objects.of_frame)(number);
                let images = folder.join(format!("semantic_instance/semantic_instance_{number}.png"));
                save(images, bytemuck::cast_slice(&numbers), ExtendedColorType::L16)?;
            }
            Ok(())
        })?;
    write_text(&folder.join("traj_w_c.txt"), &trajectory(scene))?;
    if let Some(frame) = scene.frames.first() {
        write_text(&folder.join("intrinsics.txt"), &intrinsics_line(&frame.camera))?;
    }
    if let Some(truth) = truth {
        write_text(
            &folder.join("classes.json"),
            &format!("{:#}\n", json!(truth.classes)),
        )?;
        if let Some(objects) = objects {
            let record = |(id, class_id): (&u16, &ClassId)| {
                let class = truth.classes.iter().find(|class| class.id == *class_id)?;
                Some(
                    json!({ "id": id, "class_id": class_id, "class_name": class.name, "thing": class.thing }),
                )
            };
            let listed: Vec<_> = objects.listed.iter().filter_map(record).collect();
            write_text(&folder.join("objects.json"), &format!("{:#}\n", json!(listed)))?;
        }
        let train: Vec<usize> = (0..scene.frames.len())
            .filter(|frame| !truth.held_out.contains(frame))
            .collect();
        let split = json!({ "train": train, "test": truth.held_out });
        write_text(&folder.join("split.json"), &format!("{split}\n"))?;
    }
    Ok(())
}

/// Depth along z in millimetres, row-major; 0 where it is unknown or beyond what 16 bits hold.
pub(crate) fn z_millimetres(frame: &Frame, depth: &DepthMap) -> Vec<u16> {
    let millimetres = (0..depth.len()).map(|index| {
        let Some(length) = depth.ray_length(index) else {
            return 0;
        };
        let z = (1000.0 * length / frame.camera.direction_at(index).length()).round();
        if z <= f32::from(u16::MAX) { z as u16 } else { 0 }
    });
    millimetres.collect()
}

/// One row-major 4x4 camera-to-world a line, in the capture's own coordinates and in metres.
fn trajectory(scene: &Scene) -> String {
    let mut text = String::new();
    for frame in &scene.frames {
        let rotation = frame.camera_to_world.matrix3;
        let rows = [0, 1, 2].map(|row| rotation.row(row).to_array());
        let position = scene.to_capture(frame.center()) / scene.unit;
        text.push_str(&pose_line(rows, position));
    }
    text
}

/// A line of `traj_w_c.txt`: a camera-to-world pose with these rows of its rotation, in metres.
pub(crate) fn pose_line<T: Display>(rotation: [[T; 3]; 3], position: DVec3) -> String {
    let mut text = String::new();
    for ([x, y, z], own) in rotation.iter().zip(position.to_array()) {
        // Writing to a string cannot fail.
        let _ = write!(text, "{x} {y} {z} {own} ");
    }
    text + "0 0 0 1\n"
}

/// What `intrinsics.txt` holds.
pub(crate) fn intrinsics_line(camera: &Camera) -> String {
    let focal = format!("{} {}", camera.fx, camera.fy);
    let principal = format!("{} {}", camera.cx, camera.cy);
    format!("{focal} {principal} {} {}\n", camera.width, camera.height)
}

fn create_folder(path: &Path) -> Result<(), SceneError> {
    fs::create_dir_all(path).map_err(|error| cannot_write(path, &error))
}

fn write_text(path: &Path, text: &str) -> Result<(), SceneError> {
    fs::write(path, text).map_err(|error| cannot_write(path, &error))
}

fn cannot_write(path: &Path, error: &dyn Display) -> SceneError {
    refusal!(
        path,
        "cannot be written ({error}); give a folder on a disk with space and write access"
    )
}
