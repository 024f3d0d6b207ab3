//! Values that can be made again: those used last are kept, up to a number of bytes.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

/// The values used last, each with the bytes that it takes. Shared between threads.
#[derive(Debug)]
pub(crate) struct Cache<V> {
    most: usize,
    kept: Mutex<Kept<V>>,
}

#[derive(Debug)]
struct Kept<V> {
    /// By key: when it was used last, its bytes and itself.
    values: BTreeMap<usize, (u64, usize, V)>,
    bytes: usize,
    clock: u64,
}

impl<V: Clone> Cache<V> {
    /// Keeps values of at most so many bytes together; a single larger one is kept until the next comes.
    pub(crate) fn new(most: usize) -> Self {
        let kept = Kept {
            values: BTreeMap::new(),
            bytes: 0,
            clock: 0,
        };
        Self {
            most,
            kept: Mutex::new(kept),
        }
    }

    /// The value of this key, if it is still kept.
    pub(crate) fn get(&self, key: usize) -> Option<V> {
        let mut kept = self.lock();
        kept.clock += 1;
        let now = kept.clock;
        let (used, _, value) = kept.values.get_mut(&key)?;
        *used = now;
        Some(value.clone())
    }

    /// Keeps a value of so many bytes, in place of those that were not used for longest.
    pub(crate) fn put(&self, key: usize, bytes: usize, value: V) {
        let mut kept = self.lock();
        kept.clock += 1;
        let now = kept.clock;
        if let Some((_, before, _)) = kept.values.insert(key, (now, bytes, value)) {
            kept.bytes -= before;
        }
        kept.bytes += bytes;
        while kept.bytes > self.most && kept.values.len() > 1 {
            let oldest = kept.values.iter().min_by_key(|(_, (used, ..))| *used);
            let Some(oldest) = oldest.map(|(&key, _)| key) else {
                break;
            };
            if let Some((_, bytes, _)) = kept.values.remove(&oldest) {
                kept.bytes -= bytes;
            }
        }
    }

    /// What is kept is always whole, so a panic elsewhere does not spoil it.
    fn lock(&self) -> std::sync::MutexGuard<'_, Kept<V>> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_not_used_for_longest_goes_first_and_the_newest_always_stays() {
        let cache = Cache::new(10);
        cache.put(1, 4, 'a');
        cache.put(2, 4, 'b');
        assert_eq!(cache.get(1), Some('a'));
        cache.put(3, 4, 'c');
        assert_eq!([1, 2, 3].map(|key| cache.get(key)), [Some('a'), None, Some('c')]);
        // A value that is replaced counts once.
        cache.put(3, 6, 'd');
        assert_eq!([1, 3].map(|key| cache.get(key)), [Some('a'), Some('d')]);
        cache.put(4, 99, 'e');
        assert_eq!([1, 3, 4].map(|key| cache.get(key)), [None, None, Some('e')]);
    }
}
