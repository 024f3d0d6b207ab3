//! What can be wrong with a capture.

use std::path::PathBuf;

/// A capture that cannot be opened; each message names the file and what to do.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The path is not a folder.
    #[error("{}: no such folder; give the folder of a capture, or the word \"demo\"", shown(.0.display()))]
    Missing(PathBuf),
    /// No known format was recognised in this folder, with what a readable capture holds.
    #[error("{}: no capture was recognised here; expected {}", shown(.0.display()), .1)]
    Unrecognised(PathBuf, String),
    /// The caller wanted no more.
    #[error("the reading of the capture was stopped")]
    Stopped,
    /// This file of the capture is missing, unreadable or holds something unusable, with what is wrong and what to do.
    #[error("{}: {}", shown(.0.display()), shown(.1))]
    File(PathBuf, String),
}

impl SceneError {
    /// An unusable file, with the reason and what to do about it.
    pub fn file(path: impl Into<PathBuf>, reason: impl std::fmt::Display) -> Self {
        Self::File(path.into(), reason.to_string())
    }
}

/// The error of an unusable file: its path, then the reason and what to do about it, as for `format!`.
macro_rules! refusal {
    ($path:expr, $($reason:tt)+) => {
        $crate::scene::SceneError::file($path, format_args!($($reason)+))
    };
}
pub(super) use refusal;

/// Returns a [`refusal!`].
macro_rules! refuse {
    ($($reason:tt)+) => {
        return Err($crate::scene::error::refusal!($($reason)+))
    };
}
pub(super) use refuse;

/// Why an image cannot be used: part of a sentence that the caller begins with its name.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// There is no such file.
    #[error("no such file")]
    Missing,
    /// The file cannot be read.
    #[error("{}", in_one_line(.0))]
    Unreadable(#[from] std::io::Error),
    /// The file holds no image.
    #[error("{}", in_one_line(.0))]
    Undecodable(#[from] image::ImageError),
    /// Its header asks for more pixels than any image may have.
    #[error("it has {0}x{1} pixels, which is too large")]
    TooLarge(u32, u32),
    /// The file is too short for the size in its header.
    #[error("it is truncated or spoilt: {0} bytes cannot hold {1}x{2} pixels")]
    Truncated(u64, u32, u32),
    /// It has the first width and height, and its camera the second.
    #[error("{}x{} instead of {}x{}", .0.0, .0.1, .1.0, .1.1)]
    Size((u32, u32), (u32, u32)),
    /// Its alpha or its mask cannot be used, for this reason.
    #[error("{0}")]
    Mask(String),
    /// A depth image has other channels than one of 16 bits.
    #[error("not a 16-bit greyscale PNG")]
    NotDepth,
    /// There is no camera for depth images of its size, for this reason.
    #[error("{0}")]
    DepthCamera(String),
    /// A depth image of the first width and height is of another shape than its colour image, of the second.
    #[error("{}x{} pixels, which is another shape than that of its {}x{} colour image", .0.0, .0.1, .1.0, .1.1)]
    Shape((u32, u32), (u32, u32)),
    /// A label image has several channels: colours of this kind and no ids.
    #[error("it is a {0} image where one gray channel is needed")]
    NotGray(&'static str),
    /// A label image says that it has the first width and height, and its frame has the second.
    #[error("it says that it has {}x{} pixels where its frame has {}x{}", .0[0], .0[1], .1[0], .1[1])]
    NotOfFrame([u32; 2], [u32; 2]),
    /// A label image is not one of a frame of its scene, for this reason.
    #[error("{0}")]
    Misfit(&'static str),
}

/// Why a camera-to-world matrix cannot be used, as several formats say it: part of a sentence.
pub(super) const NOT_FINITE: &str = "it holds a value that is not a finite number";
pub(super) const NO_QUATERNION: &str = "its quaternion is not a rotation";
pub(super) const LAST_ROW: &str = "its last row is not 0 0 0 1";

/// A text for people that repeats what files call things: names may hold line breaks and what steers a terminal,
/// each of which becomes a replacement character.
pub(crate) fn shown(text: impl std::fmt::Display) -> String {
    text.to_string().replace(char::is_control, "\u{FFFD}")
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
    fn an_error_is_one_line_whatever_its_file_is_called_and_whatever_it_repeats() {
        let error = SceneError::file("a\r/b\u{1b}[31m", "names c\nd");
        assert_eq!(error.to_string(), "a\u{fffd}/b\u{fffd}[31m: names c\u{fffd}d");
        assert_eq!(in_one_line("no\tsuch \0 table:\r\n  \u{7f}x"), "no such table: x");
    }
}
