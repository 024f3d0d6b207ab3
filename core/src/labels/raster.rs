//! Strokes to pixels, and the eraser.

use super::runs::{Coverage, Run, contains};
use super::{ClassId, LabelSet, Pixel, Stroke, StrokeId};

/// Row-major indices of the pixels that a stroke covers in an image of this size, ascending.
///
/// A pixel is covered when its centre is within `radius` of the polyline, or is one of the line's own
/// pixels.
pub fn pixels_of(stroke: &Stroke, width: u32, height: u32) -> Vec<u32> {
    let runs = runs_of(stroke, width, height);
    let indices = |run: Run| (run.row * width + run.first)..=(run.row * width + run.last);
    runs.into_iter().flat_map(indices).collect()
}

/// The pixels of [`pixels_of`] as runs by row and column, none of them touching another.
pub fn runs_of(stroke: &Stroke, width: u32, height: u32) -> Vec<Run> {
    let (Some(last_column), Some(last_row)) = (width.checked_sub(1), height.checked_sub(1)) else {
        return Vec::new();
    };
    let image = Bounds {
        min: [0, 0],
        max: [last_column, last_row],
    };
    if stroke.radius > 0 {
        let corners = stroke.lines.iter().flatten();
        let points = stroke.lines.iter().flat_map(|line| along(line));
        return brushed(points, Bounds::of(corners), stroke.radius, &image);
    }
    let mut coverage = Coverage::new(0, last_row);
    for line in &stroke.lines {
        match line.as_slice() {
            // The rows of a polygon, which need not be taken apart.
            [[from, row], [to, other]] if row == other && *from.min(to) <= last_column => {
                coverage.add(*row, *from.min(to), last_column.min(*from.max(to)));
            }
            _ => {
                let inside = along(line).filter(|[x, _]| *x <= last_column);
                inside.for_each(|[x, y]| coverage.add(y, x, x));
            }
        }
    }
    coverage.finish()
}

/// The runs of all pixels within `radius` of a point, those outside `within` left out; the points are all within
/// `around`.
fn brushed(
    points: impl Iterator<Item = Pixel>,
    around: Option<Bounds>,
    radius: u32,
    within: &Bounds,
) -> Vec<Run> {
    let Some(around) = around else {
        return Vec::new();
    };
    let reached = around.grown(radius);
    let top = reached.min[1].max(within.min[1]);
    let bottom = reached.max[1].min(within.max[1]);
    let mut coverage = Coverage::new(top, bottom);
    // Half the width of the disc at each distance from its middle row.
    let farthest = radius.min(around.max[1].abs_diff(top).max(bottom.abs_diff(around.min[1])));
    let square = u64::from(radius).pow(2);
    let halves: Vec<u32> = (0..=u64::from(farthest))
        .map(|row| (square - row * row).isqrt() as u32)
        .collect();
    for [x, y] in points {
        for row in top.max(y.saturating_sub(radius))..=bottom.min(y.saturating_add(radius)) {
            let half = halves[row.abs_diff(y) as usize];
            let first = x.saturating_sub(half).max(within.min[0]);
            let last = x.saturating_add(half).min(within.max[0]);
            if first <= last {
                coverage.add(row, first, last);
            }
        }
    }
    coverage.finish()
}

/// The labelled pixels of a frame, ascending: row-major index and class (void included), later strokes over earlier ones.
pub fn rasterise(
    labels: &LabelSet,
    frame: usize,
    width: u32,
    height: u32,
) -> Vec<(u32, (ClassId, StrokeId))> {
    let strokes: Vec<_> = labels.strokes_of(frame).collect();
    let latest_first = strokes.into_iter().rev().flat_map(|(id, stroke)| {
        let said = (stroke.class, id);
        let pixels = pixels_of(stroke, width, height);
        pixels.into_iter().map(move |pixel| (pixel, said))
    });
    let mut pixels: Vec<_> = latest_first.collect();
    // A stable sort keeps the order of equal pixels, and merges what is ascending already.
    pixels.sort_by_key(|&(pixel, _)| pixel);
    pixels.dedup_by_key(|&mut (pixel, _)| pixel);
    pixels
}

/// What remains of a stroke after an eraser of `radius` pixels passed along `path`.
///
/// `None` when nothing changes; a stroke without lines when all of it is erased.
pub fn erase(stroke: &Stroke, path: &[Pixel], radius: u32) -> Option<Stroke> {
    let reach = radius.saturating_add(stroke.radius);
    let around = Bounds::of(path.iter())?.grown(reach);
    let near = |line: &[Pixel]| Bounds::of(line.iter()).is_some_and(|bounds| bounds.touches(&around));
    if !stroke.lines.iter().any(|line| near(line)) {
        return None;
    }
    let own = Bounds::of(stroke.lines.iter().flatten())?;
    let eraser = brushed(along(path), Bounds::of(path.iter()), reach, &own);
    let erased = |point: &Pixel| contains(&eraser, *point);
    let mut changed = false;
    let mut lines = Vec::new();
    for line in &stroke.lines {
        let dense: Vec<Pixel> = along(if near(line) { line } else { &[] }).collect();
        if !dense.iter().any(erased) {
            lines.push(line.clone());
            continue;
        }
        changed = true;
        lines.extend(
            dense
                .split(erased)
                .filter(|piece| !piece.is_empty())
                .map(simplified),
        );
    }
    changed.then(|| Stroke {
        lines,
        ..stroke.clone()
    })
}

/// The columns and rows between which points lie, both ends included.
#[derive(Clone, Copy)]
struct Bounds {
    min: Pixel,
    max: Pixel,
}

impl Bounds {
    fn of<'a>(mut points: impl Iterator<Item = &'a Pixel>) -> Option<Self> {
        let first = *points.next()?;
        let (mut min, mut max) = (first, first);
        for &[x, y] in points {
            min = [min[0].min(x), min[1].min(y)];
            max = [max[0].max(x), max[1].max(y)];
        }
        Some(Self { min, max })
    }

    fn grown(self, by: u32) -> Self {
        Self {
            min: self.min.map(|value| value.saturating_sub(by)),
            max: self.max.map(|value| value.saturating_add(by)),
        }
    }

    fn touches(&self, other: &Self) -> bool {
        (0..2).all(|axis| self.min[axis] <= other.max[axis] && other.min[axis] <= self.max[axis])
    }
}

/// The pixels of a polyline in its order, both ends included; those of inner corners come twice. One by one: a line may be
/// longer than there is memory for.
pub(super) fn along(line: &[Pixel]) -> impl Iterator<Item = Pixel> {
    let single = match line {
        [point] => Some(*point),
        _ => None,
    };
    let segments = line.windows(2).flat_map(|pair| segment(pair[0], pair[1]));
    single.into_iter().chain(segments)
}

/// The pixels of a straight line, both ends included (Bresenham).
fn segment(from: Pixel, to: Pixel) -> impl Iterator<Item = Pixel> {
    let [mut x, mut y] = from.map(i64::from);
    let [x1, y1] = to.map(i64::from);
    let (dx, dy) = ((x1 - x).abs(), -(y1 - y).abs());
    let (step_x, step_y) = ((x1 - x).signum(), (y1 - y).signum());
    let mut error = dx + dy;
    std::iter::successors(Some(from), move |_| {
        if (x, y) == (x1, y1) {
            return None;
        }
        let doubled = 2 * error;
        if doubled >= dy {
            error += dy;
            x += step_x;
        }
        if doubled <= dx {
            error += dx;
            y += step_y;
        }
        Some([x as u32, y as u32])
    })
}

/// The polyline of the pixels that a polyline's pixels become; those that become none are left out.
pub(super) fn redrawn(line: &[Pixel], place: impl Fn(Pixel) -> Option<Pixel>) -> Vec<Pixel> {
    let mut placed: Vec<Pixel> = along(line).filter_map(place).collect();
    placed.dedup();
    simplified(&placed)
}

/// Drops the inner points of straight runs of neighbouring pixels; covers the same pixels.
fn simplified(points: &[Pixel]) -> Vec<Pixel> {
    let direction = |a: Pixel, b: Pixel| {
        (
            i64::from(b[0]) - i64::from(a[0]),
            i64::from(b[1]) - i64::from(a[1]),
        )
    };
    let mut kept = Vec::new();
    for (index, &point) in points.iter().enumerate() {
        let inner = index > 0
            && index + 1 < points.len()
            && direction(points[index - 1], point) == direction(point, points[index + 1]);
        if !inner {
            kept.push(point);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::{History, StrokeKind};

    fn line(radius: u32, points: &[Pixel]) -> Stroke {
        Stroke::drawn(0, 1, radius, vec![points.to_vec()])
    }

    #[test]
    fn a_click_is_a_disc_that_is_cut_at_the_image_border() {
        assert_eq!(pixels_of(&Stroke::click(0, 1, [3, 2]), 10, 5), [23]);
        assert_eq!(pixels_of(&line(1, &[[0, 0]]), 10, 5), [0, 1, 10]);
        assert_eq!(pixels_of(&line(2, &[[5, 2]]), 10, 5).len(), 13);
    }

    #[test]
    fn runs_are_the_pixels_within_the_radius_of_the_line() {
        let stroke = line(3, &[[1, 9], [14, 3], [30, 12], [2, 11]]);
        let within = |index: u32| {
            let [x, y] = [index % 26, index / 26].map(i64::from);
            let near = |[px, py]: Pixel| (i64::from(px) - x).pow(2) + (i64::from(py) - y).pow(2) <= 9;
            stroke.lines.iter().flat_map(|line| along(line)).any(near)
        };
        let expected: Vec<u32> = (0..26 * 14).filter(|&index| within(index)).collect();
        assert_eq!(pixels_of(&stroke, 26, 14), expected);
        let runs = runs_of(&stroke, 26, 14);
        assert_eq!(runs.iter().map(Run::pixels).sum::<u64>(), expected.len() as u64);
        let apart = |pair: &[Run]| (pair[0].row, pair[0].last + 1) < (pair[1].row, pair[1].first);
        assert!(runs.windows(2).all(apart), "{runs:?}");
    }

    #[test]
    fn later_strokes_cover_earlier_ones() {
        let mut history = History::default();
        history.add_stroke(line(1, &[[5, 2]]));
        history.add_stroke(Stroke::click(0, 7, [5, 2]));
        let map = rasterise(history.labels(), 0, 10, 5);
        assert_eq!(map.iter().filter(|&&(pixel, _)| pixel == 25).count(), 1);
        assert!(map.contains(&(25, (7, StrokeId(2)))) && map.contains(&(24, (1, StrokeId(1)))));
        assert!(map.is_sorted());
    }

    #[test]
    fn erasing_leaves_the_ends_of_a_scribble_nothing_of_what_is_covered_and_what_lies_elsewhere() {
        let rest = erase(&line(0, &[[0, 2], [20, 2]]), &[[10, 2]], 3).unwrap();
        assert_eq!(rest.lines, [vec![[0, 2], [6, 2]], vec![[14, 2], [20, 2]]]);
        let stroke = line(1, &[[3, 3]]);
        assert_eq!(erase(&stroke, &[[9, 9]], 2), None);
        assert!(erase(&stroke, &[[4, 3]], 0).unwrap().lines.is_empty());
    }

    #[test]
    fn erasing_a_polygon_takes_the_pixels_under_the_eraser_and_no_others() {
        let polygon = Stroke::polygon(0, 1, &[[2, 2], [30, 5], [22, 25], [4, 18]]);
        let path = [[10, 0], [10, 12], [40, 12]];
        let rest = erase(&polygon, &path, 2).unwrap();
        let eraser = pixels_of(&line(2, &path), 40, 30);
        let mut expected = pixels_of(&polygon, 40, 30);
        expected.retain(|pixel| !eraser.contains(pixel));
        assert_eq!(pixels_of(&rest, 40, 30), expected);
        assert_eq!(rest.kind(), StrokeKind::Polygon);
        assert_eq!(erase(&rest, &path, 2), None);
    }
}
