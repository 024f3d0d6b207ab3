//! How far inside its region each pixel of an image of labels lies.

use std::collections::BTreeMap;

/// For each pixel of an image of this width, row-major, within fewer rows and columns than so many all pixels have its
/// value: 1 on the rim of a region. Beyond the image's border no pixel has any value. In two passes over the pixels
/// (Rosenfeld and Pfaltz 1966).
pub fn insides(values: &[u16], width: usize) -> Vec<u32> {
    let height = values.len().checked_div(width).unwrap_or(0);
    let mut insides = vec![0_u32; values.len()];
    let mut pass = |rows: &mut dyn Iterator<Item = usize>, back: bool| {
        for row in rows {
            for step in 0..width {
                let column = if back { width - 1 - step } else { step };
                let own = row * width + column;
                let is_rim = row == 0 || column == 0 || row + 1 == height || column + 1 == width;
                let mut least = if back { insides[own] } else { u32::MAX };
                if is_rim {
                    least = 1;
                } else {
                    let before = [own - width - 1, own - width, own - width + 1, own - 1];
                    for other in before.map(|before| if back { 2 * own - before } else { before }) {
                        let is_same = values[other] == values[own];
                        let reached = if is_same { insides[other] } else { 0 };
                        least = least.min(reached + 1);
                    }
                }
                insides[own] = least;
            }
        }
    };
    pass(&mut (0..height), false);
    pass(&mut (0..height).rev(), true);
    insides
}

/// For each value of an image, one of the pixels that are farthest [inside](insides) its regions, and how far that is.
pub fn innermost(values: &[u16], width: usize) -> BTreeMap<u16, (usize, u32)> {
    let highest = values.iter().copied().max().unwrap_or(0);
    let mut deepest = vec![(0, 0); usize::from(highest) + 1];
    for (pixel, (&value, inside)) in values.iter().zip(insides(values, width)).enumerate() {
        let most = &mut deepest[usize::from(value)];
        if inside >= most.1 {
            *most = (pixel, inside);
        }
    }
    let of_values = (0..=u16::MAX).zip(deepest);
    of_values.filter(|(_, (_, inside))| *inside > 0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_innermost_pixel_is_that_with_most_room_around_it() {
        // A bar of 2 beside a block of 1 with a hole, and a lone 3 at the border.
        #[rustfmt::skip]
        let values = [
            2, 2, 1, 1, 1, 1, 1, 1, 1,
            2, 2, 1, 0, 1, 1, 1, 1, 1,
            2, 2, 1, 1, 1, 1, 1, 1, 1,
            2, 2, 1, 1, 1, 1, 1, 1, 1,
            2, 2, 3, 1, 1, 1, 1, 1, 1,
        ];
        let found = innermost(&values, 9);
        assert_eq!((found[&1], found[&0]), ((2 * 9 + 6, 3), (9 + 3, 1)));
        assert_eq!((found[&2].1, found[&3]), (1, (38, 1)));
        assert!(innermost(&[], 0).is_empty());
    }
}
