//! How the worker follows the labels: over the newest surface, with the images that were imported.

use std::sync::Arc;

use super::{Worker, WorkerError, timed};
use crate::semantics::{Spread, Surface, SurfaceImport};
use crate::session::importing::Importing;

impl Worker<'_> {
    /// What is trained on the labels has something new to follow.
    pub(super) fn labels_changed(&mut self) {
        let wanted = self.semantics_are_wanted();
        self.opinion.taught.labels_changed(wanted);
        self.semantic_field.taught.labels_changed(wanted);
    }

    /// A surface that has become ready. While training is paused, one that is there stays: the maps follow
    /// the labels alone, so that an undo gives back those of before.
    pub(super) fn new_spread(&mut self) -> Result<Option<Spread>, WorkerError> {
        if self.paused && self.spread.is_some() {
            return Ok(None);
        }
        let ready = self.survey.ready();
        ready.map_err(|reason| WorkerError::Other(reason.to_owned()))
    }

    pub(super) fn take_spread(&mut self, mut spread: Spread) {
        timed(&mut self.seconds.semantics, || {
            spread.set_labels(&self.scene, &self.labels);
        });
        self.spread = Some(spread);
        self.checking.start_anew();
        self.opinion.start_look();
        self.refresh_all();
    }

    /// Starts to spread the imported images over this surface, beside the worker.
    pub(super) fn import_onto(&self, surface: &Arc<Surface>) -> Importing {
        Importing::start(surface, &self.labels, self.options.threads.max(1))
    }

    /// Starts to spread imported images unless they are, or others are being spread.
    pub(super) fn import_if_due(&mut self) {
        let due = |spread: &&Spread| self.labels.imported.is_some() && !spread.has_import_of(&self.labels);
        if self.importing.is_none()
            && let Some(spread) = self.spread.as_ref().filter(due)
        {
            self.importing = Some(self.import_onto(spread.surface()));
        }
    }

    /// Imported images have been spread: they go into the maps, with the surface that waited for them.
    pub(super) fn take_import(&mut self, import: Option<SurfaceImport>) {
        self.importing = None;
        if let Some(spread) = self.waiting.take() {
            self.take_spread(spread);
        }
        // The labels may have changed meanwhile.
        let import = import.filter(|import| import.is_of(&self.labels));
        if let (Some(import), Some(spread)) = (import, &mut self.spread) {
            timed(&mut self.seconds.semantics, || spread.set_import(import));
            self.checking.start_anew();
            self.labels_changed();
            self.refresh_all();
        }
        self.import_if_due();
    }
}
