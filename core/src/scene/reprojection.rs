//! How well the poses, the cameras and the measurements of a capture agree, in pixels: what a wrong
//! convention breaks.
//!
//! - The points of a structure from motion against where its images show them, as its reader found.
//! - Corners that are found again in a neighbouring frame by their looks alone: against where measured depth
//!   and the poses put them, or where there is no depth, against the epipolar lines of the poses.
//! - Measured depth against that of the neighbouring frame, and the colours of what agrees.
//!
//! About `MOST_PAIRS` pairs of frames are looked at, however long the capture is.

mod convention;
mod corners;
mod depth;
mod pairs;
mod refinement;

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;
use serde::Serialize;

pub use super::pixel_errors::PixelErrors;
use super::pixel_errors::median;
use super::{Frame, Scene, formats};
use convention::{Conventions, Suspicion};
use corners::Features;
pub use depth::DepthAgreement;
use pairs::Pair;
pub use refinement::{PoseRefinement, RefinedPoses, Unrefined, refine};

/// An error up to which a corner counts as being where it should be, in pixels.
const WITHIN_PX: f64 = 2.0;
/// Images are brought down to at most this many pixels along their longer side.
const LONGEST: usize = 720;
/// Most pairs of frames that are looked at.
const MOST_PAIRS: usize = 40;
/// Fewest corners of a pair that must be found again for it to count, as fewer may be chance.
const FEWEST_MATCHES: usize = 8;
/// Fewest corners in all that say anything.
const FEWEST_CORNERS: usize = 40;

/// Corners that were found again in a neighbouring frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CornerAgreement {
    /// Pairs of frames that have such corners.
    pub pairs: usize,
    /// True: distances from where depth and poses put the corner. False: from the epipolar lines in both
    /// images, on average; a corner that would be behind a camera is off by the diagonal of the image.
    pub lifted_by_depth: bool,
    /// The distances, in pixels of the frames.
    #[serde(flatten)]
    pub errors: PixelErrors,
    /// Share of the corners that are off by at most 2 pixels, 0..=1.
    pub within_2_px: f64,
    /// The same with the poses of another pair of frames: what chance gives.
    pub within_2_px_by_chance: f64,
}

/// What was found of a capture; see the [module](self).
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Agreement {
    /// The points of a structure from motion.
    pub points: Option<PixelErrors>,
    /// Corners that frames share.
    pub corners: Option<CornerAgreement>,
    /// Measured depth.
    pub depth: Option<DepthAgreement>,
    /// What is probably wrong, a sentence each.
    #[serde(skip)]
    pub warnings: Vec<String>,
}

impl Agreement {
    /// Looks at pairs of frames, in parallel. The same scene gives the same result on any number of threads.
    pub fn of(scene: &Scene) -> Self {
        let pairs = pairs::choose(scene, MOST_PAIRS);
        let matched = find_matches(scene, &pairs);
        let conventions = Conventions::new(scene, &matched);
        let corners = conventions.agreement();
        let suspicion = corners.and_then(|corners| conventions.suspicion(&corners));
        let warnings = corners
            .zip(suspicion)
            .map(|(corners, suspicion)| warning(scene, &corners, suspicion));
        Self {
            points: scene.point_errors,
            corners,
            depth: depth::agreement(scene, &pairs),
            warnings: warnings.into_iter().collect(),
        }
    }
}

/// Two frames and the corners that both show.
struct MatchedPair {
    pair: Pair,
    matches: Vec<corners::Match>,
}

/// Finds the corners of each frame of the pairs, and those that both frames of a pair show.
fn find_matches(scene: &Scene, pairs: &[Pair]) -> Vec<MatchedPair> {
    let used: BTreeSet<usize> = pairs.iter().flat_map(|pair| [pair.first, pair.second]).collect();
    let features: BTreeMap<usize, Features> = used
        .into_par_iter()
        .map(|index| (index, Features::of(&scene.frames[index], LONGEST)))
        .collect();
    let matched = pairs.par_iter().map(|&pair| MatchedPair {
        matches: corners::matches(&features[&pair.first], &features[&pair.second], |_, _| true),
        pair,
    });
    matched
        .filter(|pair| pair.matches.len() >= FEWEST_MATCHES)
        .collect()
}

/// What is probably wrong, and in which file.
fn warning(scene: &Scene, corners: &CornerAgreement, suspicion: Suspicion) -> String {
    let how = if corners.lifted_by_depth {
        "from where poses and depth put them"
    } else {
        "from where the poses allow them to be"
    };
    let file = formats::pose_file(scene.format);
    let advice = match suspicion {
        Suspicion::Better(convention, share) => format!(
            "{:.0}% would be within 2 pixels if {convention}; check {file}",
            100.0 * share
        ),
        Suspicion::Chance => format!(
            "other frames' poses fit as well; check that the poses in {file} belong to these images, are \
             camera-to-world or world-to-camera as the format says, and have its camera axes"
        ),
        Suspicion::Inexact => {
            format!(
                "check the intrinsics and the poses in {file}, and that the images have the size they are for"
            )
        }
    };
    format!(
        "corners that neighbouring frames share are {:.1} pixels {how} (median of {}): {advice}",
        corners.errors.median_px, corners.errors.count
    )
}

/// Length of the diagonal of a frame, in pixels: how far something counts as being off that is not in the image.
fn diagonal(frame: &Frame) -> f64 {
    f64::from(frame.camera.width).hypot(f64::from(frame.camera.height))
}

#[cfg(test)]
mod tests;
