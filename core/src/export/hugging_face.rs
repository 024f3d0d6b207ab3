//! A folder that `datasets.load_dataset("imagefolder", data_dir=...)` of Hugging Face reads.

use std::collections::BTreeMap;

use serde::Serialize;

use super::Refusal;
use super::layout::{Labelled, Layout, OutputFile, json_file};
use super::original::Original;
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
        let original = Original::of(frame.frame)?;
        let row = Row {
            file_name: format!("{IMAGES}/{}", original.name()),
            label_file_name: format!("{LABELS}/{}.png", frame.stem()),
            classes: shown
                .filter(|(_, is_shown)| **is_shown)
                .map(|(class, _)| class.name.clone())
                .collect(),
        };
        let files = vec![
            original.into_file(IMAGES),
            OutputFile::new(&row.label_file_name, labels),
        ];
        Ok((files, row))
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

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;
    use crate::export::Format;
    use crate::export::testing;

    #[test]
    fn every_line_leads_to_an_image_and_its_labels() {
        let exported = testing::exported(Format::HuggingFace);
        let names: BTreeMap<ClassId, String> =
            serde_json::from_slice(&exported.files["id2label.json"]).unwrap();
        assert_eq!(names.len(), testing::classes().len() + 1);
        let metadata = std::str::from_utf8(&exported.files["metadata.jsonl"]).unwrap();
        assert_eq!(metadata.lines().count(), 2);
        for (line, labels) in metadata.lines().zip(&exported.labels) {
            let row: Value = serde_json::from_str(line).unwrap();
            let file = |column: &str| &exported.files[row[column].as_str().unwrap()];
            assert!(image::load_from_memory(file("file_name")).is_ok());
            assert_eq!(&png::decode_gray(file("label_file_name")).unwrap().2, labels);
            let shown: Vec<&str> = names
                .iter()
                .filter(|(id, _)| **id != VOID && labels.contains(id))
                .map(|(_, name)| name.as_str())
                .collect();
            assert_eq!(row["classes"], serde_json::json!(shown));
        }
    }
}
