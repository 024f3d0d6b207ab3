//! The parsers of captures by the bytes of their files, for fuzzing: no part of the library's interface.
//!
//! [`Scene::open`](super::Scene::open) reaches all of this; here it needs no files.

use std::io::Cursor;
use std::path::Path;

use image::ImageReader;

use super::transforms::Transforms;
use super::{SceneError, colmap, files, replica, rgbd, tum};

/// Parses the bytes of a file; the path is for messages.
pub type Parser = fn(&Path, &[u8]) -> Result<(), SceneError>;

/// `traj_w_c.txt` of the Replica layout.
pub const REPLICA_POSES: Parser = |path, bytes| text(path, bytes, replica::parse_poses);
/// `intrinsics.txt`.
pub const INTRINSICS: Parser = |path, bytes| text(path, bytes, rgbd::text::parse_intrinsics);
/// `frame-N.pose.txt` of 7-Scenes.
pub const SEVEN_SCENES_POSE: Parser = |path, bytes| text(path, bytes, rgbd::text::parse_pose);
/// `intrinsic_color.txt` and the like of ScanNet.
pub const SCANNET_MATRIX: Parser = |path, bytes| text(path, bytes, rgbd::text::parse_numbers);
/// `rgb.txt` or `depth.txt` of TUM RGB-D.
pub const TUM_IMAGES: Parser = |path, bytes| {
    let folder = path.parent().unwrap_or(path);
    text(path, bytes, |path, text| {
        tum::parse_images(folder, path, text, false)
    })
};
/// `groundtruth.txt` of TUM RGB-D.
pub const TUM_POSES: Parser = |path, bytes| text(path, bytes, tum::parse_poses);
/// `transforms.json`.
pub const TRANSFORMS: Parser = |path, bytes| Transforms::parse(path, bytes).map(|_| ());
/// `cameras.bin`, `images.bin` and `points3D.bin` of COLMAP.
pub const COLMAP_BINARY: [Parser; 3] = [
    |path, bytes| colmap::parse(path, bytes, true, 0),
    |path, bytes| colmap::parse(path, bytes, true, 1),
    |path, bytes| colmap::parse(path, bytes, true, 2),
];
/// `cameras.txt`, `images.txt` and `points3D.txt` of COLMAP.
pub const COLMAP_TEXT: [Parser; 3] = [
    |path, bytes| colmap::parse(path, bytes, false, 0),
    |path, bytes| colmap::parse(path, bytes, false, 1),
    |path, bytes| colmap::parse(path, bytes, false, 2),
];
/// A colour or depth image, PNG or JPEG.
pub const IMAGE: Parser = |path, bytes| {
    let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format();
    let reader = reader.map_err(|error| SceneError::file(path, error))?;
    let decoded = files::decode(reader, bytes.len() as u64);
    decoded.map(|_| ()).map_err(|error| SceneError::file(path, error))
};

/// Parses what is text.
fn text<T>(
    path: &Path,
    bytes: &[u8],
    parse: impl FnOnce(&Path, &str) -> Result<T, SceneError>,
) -> Result<(), SceneError> {
    let text = std::str::from_utf8(bytes).map_err(|error| SceneError::file(path, error))?;
    parse(path, text).map(|_| ())
}
