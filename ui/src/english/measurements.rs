//! What the window measures and records of itself, where that was asked for.

use std::io;

/// Heads of the table's columns.
pub const HEADS: [&str; 5] = ["milliseconds", "p50", "p95", "max", "n"];
/// Row: the time of a frame of the window in its own code.
pub const FRAME: &str = "own frame";
/// Row: what the window's thread was busy for.
pub const THREAD: &str = "window's thread";
/// Row: the time of a frame of the window as eframe reports it.
pub const REPORTED: &str = "eframe frame";
/// Row: from a click to its labels on the screen.
pub const CLICK: &str = "click to overlay";

/// The record of what happens cannot be written: a line on stderr.
pub fn no_trace(error: &io::Error) -> String {
    format!("inplace: the trace cannot be written ({error}); give a file in a folder that can be")
}
