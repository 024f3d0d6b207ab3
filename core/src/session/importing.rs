//! Propagates imported label images in the background: votes take seconds, and a click must not wait for them.

use std::sync::Arc;

use crossbeam_channel::{Receiver, TryRecvError};

use super::background::in_background;
use crate::labels::LabelSet;
use crate::semantics::{Surface, SurfaceImport};

/// A propagation of imported images over a surface that is under way.
pub(super) struct Importing(Receiver<Option<SurfaceImport>>);

impl Importing {
    /// Starts to propagate the imported images of a label set over a surface.
    pub(super) fn start(surface: &Arc<Surface>, labels: &LabelSet, threads: usize) -> Self {
        let (surface, labels) = (Arc::clone(surface), labels.clone());
        let propagate = move || SurfaceImport::new(&surface, &labels);
        Self(in_background("inplace-import", threads, propagate))
    }

    /// The result, once it is there; `Some(None)` where the labels have no imported images.
    ///
    /// # Errors
    /// The thread died.
    pub(super) fn ready(&self) -> Result<Option<Option<SurfaceImport>>, &'static str> {
        match self.0.try_recv() {
            Ok(import) => Ok(Some(import)),
            Err(TryRecvError::Empty) => Ok(None),
            Err(TryRecvError::Disconnected) => {
                Err("the imported labels could not be spread; open the scene again and remove them")
            }
        }
    }
}
