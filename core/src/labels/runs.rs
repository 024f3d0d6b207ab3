//! Sets of pixels as horizontal runs.

use std::ops::RangeInclusive;

use super::Pixel;

/// Neighbouring pixels of one row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Run {
    /// The row, from the top.
    pub row: u32,
    /// Column of the first pixel.
    pub first: u32,
    /// Column of the last pixel, which is part of the run.
    pub last: u32,
}

impl Run {
    /// The run as a polyline: its two ends, or its only pixel.
    pub fn line(&self) -> Vec<Pixel> {
        if self.first == self.last {
            vec![[self.first, self.row]]
        } else {
            vec![[self.first, self.row], [self.last, self.row]]
        }
    }

    /// Row-major indices of the pixels in an image of this width.
    pub fn indices(&self, width: u32) -> RangeInclusive<usize> {
        let row = self.row as usize * width as usize;
        row + self.first as usize..=row + self.last as usize
    }

    /// Number of pixels.
    pub fn pixels(&self) -> u64 {
        u64::from(self.last - self.first) + 1
    }
}

/// The rows of an image of this width, row-major `[height, width]`, as runs of equal values from the top left on.
pub fn runs_of_equal<T: Copy + PartialEq>(values: &[T], width: u32) -> Vec<(T, Run)> {
    let mut runs = Vec::new();
    for (row, values) in (0..).zip(values.chunks_exact(width.max(1) as usize)) {
        let mut first = 0;
        for same in values.chunk_by(|a, b| a == b) {
            let next = first + same.len() as u32;
            let last = next - 1;
            runs.push((same[0], Run { row, first, last }));
            first = next;
        }
    }
    runs
}

/// Runs being collected, in any order; they may overlap.
pub(super) struct Coverage {
    top: u32,
    /// First and last column of the runs of each row from `top` on.
    rows: Vec<Vec<[u32; 2]>>,
}

impl Coverage {
    /// Nothing yet, in the rows from `top` to `bottom`, both included.
    pub(super) fn new(top: u32, bottom: u32) -> Self {
        let rows = (u64::from(bottom) + 1).saturating_sub(u64::from(top));
        Self {
            top,
            rows: vec![Vec::new(); rows as usize],
        }
    }

    /// Adds the pixels from `first` to `last` of a row; rows outside are left out.
    pub(super) fn add(&mut self, row: u32, first: u32, last: u32) {
        let index = row.checked_sub(self.top).map(|index| index as usize);
        let Some(runs) = index.and_then(|index| self.rows.get_mut(index)) else {
            return;
        };
        // Neighbouring places of a brush overlap: most runs only make the one before longer.
        match runs.last_mut() {
            Some(before) if first <= before[1].saturating_add(1) && before[0] <= last.saturating_add(1) => {
                *before = [before[0].min(first), before[1].max(last)];
            }
            _ => runs.push([first, last]),
        }
    }

    /// The runs by row and column, none of them touching another.
    pub(super) fn finish(self) -> Vec<Run> {
        let mut finished: Vec<Run> = Vec::new();
        for (row, mut runs) in (self.top..).zip(self.rows) {
            runs.sort_unstable();
            for [first, last] in runs {
                match finished.last_mut() {
                    Some(run) if run.row == row && first <= run.last.saturating_add(1) => {
                        run.last = run.last.max(last);
                    }
                    _ => finished.push(Run { row, first, last }),
                }
            }
        }
        finished
    }
}

/// Whether a pixel is in runs that [`Coverage::finish`] gave.
pub(crate) fn contains(runs: &[Run], [x, y]: Pixel) -> bool {
    let after = runs.partition_point(|run| (run.row, run.first) <= (y, x));
    let run = after.checked_sub(1).and_then(|index| runs.get(index));
    run.is_some_and(|run| run.row == y && x <= run.last)
}
