//! What to label next.

use crate::labels::{ClassId, Pixel};

/// A place whose label would settle much.
#[derive(Clone, Debug, PartialEq)]
pub struct Suggestion {
    /// Index of the frame that shows the place best.
    pub frame: usize,
    /// The pixel to label.
    pub pixel: Pixel,
    /// Outline of the region that the label would settle, a closed polygon in pixel coordinates of the frame.
    pub outline: Vec<[f32; 2]>,
    /// What the label is worth, relative to the best suggestion (1).
    pub score: f32,
    /// Entropy at the place, in nats.
    pub entropy: f32,
    /// Share of all pixels of all frames that the region covers, 0..=1.
    pub share: f32,
    /// The two most likely classes there, the likelier first; fewer where fewer are known.
    pub classes: Vec<ClassId>,
}
