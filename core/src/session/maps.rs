//! The newest map of every frame, shared between the worker and its readers.

use std::sync::{Arc, Mutex, PoisonError};

use crate::labels::{ClassId, VOID};
use crate::semantics::ENTROPY_STEPS_PER_NAT;

/// Dense labels of one frame, row-major `[height, width]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameMap {
    /// Index of the frame.
    pub frame: usize,
    /// Generation of the labels it was made from.
    pub generation: u64,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Most likely class of every pixel; void where nothing is known or the person said so.
    pub labels: Vec<ClassId>,
    /// Entropy of every pixel's class distribution, in nats times [`ENTROPY_STEPS_PER_NAT`].
    pub entropy: Vec<u16>,
}

impl FrameMap {
    /// Mean entropy over all pixels, in nats.
    pub fn mean_entropy(&self) -> f32 {
        let sum: u64 = self.entropy.iter().map(|&e| u64::from(e)).sum();
        sum as f32 / self.entropy.len().max(1) as f32 / ENTROPY_STEPS_PER_NAT
    }

    /// Share of the pixels that have a class, 0..=1.
    pub fn coverage(&self) -> f32 {
        let labelled = self.labels.iter().filter(|&&label| label != VOID).count();
        labelled as f32 / self.labels.len().max(1) as f32
    }
}

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

    /// Number of frames.
    pub fn len(&self) -> usize {
        self.lock().len()
    }

    /// Whether there are no frames (yet).
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Empties all slots and makes one for each of `frames` frames.
    pub fn reset(&self, frames: usize) {
        *self.lock() = vec![None; frames];
    }

    /// Puts a map into its frame's slot unless a newer one is there; returns whether it did.
    pub fn publish(&self, map: FrameMap) -> bool {
        let mut slots = self.lock();
        let Some(slot) = slots.get_mut(map.frame) else {
            return false;
        };
        let newer = slot
            .as_ref()
            .is_none_or(|present| present.generation <= map.generation);
        if newer {
            *slot = Some(Arc::new(map));
        }
        newer
    }

    /// The slots are always whole, so a panic elsewhere does not spoil them.
    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<Option<Arc<FrameMap>>>> {
        self.slots.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(generation: u64, label: ClassId) -> FrameMap {
        FrameMap {
            frame: 1,
            generation,
            width: 1,
            height: 1,
            labels: vec![label],
            entropy: vec![0],
        }
    }

    #[test]
    fn a_stale_map_never_replaces_a_newer_one() {
        let slots = MapSlots::default();
        slots.reset(2);
        assert!(slots.publish(map(5, 1)));
        assert!(!slots.publish(map(4, 2)));
        assert_eq!(slots.get(1).unwrap().labels, [1]);
        assert!(slots.publish(map(5, 3)));
        assert_eq!(slots.get(1).unwrap().labels, [3]);
        assert!(slots.get(0).is_none());
    }
}
