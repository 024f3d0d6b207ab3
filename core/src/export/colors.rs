//! Colours that tell classes apart where the pixels of an image have nothing else to say what they are.

use std::collections::HashSet;

use crate::labels::{Class, DEFAULT_COLORS, rgb};

/// The colours of some classes, at most 255, so that none is black, which is void, and no two are the same. A class
/// keeps its colour if no class before it has the same one; the others get default colours that no class has.
pub(super) fn distinct(classes: &[Class]) -> Vec<[u8; 3]> {
    const VOID_COLOR: [u8; 3] = [0; 3];
    let mut taken: HashSet<[u8; 3]> = classes.iter().map(|class| class.color).collect();
    taken.insert(VOID_COLOR);
    let mut kept = HashSet::from([VOID_COLOR]);
    // More than there are classes.
    let mut free = DEFAULT_COLORS
        .into_iter()
        .map(rgb)
        .chain((1..=255).map(voc_color));
    let color = |class: &Class| {
        if kept.insert(class.color) {
            return class.color;
        }
        let other = free.by_ref().find(|&color| taken.insert(color));
        other.unwrap_or(class.color)
    };
    classes.iter().map(color).collect()
}

/// Colour of an index in the images of Pascal VOC: bit 3 k of the index is bit 7 - k of red, bit 3 k + 1 of green, bit
/// 3 k + 2 of blue.
pub(super) fn voc_color(index: u8) -> [u8; 3] {
    let channel = |channel: u8| {
        let bits = (0..3).filter(|k| 3 * k + channel < 8);
        bits.fold(0, |value, k| {
            value | (((index >> (3 * k + channel)) & 1) << (7 - k))
        })
    };
    [channel(0), channel(1), channel(2)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_that_share_a_colour_or_are_black_get_one_of_their_own() {
        let class = |id, color| Class {
            color,
            ..Class::new(id, "x")
        };
        let [first, second, third, ..] = DEFAULT_COLORS.map(rgb);
        let classes = [
            class(1, [9, 9, 9]),
            class(2, [0, 0, 0]),
            class(3, [9, 9, 9]),
            class(4, first),
        ];
        let colors = distinct(&classes);
        assert_eq!(colors, [[9, 9, 9], second, third, first]);
        let crowd: Vec<Class> = (1..=255).map(|id| class(id, first)).collect();
        let colors: HashSet<_> = distinct(&crowd).into_iter().collect();
        assert_eq!(colors.len(), 255);
        assert!(!colors.contains(&[0, 0, 0]));
    }

    #[test]
    fn voc_colours_are_those_of_its_development_kit() {
        for (index, color) in [
            (0, [0, 0, 0]),
            (1, [128, 0, 0]),
            (7, [128, 128, 128]),
            (20, [0, 64, 128]),
            (255, [224, 224, 192]),
        ] {
            assert_eq!(voc_color(index), color);
        }
    }
}
