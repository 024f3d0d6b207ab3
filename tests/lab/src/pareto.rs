//! Accuracy against wall time, method by method, and against capacity: whether what is chosen for a scene is worth its
//! time and its size.

mod capacity;
mod course;
mod curve;
#[cfg(test)]
mod tests;

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

pub use capacity::{CapacityPoint, Part, Size, capacity_table, difference_to_chosen};
pub use course::ParetoRun;
pub use curve::{Curve, Difference, Summary};

use super::by_name;
use super::simulate::Baseline;
use super::table::csv;
use inplace_core::field::Preset;

/// A way to label a scene from clicks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// A session of the program; with [`Preset::Reference`], of the published network.
    Preset(Preset),
    /// Something simpler, or older.
    Baseline(Baseline),
}

impl Method {
    /// Its name in the results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Preset(preset) => preset.name(),
            Self::Baseline(baseline) => baseline.name(),
        }
    }
}

impl FromStr for Method {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let presets = PRESETS.map(Self::Preset);
        let all = [&presets[..], &Baseline::QUICK.map(Self::Baseline)].concat();
        let advice = "use auto, fast, accurate, reference, nearest, joint-mlp or pixels";
        by_name(&all, Self::name, name, advice)
    }
}

/// All presets.
pub const PRESETS: [Preset; 4] = [Preset::Auto, Preset::Fast, Preset::Accurate, Preset::Reference];

/// How good the maps of the test frames were after so much wall time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParetoPoint {
    /// Name of the scene.
    pub scene: String,
    /// Name of the method.
    pub method: String,
    /// Seed of the clicks and of the session.
    pub seed: u64,
    /// Wall seconds since the start, opening the scene included and measuring not.
    pub wall_s: f64,
    /// Mean intersection over union on the test frames; a frame without a map is wrong all over.
    pub miou: f64,
    /// Median error of the field's ray length on its held-out frames, in metres, as of its newest look at them; `None`
    /// before that, without depth, and of methods without a field.
    pub depth_error_m: Option<f64>,
    /// Peak signal-to-noise ratio there, in dB; `None` as above, but for the depth.
    pub psnr_db: Option<f64>,
    /// Trainable parameters, of methods that tell.
    pub parameters: Option<usize>,
    /// The most memory that the process had held until then, in MB (10^6 bytes), where the system tells.
    pub peak_mb: Option<f64>,
}

/// Why a session trained no more.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reason {
    /// The held-out error had not fallen for a while.
    ErrorNoLongerFalls,
    /// All the steps were done that a scene with measured depth is given: there is little to find out.
    DepthIsMeasured,
    /// All the steps were done that a scene is given.
    StepsAreDone,
}

impl fmt::Display for Reason {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::ErrorNoLongerFalls => "the held-out error no longer falls",
            Self::DepthIsMeasured => "depth is measured, and the few steps that this leaves to do are done",
            Self::StepsAreDone => "all of its steps are done",
        })
    }
}

/// Where a session trained no more and all its maps were final.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stop {
    /// Wall seconds since the start, as in [`ParetoPoint::wall_s`].
    pub wall_s: f64,
    /// Steps of training the field.
    pub steps: u64,
    /// Why.
    pub reason: Reason,
}

/// What one method came to with one seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MethodRun {
    /// The course of its accuracy, at the marks and where it stopped.
    pub points: Vec<ParetoPoint>,
    /// Where it stopped by itself; `None` where the last mark came first, and of baselines.
    pub stop: Option<Stop>,
    /// Voxels of the surface in the end; 0 without one.
    pub voxels: usize,
    /// Memory of the model in the end, in bytes: four for each parameter, and the surface's graph.
    pub bytes: usize,
}

/// The points as comma-separated values, `pareto.csv`.
pub fn table(points: &[ParetoPoint]) -> serde_json::Result<String> {
    csv(
        points,
        "scene method seed wall_s:2 miou:4 depth_error_m:5 psnr_db:2 parameters peak_mb:0",
    )
}
