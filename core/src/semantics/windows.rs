//! Windows of pixels: squares of so many pixels to each side, cut off at the edges of the image.

use std::ops::Range;

/// The rows or columns, of so many, that are in the window around one.
pub(super) fn window(at: usize, count: usize, reach: usize) -> Range<usize> {
    at.saturating_sub(reach)..(at + reach + 1).min(count)
}

/// Dilation of a row-major image: the values in the window around each pixel, joined by something like a maximum, for which
/// neither order nor repetition counts, and the default nothing.
pub(super) fn dilated<T: Copy + Default>(
    values: &[T],
    width: usize,
    reach: usize,
    join: impl Fn(T, T) -> T,
) -> Vec<T> {
    let height = values.len() / width;
    let mut rows = Vec::with_capacity(values.len());
    for row in values.chunks_exact(width) {
        let in_row = |column| row[window(column, width, reach)].iter().copied();
        rows.extend((0..width).map(|column| in_row(column).fold(T::default(), &join)));
    }
    let mut all = vec![T::default(); values.len()];
    for row in 0..height {
        for other in window(row, height, reach) {
            for column in 0..width {
                let into = &mut all[row * width + column];
                *into = join(*into, rows[other * width + column]);
            }
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_joins_what_is_at_most_so_far_away_in_rows_and_columns() {
        let mut values = [0_u32; 35];
        (values[9], values[34]) = (5, 7);
        let near =
            |at: usize, other: usize| (at % 7).abs_diff(other % 7).max((at / 7).abs_diff(other / 7)) <= 2;
        let expected = (0..35).map(|at| match (near(at, 9), near(at, 34)) {
            (_, true) => 7,
            (true, false) => 5,
            (false, false) => 0,
        });
        assert_eq!(dilated(&values, 7, 2, u32::max), expected.collect::<Vec<_>>());
    }
}
