//! Pascal VOC segmentation, which CVAT and others read.

use std::collections::HashSet;
use std::fmt::Write as _;
use std::io::{Cursor, Write as _};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use super::Refusal;
use super::colors;
use super::layout::{About, Labelled, Layout, OutputFile};
use super::original::original;
use crate::labels::{Class, png};

/// What VOC calls void.
const BACKGROUND: &str = "background";
const MOST_CLASSES: usize = 255;
const LABEL_MAP: &str = "labelmap.txt";
const IMAGE_SET: &str = "ImageSets/Segmentation/default.txt";

/// `JPEGImages/`, `SegmentationClass/`, `SegmentationObject/`, `ImageSets/Segmentation/default.txt` and `labelmap.txt`; and
/// without the images once more in `cvat.zip`, as CVAT's "Segmentation mask 1.1".
///
/// Segmentations are PNGs with a palette. An index is the line of the class in `labelmap.txt`, counted from 0, and its
/// colour the one there, so that those who read indices and those who read colours find the same. The objects of a
/// frame are counted from 1: each object of things, and all that it shows of a class that is stuff or of whose objects nothing
/// is known.
pub(super) struct Voc;

/// The segmentations of a frame.
pub(super) struct Segmentations {
    stem: String,
    /// PNGs.
    class: Vec<u8>,
    object: Vec<u8>,
}

impl Layout for Voc {
    type Entry = Segmentations;
    const FOLDERS: &'static [&'static str] = &[
        "JPEGImages",
        "SegmentationClass",
        "SegmentationObject",
        "ImageSets/Segmentation",
    ];
    const INDEX: &'static [&'static str] = &["cvat.zip", LABEL_MAP, IMAGE_SET];

    fn check(&self, classes: &[Class]) -> Result<(), Refusal> {
        let refuse = |reason: String| Err(reason.into());
        if classes.len() > MOST_CLASSES {
            return refuse(format!(
                "its images hold at most {MOST_CLASSES} classes, and there are {}; export another format",
                classes.len()
            ));
        }
        let mut names = HashSet::from([BACKGROUND]);
        for class in classes {
            let name = class.name.trim();
            let ends_it = |c: char| c == ':' || c.is_control();
            if name.is_empty() || name.starts_with('#') || name.contains(ends_it) {
                return refuse(format!(
                    "class \"{name}\" cannot stand in labelmap.txt, where a name has no colon, no control character and no # at its start; rename it"
                ));
            }
            if !names.insert(name) {
                return refuse(format!(
                    "there are two classes \"{name}\" in labelmap.txt, where \"{BACKGROUND}\" is void; rename one"
                ));
            }
        }
        Ok(())
    }

    fn frame(&self, frame: &Labelled<'_>) -> Result<(Vec<OutputFile>, Segmentations), Refusal> {
        let stem = frame.stem();
        if stem.starts_with('#') || stem.trim() != stem || stem.contains(char::is_control) {
            let reason = "its name cannot stand in default.txt, a line for each, where # starts a comment and blanks around a name are lost; rename its image";
            return Err(reason.into());
        }
        let [width, height] = frame.size;
        let positions = frame.positions()?.into_iter().map(u8::try_from);
        let indices: Vec<u8> = positions.collect::<Result<_, _>>().map_err(|_| {
            let most = MOST_CLASSES;
            format!("it shows more than {most} classes; export another format")
        })?;
        let (segments, places) = frame.segments()?;
        let places = places.into_iter().map(u8::try_from);
        let places: Vec<u8> = places.collect::<Result<_, _>>().map_err(|_| {
            let (shown, most) = (segments.len(), u8::MAX);
            format!("it shows {shown} objects, and its images hold at most {most}; export another format")
        })?;
        let class_palette: Vec<[u8; 3]> = [[0; 3]]
            .into_iter()
            .chain(colors::distinct(frame.classes))
            .collect();
        let object_palette: Vec<[u8; 3]> = (0..=u8::MAX).map(colors::voc_color).collect();
        let class = png::encode_indexed(width, height, &indices, &class_palette)?;
        let object = png::encode_indexed(width, height, &places, &object_palette)?;
        let files = vec![
            original(frame.frame, "JPEGImages")?,
            OutputFile::new(class_path(stem), class.clone()),
            OutputFile::new(object_path(stem), object.clone()),
        ];
        let stem = stem.to_owned();
        Ok((files, Segmentations { stem, class, object }))
    }

    fn index(&self, about: About<'_>, entries: Vec<Segmentations>) -> Result<Vec<OutputFile>, Refusal> {
        let label_map = label_map(about.classes).into_bytes();
        let mut image_set = Vec::new();
        for entry in &entries {
            image_set.extend_from_slice(entry.stem.as_bytes());
            image_set.push(b'\n');
        }
        let mut archived: Vec<(String, &[u8])> = vec![
            (LABEL_MAP.to_owned(), &label_map),
            (IMAGE_SET.to_owned(), &image_set),
        ];
        for entry in &entries {
            archived.push((class_path(&entry.stem), &entry.class));
            archived.push((object_path(&entry.stem), &entry.object));
        }
        let archive = archive(&archived)?;
        Ok(vec![
            OutputFile::new(Self::INDEX[0], archive),
            OutputFile::new(LABEL_MAP, label_map),
            OutputFile::new(IMAGE_SET, image_set),
        ])
    }
}

fn class_path(stem: &str) -> String {
    format!("SegmentationClass/{stem}.png")
}

fn object_path(stem: &str) -> String {
    format!("SegmentationObject/{stem}.png")
}

/// A line for each class, void first: name, colour, parts, actions.
fn label_map(classes: &[Class]) -> String {
    let mut text = format!("# label:color_rgb:parts:actions\n{BACKGROUND}:0,0,0::\n");
    for (class, [red, green, blue]) in classes.iter().zip(colors::distinct(classes)) {
        // Writing to a string does not fail.
        let _ = writeln!(text, "{}:{red},{green},{blue}::", class.name.trim());
    }
    text
}

/// A ZIP archive that is the same whenever it is made. PNGs are compressed already.
fn archive(files: &[(String, &[u8])]) -> zip::result::ZipResult<Vec<u8>> {
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Stored)
        .last_modified_time(DateTime::default())
        .unix_permissions(0o644);
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in files {
        archive.start_file(name.as_str(), options)?;
        archive.write_all(bytes)?;
    }
    Ok(archive.finish()?.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::testing;

    #[test]
    fn frames_whose_names_cannot_stand_in_the_image_set_are_refused() {
        let (mut scene, classes) = (testing::scene(), testing::classes());
        for name in ["#1", " rgb_1", "rgb\n1", "rgb\u{85}1"] {
            scene.frames[0].stem = name.to_owned();
            let frame = testing::labelled(&scene, testing::SIZE, &classes, testing::labels(0));
            let error = Voc.frame(&frame).map(|_| ()).unwrap_err().to_string();
            assert!(error.contains("default.txt"), "{error}");
        }
    }

    #[test]
    fn classes_that_cannot_stand_in_the_label_map_are_named() {
        for (name, reason) in [
            ("a:b", "a:b"),
            ("#1", "#1"),
            ("a\u{85}b", "control character"),
            ("background", "two classes"),
            ("wall", "two"),
        ] {
            let error = Voc
                .check(&[Class::new(1, "wall"), Class::new(2, name)])
                .unwrap_err()
                .to_string();
            assert!(error.contains(reason), "{error}");
        }
        let crowd: Vec<Class> = (1..=256).map(|id| Class::new(id, id.to_string())).collect();
        assert!(Voc.check(&crowd).unwrap_err().to_string().contains("256"));
        assert!(Voc.check(&crowd[..255]).is_ok());
    }
}
