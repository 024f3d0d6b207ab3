//! Captures in which the pose of each frame has a file of its own.

use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::text::read_pose;
use super::{Found, unusable_poses};
use crate::scene::files::{file_name, leave_out};
use crate::scene::{OpenOptions, SceneError};

/// The files of a frame, as far as they are there.
#[derive(Default)]
pub(in crate::scene) struct FrameFiles {
    /// The colour image.
    pub color: Option<PathBuf>,
    /// The depth image.
    pub depth: Option<PathBuf>,
    /// The pose: four lines of four numbers, camera-to-world, OpenCV axes, metres.
    pub pose: Option<PathBuf>,
}

/// Where a layout has these files, and what it says of those that are missing.
pub(in crate::scene) struct Places<'a> {
    /// The capture.
    pub folder: &'a Path,
    /// Folder of the poses, for messages.
    pub poses: &'a Path,
    /// What images without a pose are.
    pub without_pose: &'a str,
    /// What poses without an image are.
    pub without_image: &'a str,
    /// What to do where most frames lack either.
    pub remedy: &'a str,
    /// What to say of the frames whose pose is unusable.
    pub unusable: &'a str,
}

/// Those of the frames that have an image and a usable pose, with their depth where it is wanted; the others are left
/// out and counted, up to half of them.
///
/// # Errors
/// More than that, or a file that holds no pose.
pub(in crate::scene) fn list(
    places: &Places,
    frames: impl IntoIterator<Item = FrameFiles>,
    options: OpenOptions,
    warnings: &mut Vec<String>,
) -> Result<Vec<Found>, SceneError> {
    let (mut found, mut without_pose, mut without_image) = (Vec::new(), Vec::new(), Vec::new());
    for files in frames {
        match (files.color, files.pose) {
            (Some(color), Some(pose)) => found.push((color, files.depth, pose)),
            (Some(color), None) => without_pose.push(file_name(&color)),
            (None, Some(pose)) => without_image.push(file_name(&pose)),
            (None, None) => {}
        }
    }
    for (missing, what) in [
        (&without_pose, places.without_pose),
        (&without_image, places.without_image),
    ] {
        let total = found.len() + missing.len();
        let left_out = format!("{what} and were left out");
        leave_out(
            warnings,
            places.folder,
            (missing, total),
            &left_out,
            |count, first| format!("{count} {what}, first {first}; {}", places.remedy),
        )?;
    }
    let poses = found
        .par_iter()
        .map(|(_, _, pose)| read_pose(pose))
        .collect::<Result<Vec<_>, SceneError>>()?;
    let total = found.len();
    let (mut listed, mut bad) = (Vec::new(), Vec::new());
    for ((path, depth, pose_file), pose) in found.into_iter().zip(poses) {
        match pose {
            Ok(camera_to_world) => listed.push(Found {
                path,
                depth: depth.filter(|_| options.depth),
                camera_to_world,
            }),
            Err(problem) => bad.push(format!("that in {} ({problem})", file_name(&pose_file))),
        }
    }
    leave_out(
        warnings,
        places.poses,
        (&bad, total),
        places.unusable,
        |count, first| unusable_poses(count, total, first),
    )?;
    Ok(listed)
}
