//! Sets of pixels on the canvas, and where they end.

use std::sync::Arc;

use egui::{Color32, Mesh, Rect, pos2};
use inplace_core::labels::Run;

use super::shapes::fill;
use super::view::Placement;

/// A set of pixels: its runs, and the sides of its pixels where it ends, in image positions.
#[derive(Clone, Debug)]
pub struct Region {
    /// Its pixels, by row and column; no run touches another.
    runs: Arc<[Run]>,
    border: Arc<[Rect]>,
}

impl Region {
    /// The pixels of these runs, which are by row and column and do not touch each other.
    pub fn new(runs: Vec<Run>) -> Self {
        Self {
            border: border_of(&runs).into(),
            runs: runs.into(),
        }
    }

    /// Adds its inside to a mesh, and over it lines along its border, one over the other: half their widths in points, and
    /// their colours.
    pub fn paint(&self, mesh: &mut Mesh, placement: Placement, inside: Color32, lines: &[(f32, Color32)]) {
        fill(mesh, &self.runs, placement, inside);
        for &(half, color) in lines {
            mesh.reserve_vertices(4 * self.border.len());
            for side in self.border.iter() {
                let side = Rect::from_min_max(placement.to_screen(side.min), placement.to_screen(side.max));
                mesh.add_colored_rect(side.expand(half), color);
            }
        }
    }
}

/// The sides of pixels in runs that no pixel of the runs lies beyond, as rectangles without width or height; those that
/// follow each other in a line are one.
fn border_of(runs: &[Run]) -> Vec<Rect> {
    let in_row = |row: Option<u32>| {
        let from = row.map_or(0, |row| runs.partition_point(|run| run.row < row));
        let to = row.map_or(0, |row| runs.partition_point(|run| run.row <= row));
        &runs[from..to]
    };
    let mut border = upright_sides(runs);
    for run in runs {
        let (left, right) = (run.first as f32, run.last as f32 + 1.0);
        let (top, bottom) = (run.row as f32, run.row as f32 + 1.0);
        for (y, beyond) in [
            (top, in_row(run.row.checked_sub(1))),
            (bottom, in_row(run.row.checked_add(1))),
        ] {
            let mut from = left;
            for other in beyond {
                let (other_left, other_right) = (other.first as f32, other.last as f32 + 1.0);
                if other_left > from {
                    border.push(Rect::from_min_max(pos2(from, y), pos2(other_left.min(right), y)));
                }
                from = from.max(other_right);
                if from >= right {
                    break;
                }
            }
            if from < right {
                border.push(Rect::from_min_max(pos2(from, y), pos2(right, y)));
            }
        }
    }
    border
}

/// The left and right sides of runs.
fn upright_sides(runs: &[Run]) -> Vec<Rect> {
    let mut sides = Vec::new();
    let mut end = |&(x, top): &(u32, u32), bottom: u32| {
        let [x, top, bottom] = [x, top, bottom].map(|at| at as f32);
        sides.push(Rect::from_min_max(pos2(x, top), pos2(x, bottom)));
    };
    // Those of the row before from the left, each with the row where it begins; and the row after that.
    let (mut open, mut next): (Vec<(u32, u32)>, u32) = (Vec::new(), 0);
    for row in runs.chunk_by(|a, b| a.row == b.row) {
        let y = row[0].row;
        let before = if y == next { open.as_slice() } else { &[] };
        let top = |x: u32| {
            let above = before.binary_search_by_key(&x, |&(x, _)| x);
            above.map_or(y, |at| before[at].1)
        };
        let columns = row.iter().flat_map(|run| [run.first, run.last + 1]);
        let now: Vec<(u32, u32)> = columns.map(|x| (x, top(x))).collect();
        let ended = open.iter().filter(|side| now.binary_search(side).is_err());
        ended.for_each(|side| end(side, next));
        (open, next) = (now, y + 1);
    }
    open.iter().for_each(|side| end(side, next));
    sides
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_border_of_a_polygon_is_every_side_of_a_pixel_without_a_neighbour() {
        let run = |row, first, last| Run { row, first, last };
        // ..##..##   with a bay, a hole is the same
        // ..######
        let runs = [run(4, 2, 3), run(4, 6, 7), run(5, 2, 7)];
        let mut length = 0.0;
        for side in border_of(&runs) {
            assert!(side.width() == 0.0 || side.height() == 0.0);
            length += side.width() + side.height();
        }
        assert_eq!(length, 2.0 * (6.0 + 2.0) + 2.0);
        // A square, and another below a gap, have four sides each.
        let rows = [0, 1, 2, 4, 5].map(|row| run(row, 3, 5));
        assert_eq!(border_of(&rows).len(), 8);
        let alone = border_of(&[run(0, 0, 0), run(1, 5, 5)]);
        let length: f32 = alone.iter().map(|side| side.width() + side.height()).sum();
        assert_eq!(length, 8.0);
    }
}
