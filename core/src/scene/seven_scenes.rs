//! One sequence of Microsoft's 7-Scenes (Shotton et al., CVPR 2013).
//!
//! - `frame-NNNNNN.color.png` (or JPEG)
//! - `frame-NNNNNN.depth.png`: 16 bit, millimetres along z, 0 and 65535 = none
//! - `frame-NNNNNN.pose.txt`: 4x4 camera-to-world, OpenCV axes, metres, a row a line
//! - `intrinsics.txt`, where there is one: `fx fy cx cy width height`

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::files::{file_name, warn};
use super::rgbd::text::{parse_pose, read_text};
use super::rgbd::{self, DepthCode, Layout, Listed};
use super::{OpenOptions, Scene, SceneError};

/// Name of the format.
pub(super) const NAME: &str = "7-Scenes";
/// What a folder in this format holds.
pub(super) const EXPECTED: &str =
    "frame-000000.color.png, frame-000000.depth.png and frame-000000.pose.txt, ... of one sequence";
/// The file that has the poses.
pub(super) const POSES: &str = "frame-N.pose.txt";

/// The intrinsics that the data set gives for its depth camera, pixels at 640 x 480.
const FOCAL: [f32; 2] = [585.0, 585.0];
const CENTER: [f32; 2] = [320.0, 240.0];

/// The files of a frame.
#[derive(Default)]
struct Files {
    color: Option<PathBuf>,
    depth: Option<PathBuf>,
    pose: Option<PathBuf>,
}

/// What a file of a frame is.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Color,
    Depth,
    Pose,
}

/// The number of the frame that a file belongs to, and what it is.
fn parse_name(name: &str) -> Option<(u64, Kind)> {
    let (number, kind) = name.strip_prefix("frame-")?.split_once('.')?;
    let kind = match kind.to_ascii_lowercase().as_str() {
        "color.png" | "color.jpg" | "color.jpeg" => Kind::Color,
        "depth.png" => Kind::Depth,
        "pose.txt" => Kind::Pose,
        _ => return None,
    };
    Some((number.parse().ok()?, kind))
}

/// Whether a folder looks like this format, complete or not.
pub(super) fn recognise(folder: &Path) -> bool {
    // A folder that cannot be listed is no sequence; opening it says so.
    std::fs::read_dir(folder).is_ok_and(|mut entries| {
        entries.any(|entry| {
            entry.is_ok_and(|entry| {
                let kind = parse_name(&entry.file_name().to_string_lossy()).map(|(_, kind)| kind);
                matches!(kind, Some(Kind::Color | Kind::Pose))
            })
        })
    })
}

/// Reads a folder in this format.
pub(super) fn read(
    folder: &Path,
    options: OpenOptions,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Scene, SceneError> {
    let mut warnings = Vec::new();
    let listed = list(folder, options, &mut warnings)?;
    let layout = Layout {
        format: NAME,
        folder,
        images: folder,
        depths: folder,
        depth_code: DepthCode {
            steps_per_metre: 1000.0,
            none: u16::MAX,
        },
        depth_camera: None,
        default_camera: &|width, height| rgbd::published_camera(FOCAL, CENTER, width, height),
        default_camera_note: Some(
            "no intrinsics.txt: taken were the data set's defaults, a focal length of 585 pixels at 640x480 and \
             the principal point in the middle, which are those of its depth camera; the colour camera was \
             not calibrated, so that depth can be some pixels beside the colours"
                .to_owned(),
        ),
    };
    rgbd::read(&layout, &listed, warnings, Vec::new(), options, progress)
}

/// The frames that have an image and a usable pose, by number.
fn list(folder: &Path, options: OpenOptions, warnings: &mut Vec<String>) -> Result<Vec<Listed>, SceneError> {
    let frames = find_files(folder)?;
    let (mut found, mut without_pose, mut without_image) = (Vec::new(), Vec::new(), Vec::new());
    for files in frames.into_values() {
        match (files.color, files.pose) {
            (Some(color), Some(pose)) => found.push((color, files.depth, pose)),
            (Some(color), None) => without_pose.push(file_name(&color)),
            (None, Some(pose)) => without_image.push(file_name(&pose)),
            (None, None) => {}
        }
    }
    for (missing, what) in [
        (&without_pose, "images have no .pose.txt"),
        (&without_image, "poses have no .color.png"),
    ] {
        if let Some(first) = missing.first().filter(|_| missing.len() > found.len()) {
            return Err(SceneError::file(
                folder,
                format!("{} {what}, first {first}; copy the sequence again", missing.len()),
            ));
        }
        warn(warnings, &format!("{what} and were left out"), missing);
    }
    let poses = found
        .par_iter()
        .map(|(_, _, pose)| parse_pose(pose, &read_text(pose)?))
        .collect::<Result<Vec<_>, SceneError>>()?;
    let total = found.len();
    let (mut listed, mut bad) = (Vec::new(), Vec::new());
    for ((path, depth, pose_file), pose) in found.into_iter().zip(poses) {
        match pose {
            Ok(camera_to_world) => listed.push(Listed {
                path,
                depth: depth.filter(|_| options.depth),
                camera_to_world,
            }),
            Err(problem) => bad.push(format!("that in {} ({problem})", file_name(&pose_file))),
        }
    }
    rgbd::check_poses(folder, &bad, total)?;
    warn(
        warnings,
        "frames were left out because their pose is unusable",
        &bad,
    );
    Ok(listed)
}

/// The files of each frame by its number.
fn find_files(folder: &Path) -> Result<BTreeMap<u64, Files>, SceneError> {
    let unreadable = |error: std::io::Error| SceneError::file(folder, format!("cannot be read: {error}"));
    let mut frames: BTreeMap<u64, Files> = BTreeMap::new();
    for entry in std::fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        let name = file_name(&path);
        let Some((number, kind)) = parse_name(&name) else {
            continue;
        };
        let files = frames.entry(number).or_default();
        let place = match kind {
            Kind::Color => &mut files.color,
            Kind::Depth => &mut files.depth,
            Kind::Pose => &mut files.pose,
        };
        if let Some(other) = place.replace(path) {
            return Err(SceneError::file(
                other,
                format!("is of the same frame as {name}; keep one of the two"),
            ));
        }
    }
    Ok(frames)
}
