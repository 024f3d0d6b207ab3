//! The newest map of every frame, shared between the worker and its readers.

use std::sync::{Arc, Mutex, PoisonError};

use crate::semantics::{FrameMap, Surface};

/// One slot per frame that always holds the newest map; an older generation never replaces a newer one.
#[derive(Debug, Default)]
pub struct MapSlots {
    slots: Mutex<Vec<Option<Arc<FrameMap>>>>,
}

impl MapSlots {
    /// The newest map of a frame.
    pub fn get(&self, frame: usize) -> Option<Arc<FrameMap>> {
        self.lock().get(frame).cloned().flatten()
    }

    /// The surface of the first map that follows from one.
    pub fn surface(&self) -> Option<Arc<Surface>> {
        let mut maps = self.lock().clone().into_iter().flatten();
        maps.find_map(|map| map.surface().map(|(surface, _)| Arc::clone(surface)))
    }

    /// Number of frames.
    pub(crate) fn len(&self) -> usize {
        self.lock().len()
    }

    /// Empties all slots and makes one for each of `frames` frames.
    pub fn reset(&self, frames: usize) {
        *self.lock() = vec![None; frames];
    }

    /// Puts a map into its frame's slot unless a newer one is there; returns whether it did.
    pub fn publish(&self, map: impl Into<Arc<FrameMap>>) -> bool {
        let map = map.into();
        let mut slots = self.lock();
        let Some(slot) = slots.get_mut(map.frame) else {
            return false;
        };
        let newer = slot
            .as_ref()
            .is_none_or(|present| present.generation <= map.generation);
        if newer {
            *slot = Some(map);
        }
        newer
    }

    /// The slots are always whole, so a panic elsewhere does not spoil them.
    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<Option<Arc<FrameMap>>>> {
        self.slots.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
