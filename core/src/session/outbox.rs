//! Where the worker's results go.

use std::sync::Arc;

use crossbeam_channel::Sender;

use super::{Event, FrameMap, MapSlots};
use crate::TOLD;

/// Where the worker's results go; cheap to clone.
#[derive(Clone)]
pub(super) struct Outbox {
    events: Sender<Event>,
    maps: Arc<MapSlots>,
    wake: Arc<dyn Fn() + Send + Sync>,
}

impl Outbox {
    pub(super) fn new(events: Sender<Event>, maps: Arc<MapSlots>, wake: Box<dyn Fn() + Send + Sync>) -> Self {
        Self {
            events,
            maps,
            wake: Arc::from(wake),
        }
    }

    /// Sends an event and wakes the reader.
    pub(super) fn send(&self, event: Event) {
        log(&event);
        // The receiver is gone when the session is being dropped.
        let _ = self.events.send(event);
        (self.wake)();
    }

    /// Publishes a map and sends the event for it.
    pub(super) fn publish(&self, map: FrameMap) {
        let (frame, generation) = (map.frame, map.generation);
        if self.maps.publish(map) {
            self.send(Event::Map { frame, generation });
        }
    }

    /// The newest map of a frame.
    pub(super) fn map(&self, frame: usize) -> Option<Arc<FrameMap>> {
        self.maps.get(frame)
    }

    /// Empties the map slots and makes one for each frame.
    pub(super) fn reset_maps(&self, frames: usize) {
        self.maps.reset(frames);
    }
}

/// What a bug report needs to know of the session.
fn log(event: &Event) {
    match event {
        Event::AllMaps { generation } => tracing::info!(generation, "the maps of all frames are published"),
        Event::State(state) => tracing::info!(
            steps = state.steps,
            bytes = state.tensors.len(),
            "the model is saved"
        ),
        Event::Warning(sentence) => tracing::warn!(target: TOLD, "{sentence}"),
        Event::Error(sentence) => tracing::error!(target: TOLD, "{sentence}"),
        Event::Stopped => tracing::info!("the worker has ended"),
        _ => {}
    }
}
