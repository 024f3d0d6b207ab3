//! Results on disk: a folder of PNGs and JSON files, each written under a temporary name and renamed, so
//! that a killed run leaves no half file.

mod atomic;
mod maps;
mod memory;
mod report;

use std::path::{Path, PathBuf};

pub use maps::write_maps;
pub use memory::peak_memory;
pub use report::{PhaseSeconds, Report};

use crate::labels::{Class, LabelSet, strokes_json};
use crate::scene::{Frame, SceneError};

/// The folders of [`write_maps`], below the export's own.
const FOLDERS: [&str; 3] = ["labels", "entropy", "color"];

/// Results that cannot be written; each message is one sentence that names the file and what to do.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The file system refuses.
    #[error("{}: cannot be written: {error}; choose another folder or free some space", .path.display())]
    Unwritable {
        /// The file or folder.
        path: PathBuf,
        /// The file system's reason.
        error: std::io::Error,
    },
    /// Somebody stopped it; the files that were written by then are whole.
    #[error("{}: the export was cancelled after {written} of {frames} frames; export again for all of them", .folder.display())]
    Cancelled {
        /// The export's folder.
        folder: PathBuf,
        /// Frames whose files were written.
        written: usize,
        /// Frames in all.
        frames: usize,
    },
    /// The files of a frame that is no keyframe can no longer be read.
    #[error(transparent)]
    Frame(#[from] SceneError),
    /// There is nothing right to write; nothing was written.
    #[error("{}: nothing was exported: {reason}", .folder.display())]
    Incomplete {
        /// The export's folder.
        folder: PathBuf,
        /// What is missing or contradicts itself.
        reason: String,
    },
}

impl ExportError {
    fn unwritable(path: &Path, error: std::io::Error) -> Self {
        Self::Unwritable {
            path: path.to_path_buf(),
            error,
        }
    }
}

/// Makes the folder and those inside it, and tries whether files can be written there: call it before
/// any work whose result is to be kept there.
///
/// # Errors
/// [`ExportError::Unwritable`].
pub fn prepare(folder: &Path) -> Result<(), ExportError> {
    let inner = FOLDERS.iter().map(|name| folder.join(name));
    for folder in std::iter::once(folder.to_path_buf()).chain(inner) {
        atomic::prepare(&folder).map_err(|error| ExportError::unwritable(&folder, error))?;
    }
    Ok(())
}

/// Writes `report.json` into an export's folder.
///
/// # Errors
/// [`ExportError::Unwritable`].
pub fn write_report(folder: &Path, report: &Report) -> Result<(), ExportError> {
    write_json(&folder.join("report.json"), report)
}

/// Writes `classes.json`: the list of classes as in a strokes file.
fn write_classes(folder: &Path, classes: &[Class]) -> Result<(), ExportError> {
    write_json(&folder.join("classes.json"), classes)
}

/// Writes a strokes file for the frames of a scene; strokes on other frames (that have vanished from the
/// scene) are left out.
///
/// # Errors
/// [`ExportError::Unwritable`].
pub fn write_strokes(path: &Path, labels: &LabelSet, frames: &[Frame]) -> Result<(), ExportError> {
    write(path, (strokes_json(labels, frames) + "\n").as_bytes())
}

/// Writes a value as a JSON file, under a temporary name first.
///
/// # Errors
/// [`ExportError::Unwritable`].
pub fn write_json<T: serde::Serialize + ?Sized>(path: &Path, value: &T) -> Result<(), ExportError> {
    let mut text = serde_json::to_vec_pretty(value)
        .map_err(|error| ExportError::unwritable(path, std::io::Error::other(error)))?;
    text.push(b'\n');
    write(path, &text)
}

/// Writes a file under a temporary name first.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), ExportError> {
    atomic::write(path, bytes).map_err(|error| ExportError::unwritable(path, error))
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::sync::Arc;

    use super::*;
    use crate::labels::{Stroke, StrokeId};
    use crate::scene::testing::wall;

    #[test]
    fn an_unwritable_folder_is_one_sentence_before_any_work() {
        let root = tempfile::tempdir().unwrap();
        let file = root.path().join("file");
        fs::write(&file, "x").unwrap();
        let error = prepare(&file.join("out")).unwrap_err().to_string();
        assert!(
            error.contains("file") && error.contains("cannot be written"),
            "{error}"
        );
        assert_eq!(fs::read(&file).unwrap(), b"x");
    }

    #[test]
    fn what_a_killed_run_left_is_cleared_away() {
        let root = tempfile::tempdir().unwrap();
        prepare(root.path()).unwrap();
        let left = atomic::temporary(&root.path().join("labels/a.png")).unwrap();
        fs::write(&left, "half").unwrap();
        fs::write(root.path().join("labels/mine.txt"), "kept").unwrap();
        prepare(root.path()).unwrap();
        assert!(!left.exists());
        assert!(root.path().join("labels/mine.txt").exists());
    }

    #[test]
    fn the_report_comes_back_and_says_null_for_what_was_not_measured() {
        let root = tempfile::tempdir().unwrap();
        let report = Report {
            scene: "demo".to_owned(),
            frames: 3,
            seed: 7,
            held_out_psnr_db: Some(27.5),
            ..Report::default()
        };
        write_report(root.path(), &report).unwrap();
        let text = fs::read_to_string(root.path().join("report.json")).unwrap();
        assert!(text.contains("\"depth_error_m\": null"), "{text}");
        assert_eq!(serde_json::from_str::<Report>(&text).unwrap(), report);
    }

    #[test]
    fn strokes_on_vanished_frames_are_not_exported() {
        let root = tempfile::tempdir().unwrap();
        let path = root.path().join("strokes.json");
        let mut labels = LabelSet {
            classes: vec![Class::new(1, "wall")],
            ..LabelSet::default()
        };
        for (id, frame) in [(1, 0), (2, 5)] {
            let stroke = Arc::new(Stroke::click(frame, 1, [2, 3]));
            labels.strokes.insert(StrokeId(id), stroke);
        }
        write_strokes(&path, &labels, &wall(1, 4, 3).frames).unwrap();
        let json: serde_json::Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
        assert_eq!(json["strokes"].as_array().unwrap().len(), 1);
        assert_eq!(json["strokes"][0]["frame"], "rgb_0");
    }
}
