//! The interactive experiment: an annotator who knows the truth labels single pixels of the training frames,
//! and the maps of the test frames are measured as the clicks grow.

mod annotator;
pub(super) mod baseline;
mod experiment;
mod objects;

use serde::Serialize;

pub use annotator::{Annotator, Click, Policy, name_objects};
pub use baseline::Baseline;
pub use experiment::simulate;
pub use objects::{OBJECT_COLUMNS, ObjectPoint, click_rows, object_rows, simulate_objects};

use super::table::csv;
use super::{Calibration, Scores};

/// How good the maps of the test frames were after so many clicks.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SimulatedPoint {
    /// Name of the scene.
    pub scene: String,
    /// Where the annotator clicked.
    pub policy: String,
    /// Seed of the clicks and of the session.
    pub seed: u64,
    /// Clicks there were for each class of the training frames.
    pub clicks_per_class: usize,
    /// Strokes in all.
    pub strokes: usize,
    /// The scores of the test frames.
    #[serde(flatten)]
    pub scores: Scores,
    /// How right the probabilities of the test frames are, of maps that have any.
    #[serde(rename = "ece")]
    pub calibration: Option<Calibration>,
    /// Wall seconds: opening and learning the scene, which the policies of a seed share, and labelling; without
    /// measuring.
    pub wall_s: f64,
}

impl SimulatedPoint {
    /// The expected calibration error; `None` of maps without probabilities.
    pub fn calibration_error(&self) -> Option<f64> {
        self.calibration.as_ref()?.error()
    }
}

/// The columns of `results.csv`, one row for each point.
pub const COLUMNS: &str =
    "scene policy seed clicks_per_class strokes miou:4 average_accuracy:4 total_accuracy:4 wall_s:2";

/// The expected calibration errors of the points that have one, `calibration.csv`.
pub fn calibration_table(points: &[SimulatedPoint]) -> serde_json::Result<String> {
    let known = points.iter().filter(|point| point.calibration_error().is_some());
    let known: Vec<&SimulatedPoint> = known.collect();
    csv(&known, "scene policy seed clicks_per_class ece:4")
}
