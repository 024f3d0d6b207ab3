//! The interactive experiment: an annotator who knows the truth labels single pixels of the training frames,
//! and the maps of the test frames are measured as the clicks grow.

mod annotator;
mod baseline;
mod experiment;

use serde::Serialize;

pub use annotator::{Annotator, Click, Policy};
pub use baseline::{Baseline, BaselineMaps};
pub use experiment::{Experiment, simulate};

use super::{Scores, Table};

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
    /// Wall seconds: opening and learning the scene, which the policies of a seed share, and labelling; without
    /// measuring.
    pub wall_s: f64,
}

/// The points as a table, `results.csv`.
pub fn table(points: &[SimulatedPoint]) -> Table {
    let mut table = Table::new(&[
        "scene",
        "policy",
        "seed",
        "clicks_per_class",
        "strokes",
        "miou",
        "average_accuracy",
        "total_accuracy",
        "wall_s",
    ]);
    for point in points {
        table.push(&[
            point.scene.clone(),
            point.policy.clone(),
            point.seed.to_string(),
            point.clicks_per_class.to_string(),
            point.strokes.to_string(),
            format!("{:.4}", point.scores.miou),
            format!("{:.4}", point.scores.average_accuracy),
            format!("{:.4}", point.scores.total_accuracy),
            format!("{:.2}", point.wall_s),
        ]);
    }
    table
}
