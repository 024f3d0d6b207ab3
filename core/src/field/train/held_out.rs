//! The error of a field on pixels that it was not trained on.

use glam::Vec3;
use rand::{Rng, SeedableRng, rngs::SmallRng};

use super::super::exposure::corrected_error;
use super::super::{Ray, RenderedRay, median};
use crate::scene::Scene;

/// Number of pixels that the held-out error is measured on.
const PIXELS: usize = 1024;

/// The error on frames that the field never trained on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldOut {
    /// Peak signal-to-noise ratio of the colours, in dB, where a frame's own exposure does not count as
    /// an error.
    pub psnr: f32,
    /// Median absolute error of the ray length where depth is measured, in metres.
    pub depth_error: Option<f32>,
    /// The same as a share of the ray length.
    pub relative_depth_error: Option<f32>,
    /// Share of those pixels whose error is at most a tenth of the ray length, 0..=1.
    pub within_tenth: Option<f32>,
}

/// Random pixels of the frames that are held out of the training.
#[derive(Clone, Debug)]
pub struct HeldOutPixels {
    /// (frame, pixel indices).
    frames: Vec<(usize, Vec<usize>)>,
}

impl HeldOutPixels {
    /// Holds out every twentieth keyframe, at most eight, and none of a capture of fewer than eight; also returns the
    /// keyframes to train on. What lost cameras see is outside of the volume: theirs are neither.
    pub fn split(scene: &Scene, seed: u64) -> (Self, Vec<usize>) {
        let (mut keyframes, cameras) = (scene.keyframes(), scene.cameras());
        keyframes.retain(|&frame| cameras.contains(scene.frames[frame].center()));
        let frames = keyframes.len();
        let count = if frames < 8 { 0 } else { (frames / 20).clamp(1, 8) };
        let held: Vec<usize> = (0..count)
            .map(|k| keyframes[(2 * k + 1) * frames / (2 * count)])
            .collect();
        let train = keyframes.into_iter().filter(|frame| !held.contains(frame));
        let train = train.collect();
        let mut rng = SmallRng::seed_from_u64(seed ^ 0x4e1d);
        let pixels_of = |&frame: &usize| {
            let own = &scene.frames[frame];
            let drawn = (0..PIXELS / count).map(|_| rng.random_range(0..own.camera.pixels()));
            (frame, drawn.filter(|&index| own.is_valid(index)).collect())
        };
        let frames = held.iter().map(pixels_of).collect();
        (Self { frames }, train)
    }

    /// The rays of the pixels, a frame after another, without measured length.
    pub fn rays(&self, scene: &Scene) -> Vec<Ray> {
        let ray = |frame: usize, index: usize| Ray {
            length: None,
            ..Ray::through(&scene.frames[frame], index)
        };
        self.frames
            .iter()
            .flat_map(|(frame, pixels)| pixels.iter().map(move |&index| ray(*frame, index)))
            .collect()
    }

    /// The error of what was rendered along [`HeldOutPixels::rays`] against `truth`; `None` where no frame
    /// is held out.
    pub fn error(&self, rendered: &[RenderedRay], truth: &Scene) -> Option<HeldOut> {
        let mut squared = 0.0;
        let mut errors = Vec::new();
        let mut rest = rendered;
        for (frame, pixels) in &self.frames {
            let frame = &truth.frames[*frame];
            let (own, others) = rest.split_at_checked(pixels.len())?;
            rest = others;
            let shown: Vec<Vec3> = own.iter().map(|ray| ray.color).collect();
            let (color, depth) = (frame.color(), frame.depth());
            let measured: Vec<Vec3> = pixels.iter().map(|&index| color.color(index)).collect();
            squared += corrected_error(&shown, &measured) * pixels.len() as f32;
            for (ray, &index) in own.iter().zip(pixels) {
                if let Some(measured) = depth.as_ref().and_then(|depth| depth.ray_length(index)) {
                    let error = ray
                        .length
                        .map_or(f32::INFINITY, |length| (length - measured).abs());
                    errors.push((error, error / measured));
                }
            }
        }
        let median = |part: fn(&(f32, f32)) -> f32| median(errors.iter().map(part).collect());
        // A clamp leaves what is not a number, which is a collapse, as it is.
        let error = (squared / rendered.len() as f32).clamp(1e-10, f32::INFINITY);
        let close = errors.iter().filter(|(_, relative)| *relative <= 0.1).count();
        (!rendered.is_empty()).then(|| HeldOut {
            psnr: -10.0 * error.log10(),
            depth_error: median(|(error, _)| *error),
            relative_depth_error: median(|(_, relative)| *relative),
            within_tenth: (!errors.is_empty()).then(|| close as f32 / errors.len() as f32),
        })
    }
}
