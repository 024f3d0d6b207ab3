//! What can be wrong with an export.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use crate::scene::SceneError;

/// Results that cannot be written; each message is one sentence that names the file and what to do.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The file system refuses this file or folder, with its reason.
    #[error("{}: cannot be written: {}; choose another folder or free some space", .0.display(), .1)]
    Unwritable(PathBuf, std::io::Error),
    /// This file or folder, which decides what is to be done, cannot be read, with the file system's reason.
    #[error("{}: cannot be read: {}; name a file or folder that is there", .0.display(), .1)]
    Unreadable(PathBuf, std::io::Error),
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
    /// This file is no list of classes that can be used, with what is wrong with it.
    #[error("{}: is no list of classes: {}; name a JSON file [{{\"id\", \"name\", \"color\"}}], or NYU-13, ScanNet-20, Cityscapes, NYU-40 or COCO-Stuff", .0.display(), .1)]
    UnusableIds(PathBuf, String),
    /// The labels cannot be written into the export's folder as they are, with what is missing or contradicts itself.
    #[error("{}: the labels cannot be exported: {}", .0.display(), .1)]
    Incomplete(PathBuf, String),
}

impl ExportError {
    pub(super) fn unwritable(path: &Path, error: std::io::Error) -> Self {
        Self::Unwritable(path.to_path_buf(), error)
    }

    pub(super) fn cancelled(folder: &Path, written: usize, frames: usize) -> Self {
        Self::Cancelled {
            folder: folder.to_path_buf(),
            written,
            frames,
        }
    }

    pub(super) fn incomplete(folder: &Path, reason: impl Display) -> Self {
        Self::Incomplete(folder.to_path_buf(), reason.to_string())
    }
}

/// Why labels cannot be exported as they are, or a file cannot be encoded: part of a sentence.
pub(super) type Refusal = Box<dyn std::error::Error + Send + Sync>;
