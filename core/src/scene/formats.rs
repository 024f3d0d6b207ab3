//! The formats that a folder can be in, and how to tell them apart.

use std::path::Path;

use super::files::paths_in;
use super::reading::Progress;
use super::{
    OpenOptions, Scene, SceneError, SceneSource, colmap, images, replica, scannet, seven_scenes, transforms,
    tum,
};

/// One format.
pub(super) struct Format {
    /// Name for people.
    pub name: &'static str,
    /// What a folder in this format holds.
    pub expected: &'static str,
    /// The file that has the poses.
    pub poses: &'static str,
    /// Whether a folder looks like this format, complete or not.
    pub recognise: fn(&Path) -> bool,
    /// Reads a folder in this format.
    pub read: fn(&Path, OpenOptions, Progress) -> Result<Scene, SceneError>,
}

/// All formats; the first that recognises a folder reads it.
static FORMATS: [Format; 6] = [
    replica::FORMAT,
    colmap::FORMAT,
    transforms::FORMAT,
    seven_scenes::FORMAT,
    tum::FORMAT,
    scannet::FORMAT,
];

/// The file that has the poses of a scene of this format, for people.
pub(super) fn pose_file(format: &str) -> &'static str {
    let known = FORMATS.iter().find(|known| known.name == format);
    // The demo has no files.
    known.map_or("the capture", |known| known.poses)
}

/// The formats that recognise a folder, at least one.
///
/// # Errors
/// There is no such folder, or none does.
pub(super) fn recognised(folder: &Path) -> Result<Vec<&'static Format>, SceneError> {
    if !folder.is_dir() {
        return Err(SceneError::Missing(folder.to_path_buf()));
    }
    let recognised: Vec<_> = FORMATS
        .iter()
        .filter(|format| (format.recognise)(folder))
        .collect();
    if recognised.is_empty() {
        // Of a folder that cannot be listed this is the error.
        paths_in(folder)?;
        let expected = FORMATS
            .iter()
            .map(|format| format!("{} ({})", format.expected, format.name));
        let expected = expected.collect::<Vec<_>>().join(", or ");
        return Err(SceneError::Unrecognised(folder.to_path_buf(), expected));
    }
    Ok(recognised)
}

/// Reads a folder in the first format that recognises it; a note says which others would have. `listed` gets the scene
/// before its images are read, `read` is [`Progress::read`].
pub(super) fn read(
    folder: &Path,
    options: OpenOptions,
    listed: &(dyn Fn(Scene) + Sync),
    read: &(dyn Fn(usize, usize) -> bool + Sync),
) -> Result<Scene, SceneError> {
    let recognised = recognised(folder)?;
    let format = recognised[0];
    let source = SceneSource::Folder(folder.to_path_buf());
    let listed = |frames| listed(Scene::new(source.clone(), format.name, frames));
    let progress = Progress {
        listed: &listed,
        read,
    };
    let mut scene = (format.read)(folder, options, progress)?;
    images::note_hidden(&scene.frames, &mut scene.notes);
    let others: Vec<&str> = recognised[1..].iter().map(|format| format.name).collect();
    if !others.is_empty() {
        let others = others.join(" and ");
        scene
            .notes
            .push(format!("the folder also looks like {others}, which was not read"));
    }
    Ok(scene)
}
