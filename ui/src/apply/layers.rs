//! What the layers of the canvas need, between the frames of the window.

use std::time::Instant;

use crate::app::App;

impl App {
    /// Has whatever the layers that are shown need made, off this thread, and takes over what is ready.
    pub(crate) fn prepare_layers(&mut self) {
        let settings = &self.state.settings;
        let layers = [
            Some(settings.layer),
            settings.compare.then_some(settings.other_layer),
        ];
        let layers: Vec<_> = layers.into_iter().flatten().collect();
        self.with_workspace(|workspace| workspace.prepare_layers(&layers, Instant::now()));
    }
}
