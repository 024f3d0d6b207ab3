//! The interactive experiment: an annotator who knows the truth labels single pixels of the training frames,
//! and the maps of the test frames are measured as the clicks grow.

mod annotator;
pub(super) mod baseline;
mod compared;
mod experiment;

use serde::{Serialize, Serializer};

pub use annotator::{Annotator, Click, Policy};
pub use baseline::{Baseline, BaselineMaps};
pub use experiment::{Experiment, simulate};

use super::{Calibration, Scores, Table};

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
    /// How right the probabilities of the test frames are, of maps that have any; in JSON, their expected
    /// calibration error as `ece`.
    #[serde(rename = "ece", serialize_with = "calibration_error")]
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

fn calibration_error<S: Serializer>(
    calibration: &Option<Calibration>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    let error = calibration.as_ref().and_then(Calibration::error);
    error.serialize(serializer)
}

/// The points as a table, `results.csv`.
pub fn table(points: &[SimulatedPoint]) -> Table {
    Table::of(
        points,
        &[
            ("scene", &|point| point.scene.clone()),
            ("policy", &|point| point.policy.clone()),
            ("seed", &|point| point.seed.to_string()),
            ("clicks_per_class", &|point| point.clicks_per_class.to_string()),
            ("strokes", &|point| point.strokes.to_string()),
            ("miou", &|point| format!("{:.4}", point.scores.miou)),
            ("average_accuracy", &|point| {
                format!("{:.4}", point.scores.average_accuracy)
            }),
            ("total_accuracy", &|point| {
                format!("{:.4}", point.scores.total_accuracy)
            }),
            ("wall_s", &|point| format!("{:.2}", point.wall_s)),
        ],
    )
}

/// The expected calibration errors of the points that have one, `calibration.csv`.
pub fn calibration_table(points: &[SimulatedPoint]) -> Table {
    let known = |point| Some((point, SimulatedPoint::calibration_error(point)?));
    let known: Vec<(&SimulatedPoint, f64)> = points.iter().filter_map(known).collect();
    Table::of(
        &known,
        &[
            ("scene", &|(point, _)| point.scene.clone()),
            ("policy", &|(point, _)| point.policy.clone()),
            ("seed", &|(point, _)| point.seed.to_string()),
            ("clicks_per_class", &|(point, _)| {
                point.clicks_per_class.to_string()
            }),
            ("ece", &|(_, error)| format!("{error:.4}")),
        ],
    )
}
