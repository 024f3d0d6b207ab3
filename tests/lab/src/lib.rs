//! The laboratory: how good label maps are, measured against ground truth; how fast the engine is and what it costs.
#![forbid(unsafe_code)]

pub mod arguments;
mod audit;
mod calibration;
mod chart;
pub mod commands;
mod deviation;
mod engine;
mod field;
mod hard;
mod latency;
mod learnt;
mod metrics;
mod objects;
mod page;
mod paper;
mod pareto;
mod pixels;
mod scale;
mod simulate;
mod stability;
mod stereo;
mod table;
#[cfg(test)]
mod testing;
mod truth;

use std::error::Error;
use std::fmt::Display;
use std::path::Path;

use calibration::Calibration;
use deviation::{mean, mean_and_deviation};
pub use metrics::{ConfusionMatrix, Scores};
use truth::{LabelImage, SceneTruth};

use inplace_core::scene::Scene;

/// Something that cannot be measured or written: one sentence that names the file or the scene and says what to do.
pub type Failure = Box<dyn Error + Send + Sync>;

/// There is nothing to measure with in this scene; the reason says what is missing and what to do.
fn unusable_scene(scene: &Scene, reason: impl Display) -> Failure {
    format!("{}: {reason}", scene.source).into()
}

/// A file of the ground truth is missing or unusable; the reason says what is wrong and what to do.
fn unusable_file(path: &Path, reason: impl Display) -> Failure {
    format!("{}: {reason}", path.display()).into()
}

/// There is nothing to click on.
fn no_strokes(scene: &Scene) -> Failure {
    let name = scene.name();
    format!("{name}: there is no stroke in any of its frames; more frames are needed").into()
}

/// Fails unless truth and prediction have the same number of pixels.
fn unless_equal(truth: usize, predicted: usize) -> Result<(), Failure> {
    if truth == predicted {
        return Ok(());
    }
    Err(format!(
        "the prediction has {predicted} pixels and the ground truth {truth}; both must be of one frame"
    )
    .into())
}
