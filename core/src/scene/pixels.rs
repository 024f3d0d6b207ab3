//! The pixels of a frame: in memory, or read from its files whenever they are wanted.

use std::fmt;
use std::sync::Arc;

use super::cache::Cache;
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

/// Reads a frame's pixels from its files once more, or says why they cannot be read any more.
pub(super) type Decode = Box<dyn Fn() -> Result<Pixels, SceneError> + Send + Sync>;

/// Where the pixels of a frame are.
#[derive(Clone)]
pub struct FramePixels(Place);

#[derive(Clone)]
enum Place {
    InMemory(Pixels),
    OnDisk(Arc<OnDisk>),
}

/// Pixels that were read once when the capture was opened, and what was found out about them then.
pub(super) struct OnDisk {
    /// The key of this frame in the cache.
    pub number: usize,
    /// Share of the pixels whose depth is known, 0..=1; `None` without depth.
    pub coverage: Option<f32>,
    /// Number of the pixels that alpha or masks hide.
    pub hidden: usize,
    /// How sharp the image is ([`sharpness`](super::keyframes::sharpness)).
    pub sharpness: f32,
    pub decode: Decode,
    /// What was read last of any of the frames.
    pub cache: Arc<Cache<Pixels>>,
}

impl From<Pixels> for FramePixels {
    /// Pixels that stay in memory.
    fn from(pixels: Pixels) -> Self {
        Self(Place::InMemory(pixels))
    }
}

impl FramePixels {
    /// Pixels that stay in memory.
    pub fn new(color: ColorImage, depth: Option<DepthMap>) -> Self {
        Pixels::new(color, depth).into()
    }

    pub(super) fn on_disk(place: OnDisk) -> Self {
        Self(Place::OnDisk(Arc::new(place)))
    }

    /// Whether they stay in memory.
    pub(super) fn are_in_memory(&self) -> bool {
        matches!(self.0, Place::InMemory(_))
    }

    /// Share of the pixels whose depth is known, 0..=1; `None` without measured depth.
    pub(super) fn coverage(&self) -> Option<f32> {
        match &self.0 {
            Place::InMemory(pixels) => pixels.depth.as_ref().map(|depth| depth.coverage()),
            Place::OnDisk(place) => place.coverage,
        }
    }

    /// Whether there is measured depth.
    pub(super) fn have_depth(&self) -> bool {
        match &self.0 {
            Place::InMemory(pixels) => pixels.depth.is_some(),
            Place::OnDisk(place) => place.coverage.is_some(),
        }
    }

    /// Number of the pixels that alpha or masks hide.
    pub(super) fn hidden(&self) -> usize {
        match &self.0 {
            Place::InMemory(pixels) => pixels.color.hidden(),
            Place::OnDisk(place) => place.hidden,
        }
    }

    /// Whether alpha or masks hide any pixel.
    pub(super) fn have_hidden(&self) -> bool {
        match &self.0 {
            Place::InMemory(pixels) => pixels.color.has_hidden(),
            Place::OnDisk(place) => place.hidden > 0,
        }
    }

    /// How sharp the image is; `None` where it stays in memory, as nobody has to choose it then.
    pub(super) fn sharpness(&self) -> Option<f32> {
        match &self.0 {
            Place::InMemory(_) => None,
            Place::OnDisk(place) => Some(place.sharpness),
        }
    }

    /// The pixels, as far as no file has to be read for them.
    pub(super) fn at_hand(&self) -> Option<Pixels> {
        match &self.0 {
            Place::InMemory(pixels) => Some(pixels.clone()),
            Place::OnDisk(place) => place.cache.get(place.number),
        }
    }

    /// What `see` finds in the pixels. Of a frame in memory they are lent: threads that look at many single pixels
    /// would spend their time on counting who shares them.
    ///
    /// # Errors
    /// A file that can no longer be read.
    pub(super) fn look<T>(&self, see: impl FnOnce(&Pixels) -> T) -> Result<T, SceneError> {
        match &self.0 {
            Place::InMemory(pixels) => Ok(see(pixels)),
            Place::OnDisk(_) => self.get().map(|pixels| see(&pixels)),
        }
    }

    /// The pixels.
    ///
    /// # Errors
    /// A file that can no longer be read.
    pub(super) fn get(&self) -> Result<Pixels, SceneError> {
        match &self.0 {
            Place::InMemory(pixels) => Ok(pixels.clone()),
            Place::OnDisk(place) => match place.cache.get(place.number) {
                Some(pixels) => Ok(pixels),
                None => {
                    let pixels = (place.decode)()?;
                    place.cache.put(place.number, pixels.size(), pixels.clone());
                    Ok(pixels)
                }
            },
        }
    }
}

impl fmt::Debug for FramePixels {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.0 {
            Place::InMemory(pixels) => pixels.fmt(formatter),
            Place::OnDisk(place) => formatter.debug_tuple("OnDisk").field(&place.number).finish(),
        }
    }
}
