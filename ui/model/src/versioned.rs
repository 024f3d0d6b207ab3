//! Values with a number that tells them apart, so that a renderer uploads only what is new.

use std::ops::Deref;
use std::sync::atomic::{AtomicU64, Ordering};

/// A number that nothing else in this process has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Version(u64);

impl Version {
    /// The next number; greater than all before it.
    #[expect(clippy::new_without_default, reason = "two of them are never equal")]
    pub fn new() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(1);
        Self(NEXT.fetch_add(1, Ordering::Relaxed))
    }
}

/// A value with the version of what it was made from. Clones have the same version.
#[derive(Clone, Debug)]
pub struct Versioned<T> {
    value: T,
    version: Version,
}

impl<T> Versioned<T> {
    /// A value that is new.
    pub fn new(value: T) -> Self {
        Self::with(value, Version::new())
    }

    /// Another form of what has this version.
    pub fn with(value: T, version: Version) -> Self {
        Self { value, version }
    }

    /// What tells it from other values.
    pub fn version(&self) -> Version {
        self.version
    }
}

impl<T> Deref for Versioned<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.value
    }
}
