//! A folder that `datasets.load_dataset("imagefolder", data_dir=...)` of Hugging Face reads.

use std::collections::BTreeMap;

use serde::Serialize;

use super::Refusal;
use super::layout::{About, Labelled, Layout, OutputFile, json_file};
use super::objects::{OBJECTS, ObjectPixels, objects_file};
use super::original::original;
use super::pngs::CLASSES;
use crate::labels::{ClassId, VOID, png};

const IMAGES: &str = "images";
const LABELS: &str = "labels";

/// `images/`, `labels/<stem>.png`, `metadata.jsonl` and `id2label.json`, and `objects/<stem>.png` and `objects.json` as of the
/// plain format, where there are any.
///
/// - labels: class ids, 8 bit, or 16 bit where an id of the frame exceeds 255
/// - metadata: a line for each frame; its columns become `image`, `label`, `objects` and `classes`
/// - id2label: names by ids, as the models of `transformers` take them; 0 is `void`
pub(super) struct HuggingFace;

impl HuggingFace {
    pub(super) const LISTS: &'static [&'static str] = &["id2label.json", "metadata.jsonl"];
}

/// A line of `metadata.jsonl`.
#[derive(Serialize)]
pub(super) struct Row {
    file_name: String,
    label_file_name: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    objects_file_name: Option<String>,
    /// Names of the classes that the frame shows.
    classes: Vec<String>,
}

impl Layout for HuggingFace {
    type Entry = (Row, ObjectPixels);
    const FOLDERS: &'static [&'static str] = &[IMAGES, LABELS];
    const OBJECT_FOLDERS: &'static [&'static str] = &[OBJECTS];
    // The list of classes is one of label images, which would tell of other numbers.
    const INDEX: &'static [&'static str] = &[Self::LISTS[0], Self::LISTS[1], CLASSES];

    fn frame(&self, frame: &Labelled<'_>) -> Result<(Vec<OutputFile>, Self::Entry), Refusal> {
        let [width, height] = frame.size;
        let mut is_shown = vec![false; frame.classes.len() + 1];
        for position in frame.positions()? {
            is_shown[usize::from(position)] = true;
        }
        let shown = frame.classes.iter().zip(&is_shown[1..]);
        let labels = png::encode_labels(width, height, &frame.labels)?;
        let original = original(frame.frame, IMAGES)?;
        let row = Row {
            file_name: format!("{IMAGES}/{}", original.name()),
            label_file_name: format!("{LABELS}/{}.png", frame.stem()),
            objects_file_name: frame
                .objects
                .as_ref()
                .map(|_| format!("{OBJECTS}/{}.png", frame.stem())),
            classes: shown
                .filter(|(_, is_shown)| **is_shown)
                .map(|(class, _)| class.name.clone())
                .collect(),
        };
        let mut files = vec![original, OutputFile::new(&row.label_file_name, labels)];
        if let (Some(path), Some(objects)) = (&row.objects_file_name, &frame.objects) {
            files.push(OutputFile::new(path, png::encode_steps(width, height, objects)?));
        }
        Ok((files, (row, ObjectPixels::of(frame))))
    }

    fn index(&self, about: About<'_>, entries: Vec<Self::Entry>) -> Result<Vec<OutputFile>, Refusal> {
        let mut metadata = Vec::new();
        let (rows, pixels): (Vec<Row>, Vec<ObjectPixels>) = entries.into_iter().unzip();
        for row in rows {
            serde_json::to_writer(&mut metadata, &row)?;
            metadata.push(b'\n');
        }
        let mut names: BTreeMap<ClassId, &str> = about
            .classes
            .iter()
            .map(|class| (class.id, class.name.as_str()))
            .collect();
        names.insert(VOID, "void");
        let mut files = vec![
            json_file(Self::LISTS[0], &names)?,
            OutputFile::new(Self::LISTS[1], metadata),
        ];
        files.extend(objects_file(about, &pixels)?);
        Ok(files)
    }
}
