//! Multi-view stereo: the depth of a capture of colours alone.
//!
//! A sweep over small images tells how deep the scene is and which views go together. Then each view is matched with
//! others at twice that size and again at four times (`sweep`, `aggregation`), kept where several agree (`consistency`),
//! and filled in between (`filling`).

mod aggregation;
mod consistency;
mod exploration;
mod filling;
mod level;
mod selection;
mod sweep;
mod view;

use std::sync::atomic::{AtomicUsize, Ordering};

use crate::scene::{Camera, Scene, SceneError};
use exploration::Setup;
use level::Level;
use view::View;

/// Most pixels of an image, and of all of them together, for a reduction by two; larger ones are reduced further.
const MOST_PIXELS: usize = 160_000;
const MOST_PIXELS_IN_ALL: usize = 20_000_000;
/// The nearest depth of the scene as a share of the nearest that is found in the smallest images, and in larger ones, which
/// show more of what is near.
const MARGINS: [f32; 2] = [0.65, 0.8];
/// Parts of the work for matching a view at each size, the smallest first, and for filling it, which is done twice.
const MATCHING: [usize; 3] = [2, 6, 40];
const FILLING: [usize; 2] = [1, 5];

/// Estimated depth of a frame, at a reduced size.
#[derive(Clone, Debug)]
pub struct StereoDepth {
    /// Index of the frame.
    pub frame: usize,
    /// Pixels of the frame per pixel here, along each axis.
    pub stride: u32,
    /// The frame's camera [reduced](Camera::reduced) by that.
    pub camera: Camera,
    /// Inverse z-depth in steps of `unit` per metre, row-major `[height, width]`; 0 = unknown.
    steps: Vec<u16>,
    unit: f32,
    is_confident: Vec<bool>,
}

impl StereoDepth {
    /// Of inverse z-depths per metre; 0 = unknown.
    fn new(frame: usize, view: &View, inverse: &[f32], is_confident: Vec<bool>) -> Self {
        let nearest = inverse.iter().copied().fold(0.0, f32::max);
        let unit = (nearest / f32::from(u16::MAX)).max(f32::MIN_POSITIVE);
        let steps = |&inverse: &f32| match inverse > 0.0 {
            true => ((inverse / unit).round() as u16).max(1),
            false => 0,
        };
        Self {
            frame,
            stride: view.stride,
            camera: view.camera,
            steps: inverse.iter().map(steps).collect(),
            unit,
            is_confident,
        }
    }

    /// Depth along the camera's z axis of the pixel with this row-major index, in metres; `None` = unknown.
    pub fn z_depth(&self, index: usize) -> Option<f32> {
        let steps = self.steps[index];
        (steps > 0).then(|| 1.0 / (f32::from(steps) * self.unit))
    }

    /// Whether the pixel with this row-major index was matched, in several views alike, or is continued from others.
    pub fn is_confident(&self, index: usize) -> bool {
        self.is_confident[index]
    }
}

/// Why there is no depth.
#[derive(Debug, thiserror::Error)]
pub enum StereoError {
    /// All cameras are in one place, or there is only one.
    #[error("the cameras are all in one place, from which depth cannot be told; add frames from elsewhere")]
    NoParallax,
    /// A file that can no longer be read.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The caller wanted no more.
    #[error("the estimation of depth was stopped")]
    Stopped,
}

/// Estimates the depth of all keyframes from their colours, at half of their width and height or, where they are large,
/// at less; sparse points help, measured depth is not looked at. After a fifth of the time, `first` is given what is known
/// at half of that size.
///
/// `go_on` is told the share of the work that is done, from any thread, and stops it by `false`. The result is the same
/// for any number of threads, those of the rayon pool in which this is called.
///
/// # Errors
/// Cameras that are all in one place, a file that can no longer be read, or a caller that wants no more.
pub fn estimate(
    scene: &Scene,
    first: Option<&mut dyn FnMut(Vec<StereoDepth>)>,
    go_on: &(dyn Fn(f32) -> bool + Sync),
) -> Result<Vec<StereoDepth>, StereoError> {
    let frames = scene.keyframes();
    let filling = FILLING[1] + first.as_ref().map_or(0, |_| FILLING[0]);
    let parts = MATCHING.iter().sum::<usize>() + 2 * filling;
    let work = Work {
        go_on,
        done: AtomicUsize::new(0),
        total: frames.len() * parts,
    };
    let [small, middle, large] = Level::read(scene, &frames, [4, 2, 1], &work)?;
    let mut setup = Setup::assumed(&small.views, scene, &frames)?;
    let matched = small.matched(&setup, MATCHING[0], &work)?;
    setup.improve(&small, &matched, MARGINS[0]);
    let matched = middle.matched(&setup, MATCHING[1], &work)?;
    setup.improve(&middle, &matched, MARGINS[1]);
    if let Some(first) = first {
        first(middle.depth(&frames, &setup, matched, FILLING[0], &work)?);
    }
    let matched = large.matched(&setup, MATCHING[2], &work)?;
    large.depth(&frames, &setup, matched, FILLING[1], &work)
}

/// Pixels of each frame for one that is matched, along each axis.
fn strides(scene: &Scene, frames: &[usize]) -> Vec<u32> {
    let pixels = || frames.iter().map(|&frame| scene.frames[frame].camera.pixels());
    let all = pixels().sum::<usize>() as f64 / MOST_PIXELS_IN_ALL as f64;
    let own = pixels().map(|pixels| (pixels as f64 / MOST_PIXELS as f64).max(all));
    own.map(|over| 2 * (over.sqrt().ceil() as u32).max(1)).collect()
}

/// How far the work is, in parts that all take about as long.
struct Work<'a> {
    go_on: &'a (dyn Fn(f32) -> bool + Sync),
    done: AtomicUsize,
    total: usize,
}

impl Work<'_> {
    fn advance(&self, parts: usize) -> Result<(), StereoError> {
        let done = self.done.fetch_add(parts, Ordering::Relaxed) + parts;
        match (self.go_on)(done as f32 / self.total as f32) {
            true => Ok(()),
            false => Err(StereoError::Stopped),
        }
    }
}

#[cfg(test)]
pub(crate) mod tests;
