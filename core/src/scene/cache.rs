//! Values that can be made again: those used last are kept, up to a number of bytes.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// The values used last. Shared between threads.
#[derive(Debug)]
pub(crate) struct Cache<V> {
    most: usize,
    kept: Mutex<Vec<Kept<V>>>,
}

/// A value, in the order of last use.
#[derive(Debug)]
struct Kept<V> {
    key: usize,
    bytes: usize,
    value: V,
}

impl<V: Clone> Cache<V> {
    /// Keeps values of at most so many bytes together; a single larger one is kept until the next comes.
    pub(crate) fn new(most: usize) -> Self {
        let kept = Mutex::new(Vec::new());
        Self { most, kept }
    }

    /// The value of this key, if it is still kept.
    pub(crate) fn get(&self, key: usize) -> Option<V> {
        let mut kept = self.lock();
        let place = kept.iter().position(|known| known.key == key)?;
        kept[place..].rotate_left(1);
        kept.last().map(|newest| newest.value.clone())
    }

    /// Keeps a value of so many bytes, in place of those that were not used for longest.
    pub(crate) fn put(&self, key: usize, bytes: usize, value: V) {
        let mut kept = self.lock();
        kept.retain(|known| known.key != key);
        kept.push(Kept { key, bytes, value });
        let mut total: usize = kept.iter().map(|known| known.bytes).sum();
        while total > self.most && kept.len() > 1 {
            total -= kept.remove(0).bytes;
        }
    }

    /// What is kept is always whole, so a panic elsewhere does not spoil it.
    fn lock(&self) -> MutexGuard<'_, Vec<Kept<V>>> {
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
