//! Label, entropy and colour PNGs of every frame: the plain format, which loses nothing.

use std::collections::HashMap;
use std::path::Path;

use super::layout::{About, Labelled, Layout, OutputFile, is_in, json_file, refuse_truth};
use super::objects::{OBJECTS, ObjectPixels, objects_file};
use super::{ExportError, Refusal};
use crate::labels::{Class, ClassId, png};
use crate::scene::Scene;

/// `labels/<stem>.png`, `entropy/<stem>.png` and `color/<stem>.png` for every frame, and `classes.json`.
///
/// - labels: class ids, 8 bit, or 16 bit where an id of the frame exceeds 255
/// - entropy: 16 bit, nats times [`ENTROPY_STEPS_PER_NAT`](crate::session::ENTROPY_STEPS_PER_NAT)
/// - color: the classes' colours; void and ids without a class are black
///
/// Where classes are things and the maps follow from a surface, `objects/<stem>.png` too, and `objects.json`:
///
/// - objects: numbers of objects, 16 bit, the same in all frames; all of a class that is stuff is one object, and 0 is void
///   or a thing of which nobody said which one
pub(super) struct Pngs;

/// The list of the classes.
pub(super) const CLASSES: &str = "classes.json";

/// The folders of [`Format::Png`](super::Format::Png), below the export's own.
pub(super) const PNG_FOLDERS: [&str; 3] = ["labels", "entropy", "color"];

/// [Prepares](super::prepare) a folder for the label images of a scene, of which no more has to be known than its
/// [list](crate::session::Event::Listed) of frames.
///
/// # Errors
/// [`ExportError::Incomplete`] where files would lie among the capture's own images; [`ExportError::Unwritable`].
pub fn prepare_pngs(folder: &Path, scene: &Scene) -> Result<(), ExportError> {
    let has_images = |inner: &&str| {
        let place = folder.join(inner);
        scene.frames.iter().any(|frame| is_in(&frame.path, &place))
    };
    if let Some(inner) = PNG_FOLDERS.into_iter().find(has_images) {
        let reason = format!("{inner}/ has the capture's own images; choose another folder");
        return Err(ExportError::incomplete(folder, reason));
    }
    refuse_truth(folder, scene)?;
    super::prepare(folder, &PNG_FOLDERS)
}

impl Layout for Pngs {
    type Entry = ObjectPixels;
    const FOLDERS: &'static [&'static str] = &PNG_FOLDERS;
    const OBJECT_FOLDERS: &'static [&'static str] = &[OBJECTS];
    // Of an export for Hugging Face, which would tell of other numbers.
    const INDEX: &'static [&'static str] = super::hugging_face::HuggingFace::LISTS;

    fn frame(&self, frame: &Labelled<'_>) -> Result<(Vec<OutputFile>, Self::Entry), Refusal> {
        let [width, height] = frame.size;
        let mut images = vec![
            ("labels", png::encode_labels(width, height, &frame.labels)),
            ("entropy", png::encode_steps(width, height, &frame.entropy)),
            ("color", png::encode_rgb(width, height, &class_colors(frame))),
        ];
        if let Some(objects) = &frame.objects {
            images.push((OBJECTS, png::encode_steps(width, height, objects)));
        }
        let files = images
            .into_iter()
            .map(|(folder, image)| Ok(OutputFile::new(format!("{folder}/{}.png", frame.stem()), image?)));
        Ok((files.collect::<Result<_, Refusal>>()?, ObjectPixels::of(frame)))
    }

    fn index(&self, about: About<'_>, entries: Vec<Self::Entry>) -> Result<Vec<OutputFile>, Refusal> {
        let mut files = vec![json_file(CLASSES, about.classes)?];
        files.extend(objects_file(about, &entries)?);
        Ok(files)
    }
}

/// The colour of each class, by its id.
pub(super) fn colors_by_id(classes: &[Class]) -> HashMap<ClassId, [u8; 3]> {
    classes.iter().map(|class| (class.id, class.color)).collect()
}

/// The colour of every pixel's class, row-major `[height, width, 3]`; black for void and ids without a class.
pub(super) fn class_colors(frame: &Labelled<'_>) -> Vec<u8> {
    let colors = colors_by_id(frame.classes);
    let mut rgb = Vec::with_capacity(frame.labels.len());
    for same in frame.labels.chunk_by(|a, b| a == b) {
        let color = colors.get(&same[0]).copied().unwrap_or_default();
        rgb.resize(rgb.len() + same.len(), color);
    }
    rgb.into_flattened()
}
