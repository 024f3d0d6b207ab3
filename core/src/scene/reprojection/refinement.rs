//! Refining the poses of a capture by the corners that its keyframes share: bundle adjustment (Triggs et al. 2000).
//!
//! Corners are found again where the capture's poses allow them to be, up to a few pixels (`tracks`). Then the poses and
//! the depths of the corners are moved until the corners are where they are seen (`adjustment`). One pair of keyframes in
//! `HELD_OUT` has no say: the poses count only if the corners of those pairs come clearly nearer as well.

mod adjustment;
mod tracks;

use std::fmt;

use glam::{Affine3A, DAffine3, DMat3};
use serde::{Deserialize, Serialize};

use super::median;
use crate::scene::Scene;
use adjustment::Adjustment;

/// One pair of keyframes in so many is held out.
const HELD_OUT: usize = 7;
/// Fewest held-out corners that say anything.
const FEWEST_HELD_OUT: usize = 100;
/// Largest median distance of the held-out corners with which refined poses count, in that with the capture's own.
const CLEARLY_LESS: f64 = 0.8;
/// Farthest that a plausible pose moves what its camera sees, in lengths of the longer side of the image.
const FARTHEST: f64 = 0.1;

/// How far the cameras of a capture were moved, and how much better its images fit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseRefinement {
    /// Median distance of held-out corners from where the capture's own poses put them, in pixels.
    pub error_before_px: f64,
    /// The same with the poses that are used.
    pub error_px: f64,
    /// How far a keyframe's pose moved what it sees, in pixels: the median keyframe.
    pub moved_px: f64,
    /// The keyframe that was moved most.
    pub most_moved_px: f64,
    /// How far its camera was moved, in metres: the median keyframe.
    pub moved_m: f64,
    /// The keyframe that was moved most.
    pub most_moved_m: f64,
}

impl fmt::Display for PoseRefinement {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            error_before_px,
            error_px,
            moved_px,
            most_moved_px,
            moved_m,
            most_moved_m,
        } = self;
        write!(
            formatter,
            "cameras are moved by {:.1} cm and {moved_px:.1} pixels (median; at most {:.1} cm and \
             {most_moved_px:.1} pixels) to where the images fit together: corners that they share are \
             {error_px:.2} pixels off instead of {error_before_px:.2}; files keep the capture's own poses",
            100.0 * moved_m,
            100.0 * most_moved_m,
        )
    }
}

/// Poses that fit the images better than the capture's own.
#[derive(Clone, Debug)]
pub struct RefinedPoses {
    /// Camera-to-world of every frame, in metres relative to the scene's origin.
    pub camera_to_world: Vec<Affine3A>,
    /// How they differ from the capture's own.
    pub summary: PoseRefinement,
}

impl RefinedPoses {
    /// Moves the frames of the scene that the poses are for.
    pub fn apply(self, scene: &mut Scene) {
        for (frame, pose) in scene.frames.iter_mut().zip(self.camera_to_world) {
            frame.camera_to_world = pose;
        }
        scene.pose_refinement = Some(self.summary);
    }
}

/// Why the capture's own poses are used.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Unrefined {
    /// The points of a structure from motion fit these poses and no others.
    #[error("a structure from motion has refined them together with its points")]
    StructureFromMotion,
    /// There is nothing to judge them by.
    #[error("too few corners of the images were found again in others")]
    TooFewCorners,
    /// Others are not clearly better.
    #[error(
        "others would put corners that the images share {error_px:.2} pixels off instead of {error_before_px:.2}"
    )]
    NoGain {
        /// Median distance of the held-out corners with the capture's own poses, in pixels.
        error_before_px: f64,
        /// The same with others.
        error_px: f64,
    },
    /// Others are too far away to be believed.
    #[error("others that fit better would move what a camera sees by up to {most_moved_px:.0} pixels")]
    Implausible {
        /// The largest over the keyframes, in pixels.
        most_moved_px: f64,
    },
    /// The caller wanted no more.
    #[error("their refinement was stopped")]
    Stopped,
}

/// Looks for poses that fit the corners of the keyframes better. A frame that is no keyframe moves like the keyframe
/// nearest to it in the capture, beside which it was taken; a keyframe without corners stays. Measured depth is not looked
/// at. The result is the same for any number of threads, those of the rayon pool in which this is called; `go_on` stops it
/// by `false`.
///
/// # Errors
/// Why the capture's own poses are to be used.
pub fn refine(scene: &Scene, go_on: &(dyn Fn() -> bool + Sync)) -> Result<RefinedPoses, Unrefined> {
    if scene.frames.iter().any(|frame| !frame.points.is_empty()) {
        return Err(Unrefined::StructureFromMotion);
    }
    let keyframes = scene.keyframes();
    let stars = tracks::find(scene, &keyframes, go_on).ok_or(Unrefined::Stopped)?;
    let cameras = keyframes.iter().map(|&frame| scene.frames[frame].camera);
    let own: Vec<DAffine3> = keyframes
        .iter()
        .map(|&frame| scene.frames[frame].camera_to_world.as_daffine3())
        .collect();
    let mut adjustment = Adjustment::new(cameras.collect(), own.clone(), stars);
    let before = adjustment.held_out_errors();
    adjustment.adjust(go_on);
    if !go_on() {
        return Err(Unrefined::Stopped);
    }
    if before.len() < FEWEST_HELD_OUT {
        return Err(Unrefined::TooFewCorners);
    }
    let [error_before_px, error_px] = [before, adjustment.held_out_errors()].map(middle);
    if error_px > CLEARLY_LESS * error_before_px {
        return Err(Unrefined::NoGain {
            error_before_px,
            error_px,
        });
    }
    let moved_px = adjustment.moved_pixels();
    let most_moved_px = largest(&moved_px);
    let sides = keyframes.iter().map(|&frame| {
        let camera = &scene.frames[frame].camera;
        f64::from(camera.width.max(camera.height))
    });
    if sides.zip(&moved_px).any(|(side, &moved)| moved > FARTHEST * side) {
        return Err(Unrefined::Implausible { most_moved_px });
    }
    let refined = &adjustment.poses;
    let pairs = own.iter().zip(refined);
    let moved_m: Vec<f64> = pairs
        .map(|(own, new)| own.translation.distance(new.translation))
        .collect();
    let summary = PoseRefinement {
        error_before_px,
        error_px,
        most_moved_px,
        moved_px: middle(moved_px),
        most_moved_m: largest(&moved_m),
        moved_m: middle(moved_m),
    };
    let moved = |frame: usize| {
        let pose = scene.frames[frame].camera_to_world.as_daffine3();
        let nearest = (0..keyframes.len()).min_by_key(|&number| keyframes[number].abs_diff(frame));
        let moved = nearest.map_or(pose, |number| moved_like(&own[number], &refined[number], &pose));
        moved.as_affine3a()
    };
    Ok(RefinedPoses {
        camera_to_world: (0..scene.frames.len()).map(moved).collect(),
        summary,
    })
}

/// A pose turned and shifted in the world as another was.
fn moved_like(from: &DAffine3, to: &DAffine3, pose: &DAffine3) -> DAffine3 {
    let turn: DMat3 = to.matrix3 * from.matrix3.transpose();
    let shift = to.translation - from.translation;
    DAffine3::from_mat3_translation(turn * pose.matrix3, pose.translation + shift)
}

/// The median; 0 of no values.
fn middle(values: Vec<f64>) -> f64 {
    median(values.into_iter()).unwrap_or(0.0)
}

/// The largest value; 0 of none.
fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

#[cfg(test)]
mod tests;
