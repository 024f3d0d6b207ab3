//! How the worker has a pretrained network look at the images, and the surface know what it saw.

use std::path::PathBuf;
use std::sync::Arc;

use super::Worker;
use crate::features::{FeatureError, ImageFeatures, Network};
use crate::session::Event;
use crate::session::background::Background;

/// What the network sees, from the wish to know it until a surface knows.
pub(super) enum FeatureSearch {
    /// To be begun once there is a surface: until then labels wait for that.
    Wanted(PathBuf),
    /// Under way.
    Running(Option<Background<Result<ImageFeatures, FeatureError>>>),
    /// Known; surfaces have it, or will have it.
    Known,
    /// Nobody wants it, or there is none.
    Closed,
}

impl FeatureSearch {
    pub(super) fn new(file: Option<PathBuf>) -> Self {
        file.map_or(Self::Closed, Self::Wanted)
    }

    /// Whether the maps are still to change by what the network sees.
    pub(super) fn is_open(&self) -> bool {
        !matches!(self, Self::Closed)
    }
}

impl Worker<'_> {
    /// Has the network look at the images, if that is still to be begun and depth is known.
    pub(super) fn find_features(&mut self) {
        if let (FeatureSearch::Wanted(file), None) = (&self.features, &self.estimation) {
            let (file, scene) = (file.clone(), Arc::clone(&self.scene));
            let threads = self.options.threads.max(1);
            let look = Background::start("inplace-features", threads, self.generation, move |stop| {
                let looked =
                    Network::read(&file).and_then(|network| ImageFeatures::of(&scene, &network, stop));
                looked.transpose()
            });
            self.features = FeatureSearch::Running(Some(look));
        }
    }

    /// Has the present surface know what the network sees as soon as that is known; those to come are built with it.
    pub(super) fn take_features_if_ready(&mut self) {
        if let FeatureSearch::Running(running) = &mut self.features {
            let Some((_, found)) = Background::take_ready(running) else {
                return;
            };
            self.features = match found.unwrap_or(Err(FeatureError::Ended)) {
                Ok(features) => {
                    self.refiner.set_features(features);
                    FeatureSearch::Known
                }
                Err(error) => {
                    self.outbox.send(Event::Warning(error.to_string()));
                    FeatureSearch::Closed
                }
            };
        }
        if self.waiting.is_some() {
            // The surface that comes next may know already.
            return;
        }
        if let (FeatureSearch::Known, Some(propagation)) = (&self.features, &self.propagation) {
            if propagation.surface().look.has_features() {
                self.features = FeatureSearch::Closed;
            } else {
                self.refiner.add_features(propagation.surface(), &self.labels);
            }
        }
    }
}
