//! What can be wrong with a capture.

use std::path::PathBuf;

/// A capture that cannot be opened; each message names the file and what to do.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The path is not a folder.
    #[error("{}: no such folder; give the folder of a capture, or the word \"demo\"", shown(.0.display()))]
    Missing(PathBuf),
    /// No known format was recognised.
    #[error("{}: no capture was recognised here; expected {expected}", shown(.path.display()))]
    Unrecognised {
        /// The folder.
        path: PathBuf,
        /// What a readable capture holds.
        expected: String,
    },
    /// A file of the capture is missing, unreadable or holds something unusable.
    #[error("{}: {}", shown(.path.display()), shown(.reason))]
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

/// A text for people that repeats what files call things: names may hold line breaks and what steers a terminal,
/// each of which becomes a replacement character.
pub(crate) fn shown(text: impl std::fmt::Display) -> String {
    let visible = |c: char| {
        if c.is_control() {
            char::REPLACEMENT_CHARACTER
        } else {
            c
        }
    };
    text.to_string().chars().map(visible).collect()
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
    fn an_error_is_one_line_whatever_its_file_is_called() {
        let error = SceneError::file("a\r/b\u{1b}[31m", "names c\nd");
        assert_eq!(error.to_string(), "a\u{fffd}/b\u{fffd}[31m: names c\u{fffd}d");
    }

    #[test]
    fn a_message_is_one_line_whatever_it_repeats() {
        assert_eq!(in_one_line("no\tsuch \0 table:\r\n  \u{7f}x"), "no such table: x");
    }
}
