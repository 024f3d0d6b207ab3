//! The tools of the canvas, and what is drawn with them.

use inplace_core::labels::{ClassId, Pixel, Stroke};

/// Largest brush radius in image pixels.
pub const LARGEST_BRUSH: u32 = 64;

/// What the left button does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tool {
    /// Labels a point or along a line with the current class.
    #[default]
    Brush,
    /// Labels along a line from corner to corner.
    Polyline,
    /// Labels the inside of an outline.
    Polygon,
    /// Erases strokes.
    Erase,
    /// Selects strokes.
    Select,
}

impl Tool {
    /// All tools, in the order of the tool bar.
    pub const ALL: [Self; 5] = [
        Self::Brush,
        Self::Polyline,
        Self::Polygon,
        Self::Erase,
        Self::Select,
    ];

    /// Whether it labels with the current class.
    pub fn labels(self) -> bool {
        matches!(self, Self::Brush | Self::Polyline | Self::Polygon)
    }

    /// Whether it draws with the brush's radius.
    pub fn has_radius(self) -> bool {
        matches!(self, Self::Brush | Self::Polyline | Self::Erase)
    }
}

/// A line or an outline being drawn, or just finished.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DrawnLine {
    /// What it does.
    pub tool: Tool,
    /// Its pixels, in the order drawn; of a polygon the corners.
    pub points: Vec<Pixel>,
}

impl DrawnLine {
    /// What it labels: a filled polygon, or a line of this radius in pixels.
    pub fn into_stroke(self, frame: usize, class: ClassId, radius: u32) -> Stroke {
        if self.tool == Tool::Polygon {
            return Stroke::polygon(frame, class, &self.points);
        }
        Stroke::drawn(frame, class, radius, vec![self.points])
    }
}

/// The next brush size: single pixels first, then coarser steps.
pub fn stepped_brush(mut radius: u32, steps: i32) -> u32 {
    for _ in 0..steps.unsigned_abs() {
        let step = 1 + radius / 8;
        radius = if steps > 0 {
            radius + step
        } else {
            radius.saturating_sub(step)
        };
    }
    radius.min(LARGEST_BRUSH)
}
