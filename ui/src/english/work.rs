//! Work that takes a while: opening, exporting, importing.

use std::io;
use std::path::Path;

use inplace_core::export::Format;

use super::counted;

/// Stops an export.
pub const CANCEL_EXPORT: &str = "Cancel export";
/// Stops an import.
pub const CANCEL_IMPORT: &str = "Cancel import";
/// Before the number of frames is known.
pub const LOOKING: &str = "Looking at the files";
/// Heading of an export that runs.
pub const EXPORTING: &str = "Exporting";
/// Before its first frame.
pub const WAITING_FOR_MAPS: &str = "Getting the newest maps";
/// While the surface is made that is exported.
pub const MAKING_SURFACE: &str = "Making the surface from the newest maps";
/// An export that is being stopped.
pub const STOPPING: &str = "Stopping";
/// Heading of an import that runs.
pub const IMPORTING: &str = "Importing labels";
/// Its first part.
pub const READING: &str = "Reading the label images";
/// Its second part.
pub const SPREADING: &str = "Spreading them over the scene";
/// An export was asked for beside another.
pub const EXPORT_RUNS: &str = "An export is under way: wait for its end, or cancel it.";
/// An import was asked for beside another.
pub const IMPORT_RUNS: &str = "An import is under way: wait for its end, or cancel it.";
/// The window was to be closed during an export.
pub const CLOSES_AFTER_EXPORT: &str =
    "The window closes when the export has ended; close it again to cancel the export.";
/// An import was stopped.
pub const IMPORT_CANCELLED: &str = "Nothing was imported.";

/// Heading while something is opened.
pub fn opening(name: &str) -> String {
    format!("Opening {name}")
}

/// How many frames are done.
pub fn frames(done: usize, total: usize) -> String {
    format!("{done} of {total} frames")
}

/// An export was stopped.
pub fn export_cancelled(folder: &str, written: usize, frames: usize) -> String {
    if written == 0 {
        return format!("The export was cancelled; nothing was written to {folder}.");
    }
    format!(
        "The export was cancelled: {folder} has {written} of {frames} frames, and each of those files is whole."
    )
}

/// Label images were taken over; some may be named like no frame.
pub fn imported(count: usize, unmatched: usize) -> String {
    let mut sentence = format!("Imported {}.", counted(count, "label image", "label images"));
    if unmatched > 0 {
        sentence += &format!(" Left out, because they are named like no frame: {unmatched}.");
    }
    sentence
}

/// An export has ended.
pub fn exported(frames: usize, format: Format) -> String {
    if format.has_frames() {
        format!("Exported {}", counted(frames, "frame", "frames"))
    } else {
        "Exported the surface".to_owned()
    }
}

/// Shows its folder in the file manager.
pub const OPEN_FOLDER: &str = "Open folder";
/// Copies the path of its folder.
pub const COPY_PATH: &str = "Copy path";

/// The maps of the last stroke did not come in time.
pub fn maps_behind(folder: &Path) -> String {
    format!(
        "{}: nothing was exported, because the maps do not follow the last stroke yet; try again in a moment.",
        folder.display()
    )
}

/// An error of the core as a sentence.
pub fn failed(error: &impl std::fmt::Display) -> String {
    format!("{error}.")
}

/// The file manager cannot be started.
pub fn no_file_manager(folder: &Path, program: &str, error: &io::Error) -> String {
    format!(
        "{} cannot be shown: {program} did not start ({error}); copy the path instead.",
        folder.display()
    )
}

/// There is no thread to work on.
pub fn no_thread(error: &io::Error) -> String {
    format!("A background thread could not be started: {error}.")
}
