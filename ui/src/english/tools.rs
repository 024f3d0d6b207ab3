//! The tools that draw, and what is being drawn.

use super::counted;
use crate::canvas::Tool;

/// Name of a tool, with its key.
pub fn tool(tool: Tool) -> &'static str {
    match tool {
        Tool::Brush => "Brush (B)",
        Tool::Polyline => "Polyline (L)",
        Tool::Polygon => "Polygon (G)",
        Tool::Erase => "Erase (E)",
        Tool::Select => "Select strokes (S)",
    }
}

/// Fits the image into the window.
pub const FIT: &str = "Fit (F)";

/// What undo or redo would do, with its default key: "Undo scribble wall (Ctrl+Z)".
pub fn history(verb: &str, edit: Option<&str>, key: &str) -> String {
    match edit {
        Some(edit) => format!("{verb} {edit} ({key})"),
        None => verb.to_owned(),
    }
}

/// The brush's radius, at the tool bar's slider.
pub const BRUSH: &str = "Brush";
/// Name of that slider for screen readers.
pub const BRUSH_NAME: &str = "Brush size";

/// What that slider sets, and the keys that do too; a key may be empty.
pub fn brush_hint(smaller: &str, larger: &str) -> String {
    let keys: Vec<&str> = [smaller, larger, "Ctrl+wheel"]
        .into_iter()
        .filter(|key| !key.is_empty())
        .collect();
    format!("Brush radius in image pixels: {}", keys.join(", "))
}

/// A radius in image pixels.
pub fn pixels(radius: u32) -> String {
    format!("{radius} px")
}

/// The brush's radius in image pixels, while it changes.
pub fn brush_size(radius: u32) -> String {
    format!("Brush {}", pixels(radius))
}

/// How what is being drawn ends.
pub fn draft_note(tool: Tool, corners: usize) -> String {
    let what = if tool == Tool::Polygon {
        "Polygon"
    } else {
        "Polyline"
    };
    let corners = counted(corners, "corner", "corners");
    format!("{what}, {corners}: Enter ends it, Backspace takes a corner back, Escape drops it")
}
