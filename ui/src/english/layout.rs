//! The panels around the canvas.

use crate::preferences::Pane;

/// Name of a panel in the View menu.
pub fn pane(pane: Pane) -> &'static str {
    match pane {
        Pane::Classes => "Classes",
        Pane::Guidance => "Label next and training",
        Pane::Frames => "Frames",
        Pane::Training => "Training in full",
        Pane::Strokes => "List of strokes",
    }
}

/// Folds the training to a line.
pub const FOLD_TRAINING: &str = "Fold the training";
/// Shows all that is known of the training.
pub const UNFOLD_TRAINING: &str = "Show the training in full";
