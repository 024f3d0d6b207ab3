//! The pixels of a frame: in memory, or read from its files whenever they are wanted.

use std::fmt;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use super::cache::Cache;
use super::error::ImageError;
use super::files::unreadable;
use super::images::Turn;
use super::{ColorImage, DepthMap, SceneError};

/// Colours and measured depth of a frame; copies share them.
#[derive(Clone, Debug, PartialEq)]
pub struct Pixels {
    /// The colour image.
    pub color: Arc<ColorImage>,
    /// Measured depth, where the capture has it.
    pub depth: Option<Arc<DepthMap>>,
}

impl Pixels {
    /// Of an image and the depth measured with it.
    pub fn new(color: ColorImage, depth: Option<DepthMap>) -> Self {
        Self {
            color: Arc::new(color),
            depth: depth.map(Arc::new),
        }
    }

    /// Bytes that they take in memory.
    pub(super) fn size(&self) -> usize {
        let depth = self.depth.as_ref().map_or(0, |depth| depth.len());
        self.color.bytes().len() + size_of::<u16>() * depth
    }
}

/// Where the pixels of a frame are, and what was found out about them when they were read first.
#[derive(Clone)]
pub struct FramePixels {
    /// Share of the pixels whose depth is known, 0..=1; `None` without measured depth.
    pub(super) coverage: Option<f32>,
    /// Number of the pixels that alpha or masks hide.
    pub(super) hidden: usize,
    place: Place,
}

#[derive(Clone)]
enum Place {
    InMemory(Pixels),
    OnDisk(Arc<OnDisk>),
    Unread(Arc<Unread>),
}

/// What the files of a frame gave when they were read first.
#[derive(Clone)]
pub(super) struct FirstRead {
    pub pixels: Pixels,
    /// What became of the orientation of the image.
    pub turn: Turn,
    /// The depth image, and why it cannot be used.
    pub depth_problem: Option<String>,
}

/// What was read first, or why the image cannot be used.
pub(super) type FirstReading = Result<FirstRead, ImageError>;

/// The files of a frame before they are read: whoever wants its pixels first reads them, for everybody.
pub(super) struct Unread {
    /// The image, for messages.
    path: PathBuf,
    read: Box<dyn Fn() -> FirstReading + Send + Sync>,
    /// Locked while somebody reads; what cannot be used is read again by the next.
    done: Mutex<Option<FirstRead>>,
}

impl Unread {
    /// Files that `read` reads.
    pub fn new(path: PathBuf, read: impl Fn() -> FirstReading + Send + Sync + 'static) -> Self {
        Self {
            path,
            read: Box::new(read),
            done: Mutex::new(None),
        }
    }

    /// What they give; it stays in memory. Waits for whoever is reading them.
    pub fn shared(&self) -> FirstReading {
        // What is there is whole, so a panic in another thread does not spoil it.
        let mut done = self.done.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(read) = &*done {
            return Ok(read.clone());
        }
        let read = (self.read)()?;
        *done = Some(read.clone());
        Ok(read)
    }

    /// What they give, for nobody else.
    pub fn read(&self) -> FirstReading {
        (self.read)()
    }

    /// The pixels out of what was read.
    ///
    /// # Errors
    /// Files that cannot be used.
    pub fn pixels(&self, read: FirstReading) -> Result<Pixels, SceneError> {
        let read = read.map_err(|error| unreadable(&self.path, error))?;
        Ok(read.pixels)
    }
}

/// Pixels that are read again whenever they are wanted.
pub(super) struct OnDisk {
    /// The key of this frame in the cache.
    pub number: usize,
    /// How sharp the image is ([`sharpness`](super::keyframes::sharpness)).
    pub sharpness: f32,
    /// Reads them from their files once more, or says why they cannot be read any more.
    pub decode: Box<dyn Fn() -> Result<Pixels, SceneError> + Send + Sync>,
    /// What was read last of any of the frames.
    pub cache: Arc<Cache<Pixels>>,
}

impl From<Pixels> for FramePixels {
    /// Pixels that stay in memory.
    fn from(pixels: Pixels) -> Self {
        Self {
            coverage: pixels.depth.as_ref().map(|depth| depth.coverage()),
            hidden: pixels.color.hidden(),
            place: Place::InMemory(pixels),
        }
    }
}

impl FramePixels {
    /// Pixels that do not, with the [`coverage`](Self::coverage) of their depth and the number of hidden ones.
    pub(super) fn on_disk(coverage: Option<f32>, hidden: usize, place: OnDisk) -> Self {
        Self {
            coverage,
            hidden,
            place: Place::OnDisk(Arc::new(place)),
        }
    }

    /// Pixels that stay in memory as soon as they were read. Until then nothing is known to be hidden, and depth images
    /// count as complete.
    pub(super) fn unread(files: Arc<Unread>, has_depth: bool) -> Self {
        Self {
            coverage: has_depth.then_some(1.0),
            hidden: 0,
            place: Place::Unread(files),
        }
    }

    /// Whether they stay in memory.
    pub(super) fn are_in_memory(&self) -> bool {
        matches!(self.place, Place::InMemory(_) | Place::Unread(_))
    }

    /// How sharp the image is; `None` where it stays in memory, as nobody has to choose it then.
    pub(super) fn sharpness(&self) -> Option<f32> {
        match &self.place {
            Place::InMemory(_) | Place::Unread(_) => None,
            Place::OnDisk(place) => Some(place.sharpness),
        }
    }

    /// The pixels, as far as no file has to be read for them.
    pub(super) fn at_hand(&self) -> Option<Pixels> {
        match &self.place {
            Place::InMemory(pixels) => Some(pixels.clone()),
            Place::OnDisk(place) => place.cache.get(place.number),
            Place::Unread(files) => {
                let done = files.done.try_lock().ok()?;
                Some(done.as_ref()?.pixels.clone())
            }
        }
    }

    /// What `see` finds in the pixels. Of a frame in memory they are lent: threads that look at many single pixels
    /// would spend their time on counting who shares them.
    ///
    /// # Errors
    /// A file that can no longer be read.
    pub(super) fn look<T>(&self, see: impl FnOnce(&Pixels) -> T) -> Result<T, SceneError> {
        match &self.place {
            Place::InMemory(pixels) => Ok(see(pixels)),
            Place::OnDisk(_) | Place::Unread(_) => self.get().map(|pixels| see(&pixels)),
        }
    }

    /// The pixels.
    ///
    /// # Errors
    /// A file that can no longer be read.
    pub(super) fn get(&self) -> Result<Pixels, SceneError> {
        match &self.place {
            Place::InMemory(pixels) => Ok(pixels.clone()),
            Place::OnDisk(place) => match place.cache.get(place.number) {
                Some(pixels) => Ok(pixels),
                None => {
                    let pixels = (place.decode)()?;
                    place.cache.put(place.number, pixels.size(), pixels.clone());
                    Ok(pixels)
                }
            },
            Place::Unread(files) => files.pixels(files.shared()),
        }
    }
}

impl fmt::Debug for FramePixels {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.place {
            Place::InMemory(pixels) => pixels.fmt(formatter),
            Place::OnDisk(place) => formatter.debug_tuple("OnDisk").field(&place.number).finish(),
            Place::Unread(files) => formatter.debug_tuple("Unread").field(&files.path).finish(),
        }
    }
}
