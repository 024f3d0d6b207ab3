//! Label, entropy and colour PNGs of every frame: the plain format, which loses nothing.

use std::collections::HashMap;

use super::Refusal;
use super::layout::{Labelled, Layout, OutputFile, json_file};
use crate::labels::{Class, ClassId, png};

/// `labels/<stem>.png`, `entropy/<stem>.png` and `color/<stem>.png` for every frame, and `classes.json`.
///
/// - labels: class ids, 8 bit, or 16 bit where an id of the frame exceeds 255
/// - entropy: 16 bit, nats times [`ENTROPY_STEPS_PER_NAT`](crate::session::ENTROPY_STEPS_PER_NAT)
/// - color: the classes' colours; void and ids without a class are black
pub(super) struct Pngs;

/// The folders of [`Format::Png`](super::Format::Png), below the export's own.
pub const PNG_FOLDERS: [&str; 3] = ["labels", "entropy", "color"];

impl Layout for Pngs {
    type Entry = ();

    fn folders(&self) -> &'static [&'static str] {
        &PNG_FOLDERS
    }

    fn frame(&self, frame: &Labelled<'_>) -> Result<(Vec<OutputFile>, ()), Refusal> {
        let [width, height] = frame.size;
        let images = [
            ("labels", png::encode_labels(width, height, &frame.labels)),
            ("entropy", png::encode_steps(width, height, &frame.entropy)),
            ("color", png::encode_rgb(width, height, &class_colors(frame))),
        ];
        let files = images
            .into_iter()
            .map(|(folder, image)| Ok(OutputFile::new(format!("{folder}/{}.png", frame.stem()), image?)));
        Ok((files.collect::<Result<_, Refusal>>()?, ()))
    }

    fn index(&self, classes: &[Class], _: Vec<()>) -> Result<Vec<OutputFile>, Refusal> {
        Ok(vec![json_file("classes.json", classes)?])
    }
}

/// The colour of each class, by its id.
pub(super) fn colors_by_id(classes: &[Class]) -> HashMap<ClassId, [u8; 3]> {
    classes.iter().map(|class| (class.id, class.color)).collect()
}

/// The colour of every pixel's class, row-major `[height, width, 3]`; black for void and ids without a class.
pub(super) fn class_colors(frame: &Labelled<'_>) -> Vec<u8> {
    let colors = colors_by_id(frame.classes);
    let color = |label: &ClassId| colors.get(label).copied().unwrap_or_default();
    frame.labels.iter().flat_map(color).collect()
}
