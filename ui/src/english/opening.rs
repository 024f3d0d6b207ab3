//! Opening: what was found, what is missing, what is refused.

use std::path::Path;

use inplace_core::labels::LabelSet;
use inplace_core::scene::SceneSource;

use super::counted;

/// The demo scene, as what is opened.
pub const DEMO: &str = "the demo scene";

/// Another window keeps the work on this scene.
pub fn scene_in_use(source: &SceneSource) -> String {
    let scene = match source {
        SceneSource::Demo => "The demo scene".to_owned(),
        SceneSource::Folder(folder) => folder.display().to_string(),
    };
    format!(
        "{scene}: is open in another window, which keeps the work on it; go on there, or close it there first."
    )
}

/// Work without a name of its own is there again.
pub fn recovered(labels: &LabelSet) -> String {
    let strokes = labels.strokes.len();
    let frames: std::collections::BTreeSet<usize> =
        labels.strokes.values().map(|stroke| stroke.frame).collect();
    let on = match frames.len() {
        0 => String::new(),
        some => format!(" on {}", counted(some, "frame", "frames")),
    };
    let strokes = counted(strokes, "stroke", "strokes");
    let imported = if labels.imported.is_some() {
        " and imported labels"
    } else {
        ""
    };
    format!("Your earlier work on this scene was recovered: {strokes}{on}{imported}.")
}

/// Title of the dialog about a scene that has moved.
pub const MOVED: &str = "Where is the scene now?";
/// Name of its path field.
pub const MOVED_FIELD: &str = "Folder of the scene";
/// Its button.
pub const MOVED_OPEN: &str = "Open from there";
/// What comes of the answer.
pub const MOVED_EXPLANATION: &str = "Choose the folder where it is now. The project remembers it, and all of \
                                     your work is there again.";

/// What is missing.
pub fn moved(project: &Path, missing: &Path) -> String {
    let name = project
        .file_name()
        .unwrap_or(project.as_os_str())
        .to_string_lossy();
    if missing.as_os_str().is_empty() {
        return format!("{name} no longer says where the scene is that it labels.");
    }
    format!(
        "{name} labels a scene that is no longer at {}.",
        missing.display()
    )
}

/// Over the window while something is held above it.
pub const DROP: &str = "Drop to open";
/// What can be dropped.
pub const DROP_EXPLANATION: &str = "The folder of a scene, or a project file (.inplace)";
