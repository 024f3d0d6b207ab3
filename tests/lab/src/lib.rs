//! The laboratory: how good label maps are, measured against ground truth; how fast the engine is and what it costs.
#![forbid(unsafe_code)]

pub mod arguments;
mod audit;
mod calibration;
pub mod chart;
pub mod commands;
mod cost;
mod deviation;
mod engine;
pub mod field;
pub mod hard;
mod latency;
mod learnt;
mod metrics;
mod objects;
mod page;
pub mod paper;
pub mod pareto;
mod pixels;
mod reached;
pub mod scale;
pub mod simulate;
pub mod stability;
mod stereo;
mod table;
#[cfg(test)]
mod testing;
mod truth;

use std::path::PathBuf;

pub use audit::{AuditPoint, audits};
pub use calibration::Calibration;
pub use cost::{Cost, session_cost};
pub use deviation::{mean, mean_and_deviation};
pub use engine::{PathSpeed, RunPoint, Variant, path_speeds, training_run};
pub use latency::{Latency, Percentiles, click_latency};
pub use metrics::{ConfusionMatrix, Scores};
pub use reached::{Quantity, Reached, TARGETS};
pub use stereo::{StereoPoint, stereo_depth};
pub use truth::{LabelImage, SceneTruth, Split};

use inplace_core::field::FieldError;
use inplace_core::labels::StrokesError;
use inplace_core::scene::{Scene, SceneError};
use inplace_core::session::ClientError;
use inplace_core::stereo::StereoError;

/// Something that cannot be measured; each message is one sentence that names the file and what to do.
#[derive(Debug, thiserror::Error)]
pub enum EvalError {
    /// A file of the ground truth is missing or unusable.
    #[error("{}: {reason}", .path.display())]
    File {
        /// The file or folder.
        path: PathBuf,
        /// What is wrong and what to do.
        reason: String,
    },
    /// Truth and prediction are not of the same image.
    #[error("the prediction has {predicted} pixels and the ground truth {truth}; both must be of one frame")]
    Size {
        /// Pixels of the ground truth.
        truth: usize,
        /// Pixels of the prediction.
        predicted: usize,
    },
    /// A measurement that came to nothing; a sentence.
    #[error("{0}")]
    Session(String),
    /// A session that ended before it was measured.
    #[error(transparent)]
    Client(#[from] ClientError),
    /// A field that cannot be trained.
    #[error(transparent)]
    Field(#[from] FieldError),
    /// A computation that failed.
    #[error(transparent)]
    Tensor(#[from] candle_core::Error),
    /// Depth that cannot be estimated.
    #[error(transparent)]
    Stereo(#[from] StereoError),
    /// A capture, or a part of it, that cannot be read.
    #[error(transparent)]
    Capture(#[from] SceneError),
    /// A strokes file that does not fit the capture.
    #[error(transparent)]
    Strokes(#[from] StrokesError),
    /// There is nothing to click on.
    #[error("{0}: there is no stroke in any of its frames; more frames are needed")]
    NoStrokes(String),
    /// There is nothing to measure with.
    #[error("{scene}: {reason}")]
    Scene {
        /// The scene.
        scene: String,
        /// What is missing and what to do.
        reason: String,
    },
}

impl EvalError {
    /// [`EvalError::Size`] unless truth and prediction have the same number of pixels.
    fn unless_equal(truth: usize, predicted: usize) -> Result<(), Self> {
        if truth == predicted {
            return Ok(());
        }
        Err(Self::Size { truth, predicted })
    }

    fn scene(scene: &Scene, reason: impl Into<String>) -> Self {
        Self::Scene {
            scene: scene.source.to_string(),
            reason: reason.into(),
        }
    }

    fn file(path: impl Into<PathBuf>, reason: impl Into<String>) -> Self {
        Self::File {
            path: path.into(),
            reason: reason.into(),
        }
    }
}
