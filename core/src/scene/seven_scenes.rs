//! One sequence of Microsoft's 7-Scenes (Shotton et al., CVPR 2013).
//!
//! - `frame-NNNNNN.color.png` (or JPEG)
//! - `frame-NNNNNN.depth.png`: 16 bit, millimetres along z, 0 and 65535 = none
//! - `frame-NNNNNN.pose.txt`: 4x4 camera-to-world, OpenCV axes, metres, a row a line
//! - `intrinsics.txt`, where there is one: `fx fy cx cy width height`

use std::collections::BTreeMap;
use std::path::Path;

use super::depth::DepthImages;
use super::error::refuse;
use super::files::{file_name, paths_in};
use super::formats::Format;
use super::reading::Progress;
use super::rgbd::pose_files::{self, FrameFiles, Places};
use super::rgbd::{self, Layout};
use super::{OpenOptions, Scene, SceneError};

/// The format.
pub(super) const FORMAT: Format = Format {
    name: "7-Scenes",
    expected: "frame-000000.color.png, frame-000000.depth.png and frame-000000.pose.txt, ... of one sequence",
    poses: "frame-N.pose.txt",
    recognise,
    read,
};

/// The intrinsics that the data set gives for its depth camera: fx, fy, cx and cy in pixels at 640 x 480.
const INTRINSICS: [f32; 4] = [585.0, 585.0, 320.0, 240.0];

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
fn recognise(folder: &Path) -> bool {
    // A folder that cannot be listed is no sequence; opening it says so.
    let mut paths = paths_in(folder).unwrap_or_default().into_iter();
    paths.any(|path| {
        let parsed = parse_name(&file_name(&path));
        matches!(parsed, Some((_, Kind::Color | Kind::Pose)))
    })
}

/// Reads a folder in this format.
fn read(folder: &Path, options: OpenOptions, progress: Progress) -> Result<Scene, SceneError> {
    let mut warnings = Vec::new();
    let places = Places {
        folder,
        poses: folder,
        without_pose: "images have no .pose.txt",
        without_image: "poses have no .color.png",
        remedy: "copy the sequence again",
        unusable: "frames were left out because their pose is unusable",
    };
    let frames = find_files(folder)?.into_values();
    let listed = pose_files::list(&places, frames, options, &mut warnings)?;
    let layout = Layout {
        format: FORMAT.name,
        folder,
        images: folder,
        depths: folder,
        depth: DepthImages {
            none: u16::MAX,
            ..DepthImages::MILLIMETRES
        },
        default_camera: &|width, height| rgbd::published_camera(INTRINSICS, width, height),
        default_camera_note: Some(
            "no intrinsics.txt: taken were the data set's defaults, a focal length of 585 pixels at 640x480 and \
             the principal point in the middle, which are those of its depth camera; the colour camera was \
             not calibrated, so that depth can be some pixels beside the colours"
                .to_owned(),
        ),
    };
    rgbd::read(&layout, listed, warnings, Vec::new(), options, progress)
}

/// The files of each frame by its number.
fn find_files(folder: &Path) -> Result<BTreeMap<u64, FrameFiles>, SceneError> {
    let mut frames: BTreeMap<u64, FrameFiles> = BTreeMap::new();
    for path in paths_in(folder)? {
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
            refuse!(other, "is of the same frame as {name}; keep one of the two");
        }
    }
    Ok(frames)
}

#[cfg(test)]
mod tests;
