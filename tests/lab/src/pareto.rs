//! Accuracy against wall time, method by method, and against capacity: whether what is chosen for a scene is worth its
//! time and its size.

mod course;
mod curve;
#[cfg(test)]
mod tests;

use std::fmt;

use serde::{Deserialize, Serialize};

pub use course::ParetoRun;
pub use curve::{Curve, Difference, Summary};

use super::simulate::Baseline;
use inplace_core::field::Preset;
use inplace_core::session::TrainingEnd;

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

/// How good the maps of the test frames were after so much wall time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
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
    /// Voxels of the surface; 0 without one.
    pub voxels: usize,
    /// Memory of the model, in bytes: four for each parameter, and the surface's graph.
    pub bytes: usize,
    /// Why a session trained no more, all its maps being final; `None` where it went on, and of baselines.
    pub stop: Option<TrainingEnd>,
}

/// The columns of `pareto.csv`, one row for each point.
pub const COLUMNS: &str = "scene method seed wall_s:2 miou:4 depth_error_m:5 psnr_db:2 parameters peak_mb:0";

/// What is made larger or smaller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Part {
    /// The rows of the field's table ([`Capacity::scaled`](inplace_core::field::Capacity::scaled)), and its finest cells with
    /// them.
    Field,
    /// The number of the surface's voxels
    /// ([`Surface::build_scaled`](inplace_core::semantics::Surface::build_scaled)).
    Surface,
}

impl Part {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Field, Self::Surface];
}

impl fmt::Display for Part {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Field => "field",
            Self::Surface => "surface",
        })
    }
}

/// What a model of another size came to, when training had stopped or the last mark came.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CapacityPoint {
    /// What was scaled.
    pub part: Part,
    /// By how much; 1 is what is chosen.
    pub factor: f32,
    /// What came of it.
    #[serde(flatten)]
    pub end: ParetoPoint,
}

/// The columns of `capacity.csv`, one row for each point.
pub const CAPACITY_COLUMNS: &str =
    "scene part factor seed parameters bytes voxels miou:4 depth_error_m:5 psnr_db:2 wall_s:2";

/// How much more of a quantity there is at `factor` than at the chosen size, seed by seed, for one part of one scene;
/// `None` where no seed has both.
pub fn difference_to_chosen(
    points: &[&CapacityPoint],
    factor: f32,
    value: impl Fn(&ParetoPoint) -> Option<f64>,
) -> Option<Difference> {
    let of = |seed: u64, factor: f32| {
        let own = |point: &&&CapacityPoint| point.end.seed == seed && point.factor == factor;
        points.iter().find(own).and_then(|point| value(&point.end))
    };
    let scaled = points.iter().filter(|point| point.factor == factor);
    let differences = scaled.filter_map(|point| Some(value(&point.end)? - of(point.end.seed, 1.0)?));
    Difference::of(&differences.collect::<Vec<f64>>())
}
