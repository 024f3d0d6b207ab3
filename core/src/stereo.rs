//! Multi-view stereo: the depth of a capture of colours alone.
//!
//! A sweep over small images tells how deep the scene is and which views go together. Then each view is matched with
//! others at twice that size (`sweep`, `aggregation`), kept where several agree (`consistency`), and filled in between
//! (`filling`).

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
use filling::Seed;
use level::Level;
use view::View;

/// Most pixels of an image, and of all of them together, for a reduction by two; larger ones are reduced further.
const MOST_PIXELS: usize = 160_000;
const MOST_PIXELS_IN_ALL: usize = 20_000_000;
/// Parts of the work for matching a view in a small image and in a larger one, and for filling it, which is done twice.
const EXPLORING: usize = 1;
const MATCHING: usize = 6;
const FILLING: usize = 1;

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
/// at less; sparse points help, measured depth is not looked at.
///
/// `go_on` is told the share of the work that is done, from any thread, and stops it by `false`. The result is the same
/// for any number of threads, those of the rayon pool in which this is called.
///
/// # Errors
/// Cameras that are all in one place, a file that can no longer be read, or a caller that wants no more.
pub fn estimate(
    scene: &Scene,
    go_on: &(dyn Fn(f32) -> bool + Sync),
) -> Result<Vec<StereoDepth>, StereoError> {
    let frames = scene.keyframes();
    let work = Work {
        go_on,
        done: AtomicUsize::new(0),
        total: frames.len() * (EXPLORING + MATCHING + 2 * FILLING),
    };
    let stride = stride(scene, &frames);
    let small = Level::read(scene, &frames, 2 * stride, &work)?;
    let setup = explore(&small, scene, &frames, &work)?;
    drop(small);
    let level = Level::read(scene, &frames, stride, &work)?;
    let matched = level.matched(&setup, MATCHING, &work)?;
    let mut seeds = level.seeds(&setup, &matched);
    drop(matched);
    let inverse = level.completed(&setup, &mut seeds, &work)?;
    let views = frames.iter().zip(&level.views).zip(inverse.iter().zip(&seeds));
    let depth = views.map(|((&frame, view), (inverse, seeds))| {
        StereoDepth::new(
            frame,
            view,
            inverse,
            seeds.iter().map(Seed::is_confident).collect(),
        )
    });
    Ok(depth.collect())
}

/// Pixels of a frame for one that is matched, along each axis.
fn stride(scene: &Scene, frames: &[usize]) -> u32 {
    let pixels = || frames.iter().map(|&frame| scene.frames[frame].camera.pixels());
    let largest = pixels().max().unwrap_or(0) as f64 / MOST_PIXELS as f64;
    let all = pixels().sum::<usize>() as f64 / MOST_PIXELS_IN_ALL as f64;
    2 * (largest.max(all).sqrt().ceil() as u32).max(1)
}

/// How far the work is, in parts that take about as long as matching one of the smallest images does.
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
