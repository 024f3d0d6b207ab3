//! Multi-view stereo: the depth of a capture of colours alone, in stages that a caller can use one after the other.
//!
//! A sweep over small images tells how deep the scene is and which views go together. Then each view is matched with
//! others at half size (`sweep`, `aggregation`), kept where several agree (`consistency`), and filled in between
//! (`filling`). The same follows at full size, around the depth that is known by then.

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
use exploration::explore;
use level::Level;
use view::View;

/// Most pixels of an image of full size, and of all of them together; larger ones are reduced.
const MOST_PIXELS: usize = 160_000;
const MOST_PIXELS_IN_ALL: usize = 20_000_000;

/// How well a depth is supported.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Support {
    /// Continued from the surroundings.
    Filled,
    /// Continued from the surroundings, in several views alike.
    Voted,
    /// Matched, in several views alike.
    Confident,
}

impl Support {
    /// The word for it in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Filled => "filled",
            Self::Voted => "voted",
            Self::Confident => "confident",
        }
    }
}

/// Estimated depth of a frame, at the frame's size or a reduced one.
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
    support: Vec<Support>,
}

impl StereoDepth {
    /// Of inverse z-depths per metre; 0 = unknown.
    fn new(frame: usize, view: &View, inverse: &[f32], support: Vec<Support>) -> Self {
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
            support,
        }
    }

    /// Depth along the camera's z axis of the pixel with this row-major index, in metres; `None` = unknown.
    pub fn z_depth(&self, index: usize) -> Option<f32> {
        let steps = self.steps[index];
        (steps > 0).then(|| 1.0 / (f32::from(steps) * self.unit))
    }

    /// How well the depth of the pixel with this row-major index is supported.
    pub fn support(&self, index: usize) -> Support {
        self.support[index]
    }
}

/// A size that images are matched at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Size {
    /// A quarter of the width and height, to explore the scene: its depth is not published.
    Quarter,
    /// Half of the width and height.
    Half,
    /// That of the images, unless they are large.
    Full,
}

impl Size {
    /// The word for it in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Quarter => "quarter",
            Self::Half => "half",
            Self::Full => "full",
        }
    }

    /// Those that depth is published at, up to this one.
    fn up_to(self) -> impl Iterator<Item = Self> {
        [Self::Half, Self::Full]
            .into_iter()
            .filter(move |&size| size <= self)
    }
}

/// What has been done when depth is published.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stage {
    /// Size of the depth.
    pub size: Size,
    /// What was added last: after [`Support::Confident`] all pixels that any others tell about have depth.
    pub support: Support,
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

/// Estimates the depth of all keyframes from their colours, up to this size; sparse points help, measured depth is not
/// looked at.
///
/// `publish` gets the depth of all of them after each [`Stage`]. `go_on` is told the share of the work that is done, from
/// any thread, and stops it by `false`. The result is the same for any number of threads, those of the rayon pool in
/// which this is called.
///
/// # Errors
/// Cameras that are all in one place, a file that can no longer be read, or a caller that wants no more.
pub fn estimate(
    scene: &Scene,
    most: Size,
    publish: &mut dyn FnMut(Stage, Vec<StereoDepth>),
    go_on: &(dyn Fn(f32) -> bool + Sync),
) -> Result<(), StereoError> {
    let frames = scene.keyframes();
    let work = Work {
        go_on,
        done: AtomicUsize::new(0),
        total: frames.len() * Work::of_view(most),
    };
    let stride = stride(scene, &frames);
    let small = Level::read(scene, &frames, stride, Size::Quarter)?;
    let setup = explore(&small, scene, &frames, &work)?;
    drop(small);
    let mut known: Option<(Level, Vec<Vec<f32>>)> = None;
    for size in most.up_to() {
        let level = Level::read(scene, &frames, stride, size)?;
        let around = known
            .take()
            .map(|(half, inverse)| level.enlarged(&half, &inverse));
        let matched = level.matched(&setup, around.as_deref(), &work)?;
        drop(around);
        let seeds = level.seeds(&setup, &matched);
        drop(matched);
        let filled = level.completed(&setup, seeds, &work, &mut |support, inverse, supports| {
            let views = frames.iter().zip(&level.views).zip(inverse.iter().zip(supports));
            let maps = views.map(|((&frame, view), (inverse, support))| {
                StereoDepth::new(frame, view, inverse, support.clone())
            });
            publish(Stage { size, support }, maps.collect());
        })?;
        known = Some((level, filled));
    }
    Ok(())
}

/// Pixels of a frame for one of full size, along each axis.
fn stride(scene: &Scene, frames: &[usize]) -> u32 {
    let pixels = || frames.iter().map(|&frame| scene.frames[frame].camera.pixels());
    let largest = pixels().max().unwrap_or(0) as f64 / MOST_PIXELS as f64;
    let all = pixels().sum::<usize>() as f64 / MOST_PIXELS_IN_ALL as f64;
    (largest.max(all).sqrt().ceil() as u32).max(1)
}

/// How far the work is, in parts that take about as long as matching one small image does.
struct Work<'a> {
    go_on: &'a (dyn Fn(f32) -> bool + Sync),
    done: AtomicUsize,
    total: usize,
}

impl Work<'_> {
    /// Parts for matching a view at a quarter, half and full size, and for filling it.
    const MATCHING: [usize; 3] = [1, 6, 10];
    const FILLING: [usize; 3] = [0, 1, 4];

    /// Parts of a view: it is filled twice at each size.
    fn of_view(most: Size) -> usize {
        let parts = most
            .up_to()
            .map(|size| Self::MATCHING[size as usize] + 2 * Self::FILLING[size as usize]);
        Self::MATCHING[Size::Quarter as usize] + parts.sum::<usize>()
    }

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
