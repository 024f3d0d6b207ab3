//! The class lists of well-known data sets, to start from. Names and numbers are those of the data sets, so that
//! exports can be compared with them.

use super::{Class, VOID};

/// The classes of a data set.
#[derive(Debug, PartialEq, Eq)]
pub struct ClassPalette {
    /// Name of the data set's list.
    pub name: &'static str,
    /// What kind of scenes it is for, in a few words.
    pub scenes: &'static str,
    /// A class list, see [`parse_class_list`].
    json: &'static str,
}

/// All lists, the smallest first. Void (0) is in none of them.
///
/// - NYU-13: Couprie et al. 2013, numbers and colours of SceneNet (Handa et al. 2016).
/// - ScanNet-20: the classes of ScanNet's benchmark (Dai et al. 2017) under their NYU-40 numbers.
/// - Cityscapes: the label ids of Cordts et al. 2016, not the train ids.
/// - NYU-40: Gupta et al. 2013, colours of ScanNet.
/// - COCO-Stuff: the 171 things and stuff of Caesar et al. 2018, numbers of its label list, colours of COCO panoptic.
pub static PALETTES: [ClassPalette; 5] = [
    ClassPalette::new("NYU-13", "rooms, coarse", include_str!("palette/nyu13.json")),
    ClassPalette::new(
        "ScanNet-20",
        "rooms, as in its benchmark",
        include_str!("palette/scannet20.json"),
    ),
    ClassPalette::new("Cityscapes", "streets", include_str!("palette/cityscapes.json")),
    ClassPalette::new("NYU-40", "rooms, fine", include_str!("palette/nyu40.json")),
    ClassPalette::new(
        "COCO-Stuff",
        "everything, indoors and out",
        include_str!("palette/coco-stuff.json"),
    ),
];

impl ClassPalette {
    const fn new(name: &'static str, scenes: &'static str, json: &'static str) -> Self {
        Self { name, scenes, json }
    }

    /// The classes, in the data set's order.
    pub fn classes(&self) -> Vec<Class> {
        // Compiled in, and a test reads every one.
        parse_class_list(self.json).unwrap_or_default()
    }
}

/// Reads the text of a class list, `[{"id", "name", "color", "thing"}]`; void is left out, and a class without a colour gets
/// its default one, one that does not say whether it is a thing is so [by its name](super::is_thing).
///
/// # Errors
/// No such list, or a class that is listed twice or has no name: part of a sentence.
pub fn parse_class_list(text: &str) -> Result<Vec<Class>, String> {
    let mut classes = parse_with_void(text)?;
    classes.retain(|class| class.id != VOID);
    Ok(classes)
}

/// The same with void, where it is listed.
pub(super) fn parse_with_void(text: &str) -> Result<Vec<Class>, String> {
    // Some editors save a byte order mark before the text.
    let classes = serde_json::from_str(text.trim_start_matches('\u{feff}'));
    let mut classes: Vec<Class> = classes.map_err(|error| error.to_string())?;
    let mut ids = std::collections::BTreeSet::new();
    for class in &mut classes {
        if !ids.insert(class.id) {
            return Err(format!("class {} is listed twice", class.id));
        }
        class.name = class.name.trim().to_owned();
        if class.name.is_empty() {
            return Err(format!("class {} has no name", class.id));
        }
    }
    Ok(classes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_palette_has_its_classes_with_names_numbers_and_colours_of_their_own() {
        let counts = [13, 20, 33, 40, 171];
        for (palette, count) in PALETTES.iter().zip(counts) {
            let classes = parse_class_list(palette.json).unwrap();
            assert_eq!(classes, palette.classes());
            let marked = format!("\u{feff}{}", palette.json);
            assert_eq!(parse_class_list(&marked), Ok(palette.classes()));
            let ids: BTreeSet<_> = classes.iter().map(|class| class.id).collect();
            let names: BTreeSet<_> = classes.iter().map(|class| class.name.to_lowercase()).collect();
            let colors: BTreeSet<_> = classes.iter().map(|class| class.color).collect();
            for own in [classes.len(), ids.len(), names.len(), colors.len()] {
                assert_eq!(own, count, "{}", palette.name);
            }
            assert!(!ids.contains(&VOID));
            assert!(classes.is_sorted_by_key(|class| class.id));
        }
    }
}
