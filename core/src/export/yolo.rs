//! Polygons for YOLO's segmentation.

use super::Refusal;
use super::layout::{About, Labelled, Layout, OutputFile};
use super::original::original;
use super::polygons::{Polygon, polygons};
use crate::labels::Class;

const IMAGES: &str = "images";
const LABELS: &str = "labels";

/// `images/`, `labels/<stem>.txt` and `data.yaml`, as Ultralytics reads them.
///
/// A line of a text is the class, counted from 0 in the order of `data.yaml`, and the polygon of a region whose pixels hang
/// together by their sides, x and y from 0 to 1. It has one object or a part of it, or a region of stuff. Polygons have no holes:
/// what lies inside a region comes after it and covers it, and void inside a region is lost.
pub(super) struct Yolo;

impl Layout for Yolo {
    type Entry = ();
    const FOLDERS: &'static [&'static str] = &[IMAGES, LABELS];
    // Ultralytics keeps what it has read of labels in a cache, and tells outdated ones by their size alone.
    const INDEX: &'static [&'static str] = &["data.yaml", "labels.cache"];

    fn frame(&self, frame: &Labelled<'_>) -> Result<(Vec<OutputFile>, ()), Refusal> {
        let original = original(frame.frame, IMAGES)?;
        let regions = polygons(frame)?;
        let text: String = regions
            .iter()
            .filter_map(|region| line(region, frame.size))
            .collect();
        let labels = OutputFile::new(format!("{LABELS}/{}.txt", frame.stem()), text.into_bytes());
        Ok((vec![labels, original], ()))
    }

    fn index(&self, about: About<'_>, _: Vec<()>) -> Result<Vec<OutputFile>, Refusal> {
        let name = |(number, class): (usize, &Class)| Ok(format!("  {number}: {}\n", quoted(&class.name)?));
        let names: Result<String, Refusal> = about.classes.iter().enumerate().map(name).collect();
        // Without a path they are looked for beside this file.
        let text = format!("train: {IMAGES}\nval: {IMAGES}\nnames:\n{}", names?);
        Ok(vec![OutputFile::new(Self::INDEX[0], text.into_bytes())])
    }
}

/// A name as a string of YAML: that of JSON, but for line breaks and characters that YAML refuses as they are.
fn quoted(name: &str) -> Result<String, Refusal> {
    let escaped = |c: char| match c {
        '\u{7f}'..='\u{9f}' | '\u{2028}' | '\u{2029}' | '\u{fffe}' | '\u{ffff}' => {
            format!("\\u{:04x}", u32::from(c))
        }
        c => c.to_string(),
    };
    Ok(serde_json::to_string(name)?.chars().map(escaped).collect())
}

/// A line of `labels/<stem>.txt`; `None` for void.
fn line(region: &Polygon, [width, height]: [u32; 2]) -> Option<String> {
    let class = region.segment?.class - 1;
    let point = |[x, y]: &[f32; 2]| format!(" {:.6} {:.6}", x / width as f32, y / height as f32);
    let points: String = region.points.iter().map(point).collect();
    Some(format!("{class}{points}\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_strings_of_yaml_whatever_they_hold() {
        let classes = [Class::new(1, "tüte \"\u{1}\u{7f}\u{85}\u{2028}😀")];
        let about = About {
            classes: &classes,
            objects: None,
        };
        let file = Yolo.index(about, Vec::new()).unwrap().remove(0);
        let text = String::from_utf8(file.bytes).unwrap();
        let escaped = r#"  0: "tüte \"\u0001\u007f\u0085\u2028😀""#;
        assert_eq!(text.lines().last(), Some(escaped));
    }
}
