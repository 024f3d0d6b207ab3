//! The list of strokes.

use inplace_core::labels::StrokeKind;

/// The list's heading, with how many strokes there are.
pub fn heading(strokes: usize) -> String {
    format!("Strokes ({strokes})")
}

/// Folds the list away.
pub const FOLD: &str = "Hide the list of strokes";
/// Brings it back.
pub const UNFOLD: &str = "Show the list of strokes";
/// Name of the list for screen readers.
pub const LIST: &str = "List of strokes";
/// The field whose text the list is filtered by.
pub const FIND: &str = "Find strokes";
/// What that text may be.
pub const FIND_HINT: &str = "Part of a class's or frame's name, or click, scribble, polygon";
/// Filters the list by class.
pub const CLASS_FILTER: &str = "Strokes of class";
/// No filter by class.
pub const ALL_CLASSES: &str = "All classes";
/// Filters the list by the frame in view.
pub const THIS_FRAME: &str = "This frame";
/// There are no strokes.
pub const NONE: &str = "No strokes yet. What you draw on the frames is listed here, to be found and changed.";
/// There are strokes, and the filters leave none.
pub const NONE_FOUND: &str = "No stroke is like that.";
/// Takes all filters away.
pub const SHOW_ALL: &str = "Show all strokes";
/// Deletes the selected stroke.
pub const DELETE: &str = "Delete stroke (Delete)";
/// The class of the selected stroke.
pub const CLASS_OF_SELECTED: &str = "Class of the stroke";

/// Stands for the class of the selected stroke while none is selected.
pub const NONE_SELECTED: &str = "No stroke selected";

/// A stroke without its class: "scribble, 120 px, rgb_3".
pub fn details(kind: StrokeKind, pixels: u64, frame: &str) -> String {
    format!("{}, {pixels} px, {frame}", kind.name())
}

/// A stroke in words, for screen readers and tooltips.
pub fn in_words(class: &str, kind: StrokeKind, pixels: u64, frame: &str) -> String {
    let plural = if pixels == 1 { "" } else { "s" };
    format!("{class}, {}, {pixels} pixel{plural}, frame {frame}", kind.name())
}
