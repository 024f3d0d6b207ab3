//! What a run did and how well, for scripts.

use serde::{Deserialize, Serialize};

use super::Inputs;
use crate::field::Preset;
use crate::scene::reprojection::PoseRefinement;
use crate::session::TrainingEnd;

/// `report.json`. A figure that was not measured is `null`; what an earlier version has not written is as by default.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Report {
    /// Version of the program.
    pub version: String,
    /// What it was made from, so that a run with the same inputs knows that nothing is left to do.
    pub inputs: Option<Inputs>,
    /// Name of the scene.
    pub scene: String,
    /// Number of frames, all of which were exported.
    pub frames: usize,
    /// Number of strokes that the maps were made from.
    pub strokes: usize,
    /// Number of imported label images that the maps were made from beside the strokes.
    pub imported_images: usize,
    /// How far those were trusted, from 0 to 1; at 1 their pixels are right, as those of strokes are.
    pub imported_trust: Option<f32>,
    /// How much the field was allowed to model.
    pub preset: Preset,
    /// Seed of everything random.
    pub seed: u64,
    /// Threads used.
    pub threads: usize,
    /// Wall time.
    pub wall_s: PhaseSeconds,
    /// Wall time from the start to the last label image, waiting included, in seconds.
    pub total_s: f64,
    /// Why training ended by itself, if it did.
    pub training_end: Option<TrainingEnd>,
    /// Training steps done.
    pub training_steps: u64,
    /// Wall time from the start to the maps that were written, in seconds.
    pub final_maps_s: f64,
    /// What that was to be at most, in seconds.
    pub budget_s: Option<f64>,
    /// Why it was more, a sentence.
    pub over_budget: Option<String>,
    /// The most memory held at once, in bytes.
    pub peak_memory_bytes: Option<u64>,
    /// The chosen model size in words.
    pub capacity: String,
    /// Trainable parameters.
    pub parameters: usize,
    /// How the poses that were used differ from the capture's own; `None` where they are these.
    pub pose_refinement: Option<PoseRefinement>,
    /// Peak signal-to-noise ratio on held-out frames, in dB.
    pub held_out_psnr_db: Option<f32>,
    /// Median absolute depth error on held-out frames with depth, in metres.
    pub depth_error_m: Option<f32>,
    /// Mean entropy over all pixels of all frames, in nats.
    pub mean_entropy: Option<f32>,
}

/// Wall time by phase, in seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PhaseSeconds {
    /// Reading and decoding the capture.
    pub load: f64,
    /// Learning geometry and colour.
    pub geometry: f64,
    /// Spreading the labels.
    pub semantics: f64,
    /// Rendering the maps.
    pub render: f64,
    /// Writing the results.
    pub write: f64,
}
