//! Preferences: the file they are kept in, and the settings dialog.

use std::io;
use std::path::Path;

/// The file cannot be read.
pub fn unreadable(path: &Path, error: &io::Error) -> String {
    format!(
        "{}: your preferences cannot be read ({error}); the window starts as it comes.",
        path.display()
    )
}

/// The file is no JSON object.
pub fn damaged(path: &Path, aside: &Path) -> String {
    format!(
        "{}: your preferences are damaged and were set aside as {}; the window starts as it comes.",
        path.display(),
        aside.display()
    )
}

/// The file is of a later version.
pub fn newer(path: &Path, aside: &Path) -> String {
    format!(
        "{}: your preferences were written by a newer Inplace and were set aside as {}; update Inplace and put \
         them back to have them again.",
        path.display(),
        aside.display()
    )
}

/// The file cannot be written.
pub fn unwritable(path: &Path, error: &io::Error) -> String {
    format!(
        "{}: your preferences cannot be written ({error}); they hold until the window is closed.",
        path.display()
    )
}

/// There is no thread to write the file with.
pub fn no_thread(error: &io::Error) -> String {
    format!("Your preferences are not kept: a background thread could not be started ({error}).")
}
