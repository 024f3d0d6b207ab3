//! Run-length encoding of masks as in COCO: the lengths of runs of zeros and ones by turns, zeros first, down the
//! columns from the left (the `maskApi` of pycocotools).

use crate::labels::Run;

/// Run lengths of the mask of some pixels in an image of this width and height. `runs` are ordered by row and do not
/// overlap.
pub(super) fn counts(runs: &[Run], [width, height]: [u32; 2]) -> Vec<u32> {
    let column = |run: &Run| {
        let Run { row, first, last } = *run;
        (first..=last).map(move |x| x * height + row)
    };
    // Places down the columns.
    let mut places: Vec<u32> = runs.iter().flat_map(column).collect();
    places.sort_unstable();
    let (mut counts, mut end) = (Vec::new(), 0);
    for ones in places.chunk_by(|before, after| before + 1 == *after) {
        let length = ones.len() as u32;
        counts.extend([ones[0] - end, length]);
        end = ones[0] + length;
    }
    if end < width * height {
        counts.push(width * height - end);
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
