//! The Replica / Semantic-NeRF layout.
//!
//! - `rgb/rgb_N.png` (or any PNG or JPEG whose name ends in a number N)
//! - `traj_w_c.txt`: line N, counted from 0, is the row-major 4x4 camera-to-world of frame N, OpenCV axes
//! - `depth/depth_N.png`, where there is depth: 16 bit, millimetres along z, 0 = none
//! - `intrinsics.txt`: `fx fy cx cy width height`; without it, 90 degrees of horizontal field of view and the
//!   principal point in the middle, as in Semantic-NeRF

mod write;

use super::depth::DepthImages;
use super::error::{refusal, refuse};
use super::files::{file_name, leave_out, numbered_files, warn};
use super::formats::Format;
use super::reading::Progress;
use super::rgbd::text::{parse_numbers, pose_of, read_text};
use super::rgbd::{self, Found, Layout};
use super::{Camera, OpenOptions, Scene, SceneError, colmap, transforms};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
pub use write::{GroundTruth, TrueObjects, write};
pub(crate) use write::{intrinsics_line, pose_line, z_millimetres};

/// The format.
pub(super) const FORMAT: Format = Format {
    name: "Replica",
    expected: "colour images rgb/rgb_N.png with one camera-to-world matrix a line in traj_w_c.txt",
    poses: "traj_w_c.txt",
    recognise,
    read,
};

/// Horizontal field of view of captures without `intrinsics.txt`, in degrees.
const DEFAULT_FIELD_OF_VIEW: f32 = 90.0;

/// Whether a folder looks like this layout, complete or not.
fn recognise(folder: &Path) -> bool {
    // A folder named rgb is also what a transforms.json or the rgb.txt of TUM RGB-D may list images in, and it may lie
    // beside the images of a COLMAP model.
    let has_poses_elsewhere =
        || transforms::recognise(folder) || folder.join("rgb.txt").is_file() || colmap::recognise(folder);
    folder.join("traj_w_c.txt").is_file() || (folder.join("rgb").is_dir() && !has_poses_elsewhere())
}

/// Reads a folder in this layout.
fn read(folder: &Path, options: OpenOptions, progress: Progress) -> Result<Scene, SceneError> {
    let mut warnings = Vec::new();
    let images = list_images(&folder.join("rgb"), &mut warnings)?;
    let depths = rgbd::depths(folder, options)?;
    let listed = with_poses(folder, images, &depths, &mut warnings)?;
    let layout = Layout {
        format: FORMAT.name,
        folder,
        images: &folder.join("rgb"),
        depths: &folder.join("depth"),
        depth: DepthImages::MILLIMETRES,
        default_camera: &|width, height| {
            Ok(Camera::with_horizontal_fov(width, height, DEFAULT_FIELD_OF_VIEW))
        },
        default_camera_note: None,
    };
    rgbd::read(&layout, listed, warnings, Vec::new(), options, progress)
}

/// The colour images by number.
fn list_images(rgb: &Path, warnings: &mut Vec<String>) -> Result<BTreeMap<usize, PathBuf>, SceneError> {
    if !rgb.is_dir() {
        refuse!(
            rgb,
            "no such folder; put the colour images there, as rgb_0.png, rgb_1.png, ..."
        );
    }
    let mut unnumbered = Vec::new();
    let images = numbered_files(rgb, &["png", "jpg", "jpeg"], &mut unnumbered)?;
    if images.is_empty() {
        refuse!(
            rgb,
            "holds no PNG or JPEG whose name ends in a number; put the colour images there, as rgb_0.png, rgb_1.png, ..."
        );
    }
    warn(
        warnings,
        "colour images without a number in their name were left out",
        &unnumbered,
    );
    Ok(images)
}

/// Reads a trajectory; empty lines and lines starting with # do not count as frames.
fn read_poses(path: &Path) -> Result<Vec<LineOfPose>, SceneError> {
    if !path.exists() {
        refuse!(
            path,
            "no such file; write the camera-to-world matrix of each frame there, 16 numbers a line"
        );
    }
    parse_poses(path, &read_text(path)?)
}

/// A line of the trajectory, from 1, and the 4x4 matrix on it, row by row.
type LineOfPose = (usize, [f64; 16]);

/// The poses in the text of the trajectory at `path`.
pub(super) fn parse_poses(path: &Path, text: &str) -> Result<Vec<LineOfPose>, SceneError> {
    let mut poses = Vec::new();
    for (line, values) in parse_numbers(path, text)? {
        let count = values.len();
        let values = values.try_into().map_err(|_| {
            refusal!(
                path,
                "line {line} has {count} numbers; a pose is 16, a 4x4 matrix row by row"
            )
        })?;
        poses.push((line, values));
    }
    if poses.is_empty() {
        refuse!(
            path,
            "holds no poses; write the camera-to-world matrix of each frame there, 16 numbers a line"
        );
    }
    Ok(poses)
}

/// Gives each image its pose; those without a usable one are left out and counted.
fn with_poses(
    folder: &Path,
    images: BTreeMap<usize, PathBuf>,
    depths: &BTreeMap<usize, PathBuf>,
    warnings: &mut Vec<String>,
) -> Result<Vec<Found>, SceneError> {
    let trajectory = folder.join("traj_w_c.txt");
    let poses = read_poses(&trajectory)?;
    let without_pose = images.range(poses.len()..).map(|(_, path)| file_name(path));
    let without_pose: Vec<String> = without_pose.collect();
    if let Some(first) = too_many(&without_pose, images.len()) {
        refuse!(
            trajectory,
            "has {} poses, but {} of the {} images need a later line ({first} is the first); write one pose a line, \
             line N for rgb_N counted from 0",
            poses.len(),
            without_pose.len(),
            images.len()
        );
    }
    let what = "images without a pose in traj_w_c.txt were left out";
    warn(warnings, what, &without_pose);
    let without_image = (0..poses.len()).filter(|number| !images.contains_key(number));
    let without_image: Vec<String> = without_image.map(|number| format!("frame {number}")).collect();
    if let Some(first) = too_many(&without_image, poses.len()) {
        refuse!(
            trajectory,
            "has {} poses, but rgb/ has no image for {} of them ({first} is the first); restore the images, or remove \
             the lines and number the images anew",
            poses.len(),
            without_image.len()
        );
    }
    warn(warnings, "poses have no image in rgb/", &without_image);

    let mut listed = Vec::new();
    let mut bad = Vec::new();
    for (number, path) in images {
        match poses.get(number).map(|(line, values)| (line, pose_of(values))) {
            Some((_, Ok(camera_to_world))) => listed.push(Found {
                path,
                depth: depths.get(&number).cloned(),
                camera_to_world,
            }),
            Some((line, Err(problem))) => bad.push(format!("line {line} ({problem})")),
            None => {}
        }
    }
    let total = bad.len() + listed.len();
    let what = "frames were left out because their pose in traj_w_c.txt is unusable";
    leave_out(warnings, &trajectory, (&bad, total), what, |count, first| {
        format!(
            "{count} of {total} poses are unusable, first on {first}; each line must be a rigid camera-to-world matrix, \
             row by row, in metres"
        )
    })?;
    Ok(listed)
}

/// The first of those that lack something, where they are more than a small remainder of `total`: a tenth, or one.
fn too_many(lacking: &[String], total: usize) -> Option<&String> {
    let is_few = lacking.len() < total && lacking.len() <= (total / 10).max(1);
    lacking.first().filter(|_| !is_few)
}

#[cfg(test)]
mod tests;
