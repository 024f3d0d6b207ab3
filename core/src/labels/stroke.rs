//! Clicks and scribbles.

use serde::{Deserialize, Serialize};

use super::ClassId;

/// A pixel of a frame: column and row, from the top left.
pub type Pixel = [u32; 2];

/// Identifies a stroke for the life of a project; later strokes have larger ids.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct StrokeId(pub u64);

/// A click (one point) or a scribble (a polyline) of one class on one frame.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Stroke {
    /// Index of the frame in the scene.
    pub frame: usize,
    /// The class it says; [`VOID`](super::VOID) says that there is nothing here.
    pub class: ClassId,
    /// Brush radius in pixels; 0 = the pixels of the line alone.
    pub radius: u32,
    /// Polylines: one as drawn, several after parts were erased.
    pub lines: Vec<Vec<Pixel>>,
}

impl Stroke {
    /// A click on one pixel.
    pub fn click(frame: usize, class: ClassId, pixel: Pixel) -> Self {
        Self {
            frame,
            class,
            radius: 0,
            lines: vec![vec![pixel]],
        }
    }

    /// The first point.
    pub fn first_point(&self) -> Option<Pixel> {
        self.lines.first().and_then(|line| line.first()).copied()
    }
}
