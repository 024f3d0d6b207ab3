//! The panels around the canvas.

use crate::preferences::Pane;

/// Name of a panel in the View menu.
pub fn pane(pane: Pane) -> &'static str {
    match pane {
        Pane::Classes => "Classes",
        Pane::Guidance => "Label next and training",
        Pane::Frames => "Frames",
    }
}
