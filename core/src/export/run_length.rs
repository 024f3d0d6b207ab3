//! Run-length encoding of masks as in COCO: the lengths of runs of zeros and ones by turns, zeros first, down the
//! columns from the left (the `maskApi` of pycocotools).

use super::components::box_around;
use crate::labels::Run;

/// Run lengths of the mask of some pixels in an image of this width and height. `runs` are ordered by row and do not
/// overlap.
pub(super) fn counts(runs: &[Run], [width, height]: [u32; 2]) -> Vec<u32> {
    let bounds = box_around(runs);
    let (columns, rows) = (bounds.width as usize, bounds.height as usize);
    let mut inside = vec![false; columns * rows];
    for run in runs {
        for x in run.first..=run.last {
            inside[(x - bounds.x) as usize * rows + (run.row - bounds.y) as usize] = true;
        }
    }
    let mut counts = Vec::new();
    // The run of ones that may go on: where it starts, and its length so far.
    let (mut start, mut ones) = (0, 0);
    for (x, column) in (bounds.x..).zip(inside.chunks_exact(rows.max(1))) {
        for (y, _) in (bounds.y..).zip(column).filter(|(_, inside)| **inside) {
            let place = x * height + y;
            if ones > 0 && place == start + ones {
                ones += 1;
                continue;
            }
            if ones > 0 {
                counts.push(ones);
            }
            counts.push(place - start - ones);
            (start, ones) = (place, 1);
        }
    }
    if ones > 0 {
        counts.push(ones);
    }
    if start + ones < width * height {
        counts.push(width * height - start - ones);
    }
    counts
}

/// The counts as COCO's string: from the third on the difference to the one before the last, five bits to a
/// character from the lowest on, a sixth bit that says whether more follow, from the character `0` up.
pub(super) fn compressed(counts: &[u32]) -> String {
    let mut text = String::new();
    for (index, &count) in counts.iter().enumerate() {
        let mut value = i64::from(count);
        if index > 2 {
            value -= i64::from(counts[index - 2]);
        }
        loop {
            let bits = (value & 0x1f) as u8;
            value >>= 5;
            // The rest says nothing new when it only repeats the sign.
            let more = value != if bits & 0x10 == 0 { 0 } else { -1 };
            text.push(char::from(48 + bits + if more { 0x20 } else { 0 }));
            if !more {
                break;
            }
        }
    }
    text
}

/// The counts of COCO's string.
#[cfg(test)]
pub(super) fn decompressed(text: &str) -> Vec<u32> {
    let mut counts: Vec<i64> = Vec::new();
    let mut bytes = text.bytes().peekable();
    while bytes.peek().is_some() {
        let (mut value, mut shift) = (0_i64, 0);
        for byte in bytes.by_ref() {
            let bits = byte - 48;
            value |= i64::from(bits & 0x1f) << shift;
            shift += 5;
            if bits & 0x20 == 0 {
                if bits & 0x10 != 0 {
                    value |= -1 << shift;
                }
                break;
            }
        }
        if counts.len() > 2 {
            value += counts[counts.len() - 2];
        }
        counts.push(value);
    }
    counts
        .into_iter()
        .map(|count| u32::try_from(count).unwrap())
        .collect()
}

/// The pixels of a mask, row-major `[height, width]`.
#[cfg(test)]
pub(super) fn decoded(counts: &[u32], [width, height]: [u32; 2]) -> Vec<bool> {
    let columns: Vec<bool> = counts
        .iter()
        .enumerate()
        .flat_map(|(index, &count)| std::iter::repeat_n(index % 2 == 1, count as usize))
        .collect();
    assert_eq!(columns.len(), (width * height) as usize);
    let rows = (0..height).flat_map(|y| (0..width).map(move |x| x * height + y));
    rows.map(|place| columns[place as usize]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::components::{Neighbours, components};
    use crate::export::testing::{HEIGHT, SIZE, WIDTH, labels};

    #[test]
    fn masks_come_back_from_their_strings() {
        for frame in 0..8 {
            let labels = labels(frame);
            for component in components(&labels, WIDTH, Neighbours::SidesAndCorners) {
                let mut mask = vec![false; (WIDTH * HEIGHT) as usize];
                for run in &component.runs {
                    mask[run.indices(WIDTH)].fill(true);
                }
                let counts = counts(&component.runs, SIZE);
                assert_eq!(decompressed(&compressed(&counts)), counts);
                assert_eq!(decoded(&counts, SIZE), mask);
            }
        }
    }

    #[test]
    fn strings_are_those_of_pycocotools() {
        // mask.encode of a 4 x 3 mask whose right half is set, of one with only the first pixel, and of a full one.
        let run = |row, first, last| Run { row, first, last };
        for (runs, expected_counts, expected) in [
            ((0..3).map(|row| run(row, 2, 3)).collect(), vec![6, 6], "66"),
            (vec![run(0, 0, 0)], vec![0, 1, 11], "01;"),
            (
                (0..3).map(|row| run(row, 0, 3)).collect::<Vec<_>>(),
                vec![0, 12],
                "0<",
            ),
        ] {
            let counts = counts(&runs, [4, 3]);
            assert_eq!(counts, expected_counts);
            assert_eq!(compressed(&counts), expected);
        }
        assert_eq!(compressed(&[100, 3, 97, 3, 900, 40, 7]), "T33Q30Si0U1STO");
    }
}
