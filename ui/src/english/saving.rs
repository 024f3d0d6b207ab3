//! Whether the work is on the disk.

use std::path::Path;

use crate::english::PROGRAM;
use crate::keeper::SavedState;

/// In two words, beside the name of what is open.
pub fn state(state: SavedState, named: bool) -> &'static str {
    match (state, named) {
        (SavedState::Saved, true) => "saved",
        (SavedState::Saved, false) => "autosaved",
        (SavedState::Writing, _) => "saving",
        (SavedState::Failing | SavedState::MemoryOnly, _) => "not saved",
    }
}

/// The same in a sentence.
pub fn explanation(state: SavedState, named: bool, path: &Path) -> String {
    let path = path.display();
    match (state, named) {
        (SavedState::Saved, true) => format!("Every edit is in {path}"),
        (SavedState::Saved, false) => {
            format!("Every edit is kept in {path}; save to give it a name of its own")
        }
        (SavedState::Writing, _) => format!("Writing to {path}"),
        (SavedState::Failing, _) => {
            format!("{path} cannot be written; your work is in memory, and writing is tried again")
        }
        (SavedState::MemoryOnly, _) => {
            format!("{path} cannot be written, and your work is in memory only; save it somewhere else")
        }
    }
}

/// Title of the window; `state` is `None` while nothing is kept.
pub fn title(document: Option<&str>, state: Option<SavedState>) -> String {
    let mark = match state {
        None | Some(SavedState::Saved) => "",
        Some(SavedState::Writing) => " (saving)",
        Some(SavedState::Failing | SavedState::MemoryOnly) => " (not saved)",
    };
    match document {
        Some(name) => format!("{name}{mark} - {PROGRAM}"),
        None => PROGRAM.to_owned(),
    }
}

/// The work is in this file.
pub fn saved_to(path: &Path) -> String {
    format!("Saved to {}", path.display())
}

/// Writing has failed before, and still does.
pub fn still_failing(path: &Path) -> String {
    format!(
        "{} still cannot be written; save under another name with \"Save as\".",
        path.display()
    )
}

/// Writing has failed before, and works again.
pub fn writable_again(path: &Path) -> String {
    format!("{} can be written again.", path.display())
}

/// There is no file to write into, and why; `error` says what to do about it.
pub fn memory_only(error: &str) -> String {
    format!("{error}. Until then your work is in memory only.")
}

/// A file was damaged; `account` says which backup was opened instead, and what is missing.
pub fn damaged(account: String) -> String {
    format!("{account}.")
}
