//! What can be wrong with a capture.

use std::path::PathBuf;

/// A capture that cannot be opened; each message names the file and what to do.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The path is not a folder.
    #[error("{}: no such folder; give the folder of a capture, or the word \"demo\"", .0.display())]
    Missing(PathBuf),
    /// No known format was recognised.
    #[error("{}: no capture was recognised here; expected {expected}", .path.display())]
    Unrecognised {
        /// The folder.
        path: PathBuf,
        /// What a readable capture holds.
        expected: String,
    },
    /// A file of the capture is missing, unreadable or holds something unusable.
    #[error("{}: {reason}", .path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong and what to do.
        reason: String,
    },
}

impl SceneError {
    /// An unusable file, with the reason and what to do about it.
    pub fn file(path: impl Into<PathBuf>, reason: impl Into<String>) -> Self {
        Self::File {
            path: path.into(),
            reason: reason.into(),
        }
    }
}

/// What a library says of an error, in one line: some break theirs, or repeat what is in the file.
pub(crate) fn in_one_line(error: impl std::fmt::Display) -> String {
    let text = error.to_string();
    let words = text.split(|c: char| c.is_whitespace() || c.is_control());
    words
        .filter(|word| !word.is_empty())
        .collect::<Vec<_>>()
        .join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_is_one_line_whatever_it_repeats() {
        assert_eq!(in_one_line("no\tsuch \0 table:\r\n  \u{7f}x"), "no such table: x");
    }
}
