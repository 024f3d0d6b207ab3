//! How the worker follows the labels: it propagates strokes and imported images over the newest surface.

use std::sync::Arc;

use crossbeam_channel::{Receiver, TryRecvError};

use super::Worker;
use crate::semantics::{LabelPropagation, Surface, SurfaceImport};
use crate::session::background::in_background;
use crate::session::serve::{WorkerError, timed};

impl Worker<'_> {
    /// Has the semantic field follow the new labels.
    pub(super) fn labels_changed(&mut self) {
        self.demand.labels_changed();
        let wanted = self.semantics_are_wanted();
        self.semantics.labels_changed(wanted, self.demand.readers());
    }

    /// A new surface that has become ready. While training is paused the present one stays, so that the maps depend on
    /// the labels alone and an undo restores those of before.
    pub(super) fn new_propagation(&mut self) -> Result<Option<LabelPropagation>, WorkerError> {
        if self.paused && self.propagation.is_some() {
            return Ok(None);
        }
        let ready = self.refiner.ready();
        ready.map_err(|reason| WorkerError::Other(reason.to_owned()))
    }

    /// Has a surface that waits for imported images wait for the end of a pause as well.
    pub(super) fn put_back_waiting(&mut self) {
        if let Some(propagation) = self.waiting.take() {
            self.importing = None;
            self.refiner.put_back(propagation);
            self.import_if_due();
        }
    }

    /// Goes on with a new surface, and with the imported images that it may have waited for.
    pub(super) fn take_propagation(
        &mut self,
        mut propagation: LabelPropagation,
        import: Option<SurfaceImport>,
    ) {
        timed(&mut self.seconds.semantics, || {
            propagation.set_labels(&self.scene, &self.labels);
            import
                .into_iter()
                .for_each(|import| propagation.set_import(import));
        });
        tracing::info!(
            nodes = propagation.surface().graph.len(),
            steps = self.trainer.steps(),
            geometry_seconds = self.seconds.geometry,
            "a surface is built"
        );
        // Of what else is new, nothing tells whether training still improves the labels.
        let known = |propagation: &LabelPropagation| {
            let is_import_known = propagation.has_import_of(&self.labels);
            (is_import_known, propagation.surface().look.has_features())
        };
        let is_alike = |before: &&LabelPropagation| known(before) == known(&propagation);
        if let Some(before) = self.propagation.as_ref().filter(is_alike)
            && self.trainer.steps() > self.surface_steps
        {
            self.demand.surface_changed(&before.without_prior(), &propagation);
        }
        self.surface_steps = self.trainer.steps();
        self.find_features();
        self.propagation = Some(propagation);
        self.check_anew();
        if self.demand.readers().maps {
            self.semantics.start_evaluation();
        }
        self.refresh_all();
    }

    /// Starts to propagate the imported images over this surface, in the background: votes take seconds, and a click must
    /// not wait for them. There is nothing to propagate where the labels have no imported images.
    pub(super) fn import_onto(&self, surface: &Arc<Surface>) -> Receiver<Option<SurfaceImport>> {
        let (surface, labels) = (Arc::clone(surface), self.labels.clone());
        let propagate = move || SurfaceImport::new(&surface, &labels);
        in_background("inplace-import", self.options.threads.max(1), propagate)
    }

    /// Takes imported images over into the maps once they have been propagated, with the surface that waited for them.
    ///
    /// # Errors
    /// The thread that propagates them died.
    pub(super) fn take_import_if_ready(&mut self) -> Result<(), WorkerError> {
        let import = match self.importing.as_ref().map(Receiver::try_recv) {
            Some(Ok(import)) => import,
            Some(Err(TryRecvError::Disconnected)) => {
                return Err(WorkerError::Other(
                    "the imported labels could not be spread; open the scene again and remove them"
                        .to_owned(),
                ));
            }
            Some(Err(TryRecvError::Empty)) | None => return Ok(()),
        };
        self.importing = None;
        // The labels may have changed in the meantime.
        let import = import.filter(|import| import.is_of(&self.labels));
        let before = self.propagation.as_ref();
        let is_new = import.is_some() && !before.is_some_and(|before| before.has_import_of(&self.labels));
        if let Some(propagation) = self.waiting.take() {
            self.take_propagation(propagation, import);
        } else if let (Some(import), Some(propagation)) = (import, &mut self.propagation) {
            timed(&mut self.seconds.semantics, || propagation.set_import(import));
            self.check_anew();
            self.refresh_all();
        }
        if is_new {
            self.labels_changed();
        }
        self.import_if_due();
        Ok(())
    }

    /// Starts to propagate imported images that are not in the maps yet, unless others are under way.
    pub(super) fn import_if_due(&mut self) {
        let due = |propagation: &&LabelPropagation| {
            self.labels.imported.is_some() && !propagation.has_import_of(&self.labels)
        };
        if self.importing.is_none()
            && let Some(propagation) = self.propagation.as_ref().filter(due)
        {
            self.importing = Some(self.import_onto(propagation.surface()));
        }
    }
}
