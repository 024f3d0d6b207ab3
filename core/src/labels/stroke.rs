//! Clicks and scribbles.

use serde::{Deserialize, Serialize};

use super::polygon::polygon_runs;
use super::runs::Run;
use super::{ClassId, ObjectId, runs_of};

/// A pixel of a frame: column and row, from the top left.
pub type Pixel = [u32; 2];

/// Identifies a stroke for the life of a project; later strokes have larger ids.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct StrokeId(pub u64);

/// A click (one point), a scribble (a polyline) or a filled polygon (its rows) of one class on one frame.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Stroke {
    /// Index of the frame in the scene.
    pub frame: usize,
    /// The class it says; [`VOID`](super::VOID) says that there is nothing here.
    pub class: ClassId,
    /// The object of the class, where it says which one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub object: Option<ObjectId>,
    /// Brush radius in pixels; 0 = the pixels of the line alone.
    pub radius: u32,
    /// Polylines: one as drawn, several after parts were erased; of a filled polygon the runs of its rows.
    pub lines: Vec<Vec<Pixel>>,
}

impl Stroke {
    /// Polylines drawn with a brush of this radius in pixels; they name no object.
    pub fn drawn(frame: usize, class: ClassId, radius: u32, lines: Vec<Vec<Pixel>>) -> Self {
        Self {
            frame,
            class,
            object: None,
            radius,
            lines,
        }
    }

    /// A click on one pixel.
    pub fn click(frame: usize, class: ClassId, pixel: Pixel) -> Self {
        Self::drawn(frame, class, 0, vec![vec![pixel]])
    }

    /// A filled polygon with these corners, as the runs of its pixels ([`polygon_runs`]).
    pub fn polygon(frame: usize, class: ClassId, corners: &[Pixel]) -> Self {
        let rows = polygon_runs(corners);
        Self::drawn(frame, class, 0, rows.iter().map(Run::line).collect())
    }

    /// What it is for people; found by looking, so that parts of a polygon are one too.
    pub fn kind(&self) -> StrokeKind {
        let row = |line: &Vec<Pixel>| match line.as_slice() {
            [[_, row]] => Some(*row),
            [[_, row], [_, other]] if row == other => Some(*row),
            _ => None,
        };
        if let [line] = self.lines.as_slice()
            && line.len() == 1
        {
            return StrokeKind::Click;
        }
        let first = self.lines.first().and_then(row);
        let rows = self.lines.iter().map(row);
        let filled = self.radius == 0 && rows.clone().all(|row| row.is_some());
        // Parts of one straight scribble are in one row.
        if filled && rows.into_iter().any(|row| row != first) {
            StrokeKind::Polygon
        } else {
            StrokeKind::Scribble
        }
    }

    /// Number of pixels that it covers in an image of this size.
    pub fn pixel_count(&self, width: u32, height: u32) -> u64 {
        runs_of(self, width, height).iter().map(Run::pixels).sum()
    }

    /// The first point.
    pub fn first_point(&self) -> Option<Pixel> {
        self.lines.first().and_then(|line| line.first()).copied()
    }

    /// The last point.
    pub fn last_point(&self) -> Option<Pixel> {
        self.lines.last().and_then(|line| line.last()).copied()
    }
}

/// What a stroke is for people.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum StrokeKind {
    /// One point.
    Click,
    /// A line, or what was left of it.
    Scribble,
    /// A filled polygon, or what was left of it.
    Polygon,
}

impl StrokeKind {
    /// Its name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Click => "click",
            Self::Scribble => "scribble",
            Self::Polygon => "polygon",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clicks_scribbles_and_polygons_are_told_apart() {
        use StrokeKind::{Click, Polygon, Scribble};
        let drawn = |radius, lines: &[&[Pixel]]| {
            Stroke::drawn(0, 1, radius, lines.iter().map(|line| line.to_vec()).collect())
        };
        for (stroke, kind) in [
            (Stroke::click(0, 1, [3, 4]), Click),
            (drawn(5, &[&[[3, 4]]]), Click),
            (drawn(0, &[&[[3, 4], [9, 4]]]), Scribble),
            (drawn(0, &[&[[3, 4], [9, 4]], &[[12, 4], [20, 4]]]), Scribble),
            (drawn(2, &[&[[3, 4], [9, 4]], &[[3, 5], [9, 5]]]), Scribble),
            (drawn(0, &[&[[3, 4], [9, 4]], &[[3, 5], [9, 7]]]), Scribble),
            (Stroke::polygon(0, 1, &[[3, 4], [9, 4], [6, 9]]), Polygon),
        ] {
            assert_eq!(stroke.kind(), kind, "{stroke:?}");
        }
        let polygon = Stroke::polygon(0, 1, &[[1, 1], [3, 1], [3, 2], [1, 2]]);
        assert_eq!(polygon.pixel_count(9, 9), 6);
    }
}
