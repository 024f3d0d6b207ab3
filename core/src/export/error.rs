//! What can be wrong with an export.

use std::path::{Path, PathBuf};

use crate::field::FieldError;
use crate::labels::{ClassId, ClassListError};
use crate::scene::{SceneError, SceneSource};

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
    UnusableIds(PathBuf, ClassListError),
    /// There is nothing right to write into the export's folder, with what is missing or contradicts itself; nothing was
    /// written.
    #[error("{}: nothing was exported: {}", .0.display(), .1)]
    Incomplete(PathBuf, Refusal),
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

    pub(super) fn incomplete(folder: &Path, reason: Refusal) -> Self {
        Self::Incomplete(folder.to_path_buf(), reason)
    }
}

/// Why labels cannot be exported as they are: part of a sentence.
#[derive(Debug, thiserror::Error)]
pub enum Refusal {
    /// A pixel has a class without a name.
    #[error("it shows class {0}, which is not in the list of classes; add it")]
    UnlistedClass(ClassId),
    /// A least probability is asked for, and the map has no probabilities.
    #[error(
        "its probabilities are not known yet; wait until it was trained again, or export without a threshold"
    )]
    NoProbabilities,
    /// A map of a frame that the scene does not have.
    #[error("there is a map of frame {0}, which {1} does not have")]
    NoSuchFrame(usize, SceneSource),
    /// Two maps of the frame with this stem.
    #[error("there are two maps of frame \"{0}\"")]
    TwoMaps(String),
    /// The map of the frame with this stem has another width or height.
    #[error("the map of frame \"{0}\" has another size than the frame")]
    OtherSize(String),
    /// Two frames with this stem.
    #[error("two frames are named \"{0}\"; rename one of their images")]
    SameName(String),
    /// The frame with this stem has no map.
    #[error("frame \"{0}\" has no map yet")]
    NoMap(String),
    /// Views are asked for without a camera.
    #[error("the scene has no frame whose camera could be taken")]
    NoCamera,
    /// The maps were not made from a surface.
    #[error("the surface of the scene is not known; wait until it was trained again")]
    NoSurface,
    /// The format cannot hold these names, numbers or counts; the sentence says what to do.
    #[error("{0}")]
    Format(String),
    /// What is wrong with a single frame or view.
    #[error("{0}: {1}")]
    Of(String, Box<Self>),
    /// An image cannot be read.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A view cannot be rendered.
    #[error(transparent)]
    Field(#[from] FieldError),
    /// A JPEG cannot be encoded.
    #[error(transparent)]
    Image(#[from] image::ImageError),
    /// A PNG cannot be encoded.
    #[error(transparent)]
    Png(#[from] png::EncodingError),
    /// A list cannot be encoded.
    #[error(transparent)]
    Json(#[from] serde_json::Error),
    /// An archive cannot be made.
    #[error(transparent)]
    Zip(#[from] zip::result::ZipError),
}

impl Refusal {
    /// The same of one frame or view.
    pub(super) fn of(self, what: String) -> Self {
        Self::Of(what, Box::new(self))
    }
}
