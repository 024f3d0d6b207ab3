//! A folder that `datasets.load_dataset("imagefolder", data_dir=...)` of Hugging Face reads.

use std::collections::BTreeMap;

use serde::Serialize;

use super::Refusal;
use super::layout::{Labelled, Layout, OutputFile, json_file};
use super::original::original;
use crate::labels::{Class, ClassId, VOID, png};

const IMAGES: &str = "images";
const LABELS: &str = "labels";

/// `images/`, `labels/<stem>.png`, `metadata.jsonl` and `id2label.json`.
///
/// - labels: class ids, 8 bit, or 16 bit where an id of the frame exceeds 255
/// - metadata: a line for each frame; its columns become `image`, `label` and `classes`
/// - id2label: names by ids, as the models of `transformers` take them; 0 is `void`
pub(super) struct HuggingFace;

/// A line of `metadata.jsonl`.
#[derive(Serialize)]
pub(super) struct Row {
    file_name: String,
    label_file_name: String,
    /// Names of the classes that the frame shows.
    classes: Vec<String>,
}

impl Layout for HuggingFace {
    type Entry = Row;

    fn folders(&self) -> &'static [&'static str] {
        &[IMAGES, LABELS]
    }

    fn frame(&self, frame: &Labelled<'_>) -> Result<(Vec<OutputFile>, Row), Refusal> {
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
            classes: shown
                .filter(|(_, is_shown)| **is_shown)
                .map(|(class, _)| class.name.clone())
                .collect(),
        };
        let labels = OutputFile::new(&row.label_file_name, labels);
        Ok((vec![original, labels], row))
    }

    fn index(&self, classes: &[Class], entries: Vec<Row>) -> Result<Vec<OutputFile>, Refusal> {
        let mut metadata = Vec::new();
        for row in entries {
            serde_json::to_writer(&mut metadata, &row)?;
            metadata.push(b'\n');
        }
        let mut names: BTreeMap<ClassId, &str> = classes
            .iter()
            .map(|class| (class.id, class.name.as_str()))
            .collect();
        names.insert(VOID, "void");
        Ok(vec![
            json_file("id2label.json", &names)?,
            OutputFile::new("metadata.jsonl", metadata),
        ])
    }
}
