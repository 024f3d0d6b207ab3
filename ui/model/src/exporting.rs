//! Exporting: the writing off the UI thread.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use inplace_core::export::{ExportError, Format, LabelledScene, Options, export, write_strokes};
use inplace_core::labels::LabelSet;
use inplace_core::scene::Scene;
use inplace_core::semantics::KnownPart;
use inplace_core::session::FrameMap;

/// What is exported.
#[derive(Debug)]
pub struct Export {
    /// The scene.
    pub scene: Arc<Scene>,
    /// Classes and strokes.
    pub labels: LabelSet,
    /// The objects that no stroke names, as they were found last.
    pub parts: Vec<KnownPart>,
    /// The kind of data set.
    pub format: Format,
    /// What is exported of each map.
    pub options: Options,
    /// The maps of all frames, which follow these labels.
    pub maps: Vec<Arc<FrameMap>>,
    /// Set to stop it between two frames.
    pub stop: Arc<AtomicBool>,
}

/// How an export goes.
#[derive(Clone, Debug, PartialEq)]
pub enum ExportProgress {
    /// Frames written, frames in all.
    Writing(usize, usize),
    /// Everything is in this folder: so many frames, in this format.
    Finished(PathBuf, usize, Format),
    /// It was stopped: so many frames are in this folder, of so many.
    Cancelled(PathBuf, usize, usize),
    /// A sentence about what failed.
    Failed(String),
}

impl Export {
    /// Writes the maps of every frame, the classes and the strokes; `tell` is called along the way. Returns how it
    /// ended.
    pub fn run(&self, folder: &Path, tell: &(dyn Fn(ExportProgress) + Sync)) -> ExportProgress {
        let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_path_buf());
        let progress = |done, total| {
            tell(ExportProgress::Writing(done, total));
            if self.stop.load(Ordering::Relaxed) {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        };
        let labelled = LabelledScene::new(&self.scene, &self.labels, &self.parts, &self.maps);
        let written = export(&folder, labelled, self.format, &self.options, &progress)
            .and_then(|_| write_strokes(&folder.join("strokes.json"), &self.labels, &self.scene.frames));
        match written {
            Ok(()) => ExportProgress::Finished(folder, self.maps.len(), self.format),
            Err(ExportError::Cancelled {
                folder,
                written,
                frames,
            }) => ExportProgress::Cancelled(folder, written, frames),
            Err(error) => ExportProgress::Failed(format!("{error}.")),
        }
    }
}
