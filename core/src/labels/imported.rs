//! Whole label images from elsewhere.

use super::ClassId;

/// How far label images can be believed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trust {
    /// Every labelled pixel is right, as a stroke is; there may be few of them.
    Trusted,
    /// Each pixel is a vote that may be wrong: noisy annotation, or the predictions of a network.
    Votes,
}

/// The label image of a frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImportedMap {
    /// Index of the frame.
    pub frame: usize,
    /// The class of every pixel of the frame, row-major `[height, width]`; [`VOID`](super::VOID) = nothing is said.
    pub labels: Vec<ClassId>,
}

/// Label images from elsewhere, all of one kind.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImportedLabels {
    /// The images, at most one a frame.
    pub maps: Vec<ImportedMap>,
    /// How far they can be believed.
    pub trust: Trust,
}
