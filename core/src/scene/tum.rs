//! One sequence of the TUM RGB-D benchmark (Sturm et al., IROS 2012), or in its layout.
//!
//! - `rgb.txt`: `time file` of each colour image
//! - `depth.txt`, where there is depth: `time file` of each depth image, 16 bit, 5000 to the metre along z,
//!   0 = none
//! - `groundtruth.txt`: `time tx ty tz qx qy qz qw`, camera-to-world, OpenCV axes, metres
//! - `intrinsics.txt`, where there is one: `fx fy cx cy width height`
//!
//! Times are in seconds; what is nearest in time belongs together.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use glam::{DAffine3, DMat3, DQuat, DVec3};

use super::camera::rigid;
use super::depth::DepthImages;
use super::error::{NO_QUATERNION, NOT_FINITE, refuse};
use super::files::{check_name, file_name, leave_out, stem, warn};
use super::formats::Format;
use super::reading::Progress;
use super::rgbd::text::{parse_numbers, read_text};
use super::rgbd::{self, Found, Layout};
use super::{OpenOptions, Scene, SceneError};

/// The format.
pub(super) const FORMAT: Format = Format {
    name: "TUM RGB-D",
    expected: "rgb.txt, depth.txt and groundtruth.txt",
    poses: "groundtruth.txt",
    recognise,
    read,
};

/// Largest difference in time of what belongs together, in seconds, as in the benchmark's own tools.
const MOST_APART: f64 = 0.02;
/// Largest deviation of a quaternion's length from 1; they are written with four decimals.
const MOST_STRETCHED: f64 = 0.01;

/// Intrinsics of a family of sequences: what the folder's name contains, fx, fy, cx and cy in pixels at 640 x 480, with
/// the centre of the top left pixel at (0, 0) as the benchmark publishes them, and whether the colour images have lens
/// distortion, which is published as well.
struct Family(&'static str, [f32; 4], bool);

const FAMILIES: [Family; 3] = [
    Family("freiburg1", [517.3, 516.5, 318.6, 255.3], true),
    Family("freiburg2", [520.9, 521.0, 325.1, 249.7], true),
    Family("freiburg3", [535.4, 539.2, 320.1, 247.6], false),
];
/// What the benchmark advises where a camera is not known: the defaults of the driver.
const UNKNOWN: Family = Family("", [525.0, 525.0, 319.5, 239.5], false);

impl Family {
    /// That of a sequence by the name of its folder.
    fn of(folder: &Path) -> &'static Self {
        // The name of `.` is that of the folder it stands for; where that cannot be found out, it has none.
        let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_path_buf());
        let name = file_name(&folder).to_lowercase();
        FAMILIES
            .iter()
            .find(|family| name.contains(family.0))
            .unwrap_or(&UNKNOWN)
    }

    /// What to say of it.
    fn note(&self) -> String {
        let &Self(name, [fx, fy, cx, cy], is_distorted) = self;
        let values = format!("fx {fx} fy {fy} cx {cx} cy {cy} at 640x480");
        match (name, is_distorted) {
            ("", _) => format!(
                "no intrinsics.txt, and no freiburg1, freiburg2 or freiburg3 in the folder's name: taken were the \
                 driver's defaults, {values}"
            ),
            (name, true) => format!(
                "no intrinsics.txt: taken were those published for {name}, {values}; its lens distortion is not undone"
            ),
            (name, false) => {
                format!("no intrinsics.txt: taken were those published for {name}, {values}")
            }
        }
    }
}

/// Whether a folder looks like this format, complete or not.
fn recognise(folder: &Path) -> bool {
    folder.join("rgb.txt").is_file()
}

/// Reads a folder in this format.
fn read(folder: &Path, options: OpenOptions, progress: Progress) -> Result<Scene, SceneError> {
    let mut warnings = Vec::new();
    let listed = list(folder, options, &mut warnings)?;
    let family = Family::of(folder);
    let layout = Layout {
        format: FORMAT.name,
        folder,
        images: &folder.join("rgb"),
        depths: &folder.join("depth"),
        depth: DepthImages {
            steps_per_metre: 5000.0,
            ..DepthImages::MILLIMETRES
        },
        default_camera: &|width, height| {
            let &Family(_, [fx, fy, cx, cy], _) = family;
            rgbd::published_camera([fx, fy, cx + 0.5, cy + 0.5], width, height)
        },
        default_camera_note: Some(family.note()),
    };
    rgbd::read(&layout, listed, warnings, Vec::new(), options, progress)
}

/// The frames whose image has a usable pose, and depth where there is any, at about its time; in the order
/// of their times.
fn list(folder: &Path, options: OpenOptions, warnings: &mut Vec<String>) -> Result<Vec<Found>, SceneError> {
    let images = read_images(folder, "rgb.txt", options.outside_files)?;
    check_names(folder, &images)?;
    // Which frames there are does not depend on whether depth is wanted, so that labels fit either way.
    let depths = folder.join("depth.txt");
    let depths = depths
        .exists()
        .then(|| read_images(folder, "depth.txt", options.outside_files))
        .transpose()?;
    let trajectory = folder.join("groundtruth.txt");
    let poses = read_poses(&trajectory)?;
    let total = images.len();
    let (mut listed, mut bad) = (Vec::new(), Vec::new());
    let (mut without_pose, mut without_depth) = (Vec::new(), Vec::new());
    for (time, path) in images {
        let depth = depths.as_ref().map(|depths| nearest(depths, time));
        match (nearest(&poses, time), depth) {
            (None, _) => without_pose.push(file_name(&path)),
            (_, Some(None)) => without_depth.push(file_name(&path)),
            (Some(&(line, pose)), depth) => match pose {
                Ok(camera_to_world) => listed.push(Found {
                    path,
                    depth: depth.flatten().cloned().filter(|_| options.depth),
                    camera_to_world,
                }),
                Err(problem) => bad.push(format!("that of line {line} ({problem})")),
            },
        }
    }
    if listed.is_empty() && bad.is_empty() {
        let other = if without_pose.is_empty() {
            "depth.txt"
        } else {
            "groundtruth.txt"
        };
        refuse!(
            folder.join(other),
            "has nothing within 0.02 s of any of the {total} images in rgb.txt; copy both from one sequence"
        );
    }
    for (left_out, what) in [
        (&without_pose, "pose in groundtruth.txt"),
        (&without_depth, "depth image in depth.txt"),
    ] {
        warn(
            warnings,
            &format!("images without a {what} within 0.02 s were left out"),
            left_out,
        );
    }
    let usable = listed.len() + bad.len();
    let what = "frames were left out because their pose in groundtruth.txt is unusable";
    leave_out(warnings, &trajectory, (&bad, usable), what, |count, first| {
        rgbd::unusable_poses(count, usable, first)
    })?;
    Ok(listed)
}

/// Of what is sorted by its time in seconds, what is nearest, if it is near enough; the earlier of two.
fn nearest<T>(sorted: &[(f64, T)], time: f64) -> Option<&T> {
    let after = sorted.partition_point(|&(other, _)| other < time);
    let around = &sorted[after.saturating_sub(1)..sorted.len().min(after + 1)];
    let distance = |entry: &&(f64, T)| (entry.0 - time).abs();
    let best = around.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
    (distance(&best) <= MOST_APART).then_some(&best.1)
}

/// Reads a list of images, sorted by time.
fn read_images(folder: &Path, list: &str, outside_files: bool) -> Result<Vec<(f64, PathBuf)>, SceneError> {
    let path = &folder.join(list);
    let text = read_text(path)?;
    let mut images = Vec::new();
    for (line, content) in (1..).zip(text.lines()) {
        let content = content.trim();
        if content.is_empty() || content.starts_with('#') {
            continue;
        }
        let parsed = content.split_once(char::is_whitespace).and_then(|(time, name)| {
            let time = time.parse::<f64>().ok().filter(|time| time.is_finite())?;
            Some((time, name.trim()))
        });
        let Some((time, name)) = parsed else {
            refuse!(
                path,
                "line {line} is not a time in seconds and a path inside the folder; correct that line"
            );
        };
        check_name(outside_files, path, &format!("line {line} "), name)?;
        images.push((time, folder.join(name)));
    }
    if images.is_empty() {
        refuse!(path, "lists no images; copy the sequence again");
    }
    images.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok(images)
}

/// Refuses images whose labels would get the same name.
fn check_names(folder: &Path, images: &[(f64, PathBuf)]) -> Result<(), SceneError> {
    let mut first = HashMap::new();
    for (_, path) in images {
        if let Some(other) = first.insert(stem(path), path) {
            refuse!(
                folder.join("rgb.txt"),
                "lists {} and {}, whose labels would get one name; remove or rename one",
                other.display(),
                path.display()
            );
        }
    }
    Ok(())
}

/// A time in seconds; of the pose at it, the line of the file, from 1, and camera-to-world or what is wrong with it.
type TimedPose = (f64, (usize, Result<DAffine3, &'static str>));

/// Reads the trajectory, sorted by time.
fn read_poses(path: &Path) -> Result<Vec<TimedPose>, SceneError> {
    if !path.exists() {
        refuse!(
            path,
            "no such file; write the camera's poses there, time tx ty tz qx qy qz qw a line"
        );
    }
    let mut poses = Vec::new();
    for (line, values) in parse_numbers(path, &read_text(path)?)? {
        let &[time, tx, ty, tz, qx, qy, qz, qw] = values.as_slice() else {
            refuse!(
                path,
                "line {line} has {} numbers; write eight: time tx ty tz qx qy qz qw",
                values.len()
            );
        };
        if !time.is_finite() {
            refuse!(
                path,
                "line {line} has no finite time; correct or remove that line"
            );
        }
        let camera_to_world = pose(DVec3::new(tx, ty, tz), DQuat::from_xyzw(qx, qy, qz, qw));
        poses.push((time, (line, camera_to_world)));
    }
    poses.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok(poses)
}

/// Camera-to-world, or what is wrong with it.
fn pose(translation: DVec3, rotation: DQuat) -> Result<DAffine3, &'static str> {
    if !rotation.is_finite() {
        return Err(NOT_FINITE);
    }
    if (rotation.length() - 1.0).abs() > MOST_STRETCHED {
        return Err(NO_QUATERNION);
    }
    let rotation = DMat3::from_quat(rotation.normalize());
    rigid(DAffine3::from_mat3_translation(rotation, translation))
}

#[cfg(test)]
mod tests;
