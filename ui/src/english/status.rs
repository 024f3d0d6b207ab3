//! How training goes.

use inplace_core::session::Phase;

/// Heading of the panel.
pub const HEADING: &str = "Training";
/// The button while training is paused.
pub const RESUME: &str = "Resume training (P)";
/// The button while it runs.
pub const PAUSE: &str = "Pause training (P)";
/// The worker is gone.
pub const ENDED: &str = "Training has stopped";
/// The person has paused it.
pub const PAUSED: &str = "Paused";
/// More of it is not expected to change the maps.
pub const SETTLED: &str = "Settled";

/// What the worker is doing.
pub fn phase(phase: Phase) -> &'static str {
    match phase {
        Phase::Opening => "Getting ready",
        Phase::FindingSurface => "Finding the surface",
        Phase::Paused => PAUSED,
        Phase::Training => "Running",
    }
}

/// Row: steps.
pub const STEPS: &str = "Steps";
/// What they are.
pub const STEPS_MEAN: &str = "Training steps of the field that learns the scene's shape and colour";
/// Row: time.
pub const TIME: &str = "Time";
/// What it is.
pub const TIME_MEANS: &str = "Time spent training";
/// Row: depth error.
pub const DEPTH_ERROR: &str = "Depth error";
/// What it is.
pub const DEPTH_ERROR_MEANS: &str = "Median error of the field's depth where the capture has measured depth";
/// Row: model.
pub const MODEL: &str = "Model";
/// What it is.
pub const MODEL_MEANS: &str = "The size that was chosen for this scene";
/// Row: mishaps.
pub const MISHAPS: &str = "Mishaps";
/// What they are.
pub const MISHAPS_MEAN: &str = "Steps that were left out because a number in them was not finite, and returns to an earlier state of \
                                the model, at half the learning rate";
/// There were none.
pub const NO_MISHAPS: &str = "none";

/// How many there were; `left_out` with its thousands apart.
pub fn mishaps(left_out: &str, undone: u64) -> String {
    format!("{left_out} steps left out, {undone} returns")
}

/// A length in metres that is small.
pub fn centimetres(metres: f32) -> String {
    format!("{:.1} cm", 100.0 * metres)
}
