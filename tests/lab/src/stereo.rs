//! How good the depth is that multi-view stereo estimates from colours alone, beside measured depth that it never sees.

use std::time::{Duration, Instant};

use serde::Serialize;

use super::Failure;
use inplace_core::scene::reprojection::refine;
use inplace_core::scene::{Frame, Scene};
use inplace_core::stereo::{Size, Stage, StereoDepth, estimate};

/// Neighbouring pixels whose depths differ by more than this share of the nearer are an edge.
const EDGE: f32 = 0.1;
/// Pixels that a band along edges reaches to either side.
const BAND: usize = 3;

/// How good the depth of all keyframes is after a stage. Shares are of the pixels with measured depth, errors relative to
/// it; unknown without any.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StereoPoint {
    /// Name of the scene.
    pub scene: String,
    /// Size of the images, `half` or `full`.
    pub size: &'static str,
    /// What was added last: `confident`, `filled` or `voted` pixels.
    pub stage: &'static str,
    /// Wall time since the scene was open, in seconds, without that of measuring.
    pub seconds: f64,
    /// Share of all pixels that have depth.
    pub complete: f64,
    /// Median error of the pixels that have depth.
    pub error: f64,
    /// Shares with an error of at most 1, 5 and 10%.
    pub within_1: f64,
    /// At most 5%.
    pub within_5: f64,
    /// At most 10%.
    pub within_10: f64,
    /// Median error in the band of three pixels along edges of measured depth.
    pub edge_error: f64,
}

/// Refines the poses of a scene where that helps, estimates its depth as a session does, and measures it after each stage;
/// `told` hears which share of the work is done.
///
/// # Errors
/// A scene without parallax, or whose files can no longer be read.
pub fn stereo_depth(scene: &Scene, told: &(dyn Fn(f32) + Sync)) -> Result<Vec<StereoPoint>, Failure> {
    let start = Instant::now();
    let mut scene = scene.clone();
    if let Ok(refined) = refine(&scene, &|| true) {
        refined.apply(&mut scene);
    }
    let mut measuring = Duration::ZERO;
    let mut points = Vec::new();
    let mut publish = |stage: Stage, maps: Vec<StereoDepth>| {
        let seconds = (start.elapsed() - measuring).as_secs_f64();
        let begun = Instant::now();
        points.push(measured(&scene, stage, &maps, seconds));
        measuring += begun.elapsed();
    };
    let go_on = |share: f32| {
        told(share);
        true
    };
    estimate(&scene, Size::Full, &mut publish, &go_on)?;
    Ok(points)
}

fn measured(scene: &Scene, stage: Stage, maps: &[StereoDepth], seconds: f64) -> StereoPoint {
    let (mut pixels, mut known, mut measured) = (0, 0, 0);
    let (mut errors, mut at_edges) = (Vec::new(), Vec::new());
    for map in maps {
        let frame = &scene.frames[map.frame];
        let truth = z_depths(frame);
        let band = band(frame, &truth);
        let (width, stride) = (frame.camera.width, map.stride);
        pixels += frame.camera.pixels();
        for (index, (truth, is_near_edge)) in truth.into_iter().zip(band).enumerate() {
            let [column, row] = [index as u32 % width, index as u32 / width].map(|at| at / stride);
            let own = map.z_depth((row * map.camera.width + column) as usize);
            known += usize::from(own.is_some());
            let Some(truth) = truth else {
                continue;
            };
            measured += 1;
            if let Some(own) = own {
                let error = (own / truth - 1.0).abs();
                errors.push(error);
                if is_near_edge {
                    at_edges.push(error);
                }
            }
        }
    }
    let within = |most: f32| {
        let count = errors.iter().filter(|&&error| error <= most).count();
        count as f64 / f64::from(measured)
    };
    let [within_1, within_5, within_10] = [0.01, 0.05, 0.1].map(within);
    StereoPoint {
        scene: scene.name(),
        size: stage.size.name(),
        stage: stage.support.name(),
        seconds,
        complete: known as f64 / pixels as f64,
        within_1,
        within_5,
        within_10,
        error: median(errors),
        edge_error: median(at_edges),
    }
}

/// Measured z-depths of a frame's pixels.
fn z_depths(frame: &Frame) -> Vec<Option<f32>> {
    let depth = frame.depth();
    let z = |index| Some(depth.as_ref()?.ray_length(index)? / frame.camera.direction_at(index).length());
    (0..frame.camera.pixels()).map(z).collect()
}

/// Whether each pixel is near an edge of the measured depth.
fn band(frame: &Frame, truth: &[Option<f32>]) -> Vec<bool> {
    let (width, height) = (frame.camera.width as usize, frame.camera.height as usize);
    let mut band = vec![false; truth.len()];
    for index in 0..truth.len() {
        let (column, row) = (index % width, index / width);
        let right = (column + 1 < width).then_some(index + 1);
        let below = (row + 1 < height).then_some(index + width);
        let is_far = |other: usize| match (truth[index], truth[other]) {
            (Some(a), Some(b)) => (a - b).abs() > EDGE * a.min(b),
            _ => false,
        };
        if right.into_iter().chain(below).any(is_far) {
            for row in row.saturating_sub(BAND)..(row + BAND + 1).min(height) {
                let columns = column.saturating_sub(BAND)..(column + BAND + 1).min(width);
                band[row * width + columns.start..row * width + columns.end].fill(true);
            }
        }
    }
    band
}

/// Not a number where there are none.
fn median(mut values: Vec<f32>) -> f64 {
    if values.is_empty() {
        return f64::NAN;
    }
    let middle = values.len() / 2;
    f64::from(*values.select_nth_unstable_by(middle, f32::total_cmp).1)
}
