//! The formats that a folder can be in, and how to tell them apart.

use std::path::Path;

use super::reading::Progress;
use super::{
    OpenOptions, Scene, SceneError, colmap, images, replica, scannet, seven_scenes, transforms, tum,
};

/// One format: its module has a constant or a function for each field.
struct Format {
    /// Name for people.
    name: &'static str,
    /// What a folder in this format holds.
    expected: &'static str,
    /// The file that has the poses.
    poses: &'static str,
    /// Whether a folder looks like this format, complete or not.
    recognise: fn(&Path) -> bool,
    /// Reads a folder in this format.
    read: fn(&Path, OpenOptions, Progress) -> Result<Scene, SceneError>,
}

/// All formats; the first that recognises a folder reads it.
const FORMATS: [Format; 6] = [
    Format {
        name: replica::NAME,
        expected: replica::EXPECTED,
        poses: replica::POSES,
        recognise: replica::recognise,
        read: replica::read,
    },
    Format {
        name: colmap::NAME,
        expected: colmap::EXPECTED,
        poses: colmap::POSES,
        recognise: colmap::recognise,
        read: colmap::read,
    },
    Format {
        name: transforms::NAME,
        expected: transforms::EXPECTED,
        poses: transforms::POSES,
        recognise: transforms::recognise,
        read: transforms::read,
    },
    Format {
        name: seven_scenes::NAME,
        expected: seven_scenes::EXPECTED,
        poses: seven_scenes::POSES,
        recognise: seven_scenes::recognise,
        read: seven_scenes::read,
    },
    Format {
        name: tum::NAME,
        expected: tum::EXPECTED,
        poses: tum::POSES,
        recognise: tum::recognise,
        read: tum::read,
    },
    Format {
        name: scannet::NAME,
        expected: scannet::EXPECTED,
        poses: scannet::POSES,
        recognise: scannet::recognise,
        read: scannet::read,
    },
];

/// The file that has the poses of a scene of this format, for people.
pub(super) fn pose_file(format: &str) -> &'static str {
    let known = FORMATS.iter().find(|known| known.name == format);
    // The demo has no files.
    known.map_or("the capture", |known| known.poses)
}

/// Reads a folder in the first format that recognises it; a note says which others would have.
pub(super) fn read(folder: &Path, options: OpenOptions, progress: Progress) -> Result<Scene, SceneError> {
    let mut recognised = FORMATS.iter().filter(|format| (format.recognise)(folder));
    let Some(format) = recognised.next() else {
        let expected = FORMATS.map(|format| format!("{} ({})", format.expected, format.name));
        return Err(SceneError::Unrecognised {
            path: folder.to_path_buf(),
            expected: expected.join(", or "),
        });
    };
    let mut scene = (format.read)(folder, options, progress)?;
    images::note_hidden(&scene.frames, &mut scene.notes);
    let others: Vec<&str> = recognised.map(|format| format.name).collect();
    if !others.is_empty() {
        let others = others.join(" and ");
        scene
            .notes
            .push(format!("the folder also looks like {others}, which was not read"));
    }
    Ok(scene)
}
