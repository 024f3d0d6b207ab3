//! The strokes file: JSON that a person or a script can write.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::{Class, ClassId, LabelSet, Pixel, Stroke, StrokeId, VOID};
use crate::scene::Scene;

/// A strokes file that cannot be used; nothing of it is taken over.
#[derive(Debug, thiserror::Error)]
#[error("{}: {reason}", .path.display())]
pub struct StrokesError {
    path: PathBuf,
    reason: String,
}

#[derive(Serialize, Deserialize)]
struct StrokesFile {
    classes: Vec<Class>,
    strokes: Vec<StrokeRecord>,
}

#[derive(Serialize, Deserialize)]
struct StrokeRecord {
    frame: String,
    class: ClassId,
    points: Vec<Pixel>,
    #[serde(default)]
    radius: u32,
}

/// Reads a strokes file for a scene.
///
/// # Errors
/// An unreadable file, a class that is listed twice or not at all, an unknown frame, a point outside
/// the image: a sentence that names it.
pub fn read_strokes(path: &Path, scene: &Scene) -> Result<LabelSet, StrokesError> {
    let error = |reason: String| StrokesError {
        path: path.to_path_buf(),
        reason,
    };
    let text = std::fs::read_to_string(path).map_err(|e| error(format!("cannot be read: {e}")))?;
    let file: StrokesFile =
        serde_json::from_str(&text).map_err(|e| error(format!("is not a strokes file: {e}")))?;
    parse(file, scene).map_err(error)
}

fn parse(file: StrokesFile, scene: &Scene) -> Result<LabelSet, String> {
    let mut labels = LabelSet::default();
    for class in file.classes {
        if class.id == VOID {
            continue;
        }
        if labels.class(class.id).is_some() {
            return Err(format!(
                "class {} is listed twice; give each class its own id",
                class.id
            ));
        }
        labels.classes.push(class);
    }
    for (number, record) in file.strokes.into_iter().enumerate() {
        let place = format!("stroke {}", number + 1);
        let Some(frame) = scene.frame_index(&record.frame) else {
            return Err(format!(
                "{place} names frame \"{}\", which {} does not have",
                record.frame, scene.source
            ));
        };
        if record.class != VOID && labels.class(record.class).is_none() {
            return Err(format!(
                "{place} names class {}, which \"classes\" does not list",
                record.class
            ));
        }
        let camera = &scene.frames[frame].camera;
        if let Some([x, y]) = record
            .points
            .iter()
            .find(|[x, y]| *x >= camera.width || *y >= camera.height)
        {
            return Err(format!(
                "{place} has the point [{x}, {y}], which is outside frame \"{}\" ({}x{} pixels)",
                record.frame, camera.width, camera.height
            ));
        }
        if record.points.is_empty() {
            return Err(format!("{place} has no points"));
        }
        let stroke = Stroke {
            frame,
            class: record.class,
            radius: record.radius,
            lines: vec![record.points],
        };
        labels
            .strokes
            .insert(StrokeId(number as u64 + 1), Arc::new(stroke));
    }
    Ok(labels)
}

/// The labels as the text of a strokes file. `stems` holds the name of each frame of the scene.
///
/// A stroke with several lines (parts of it were erased) becomes one entry per line.
pub fn strokes_json(labels: &LabelSet, stems: &[String]) -> String {
    let records = labels.strokes.values().flat_map(|stroke| {
        let frame = stems.get(stroke.frame).cloned().unwrap_or_default();
        stroke.lines.iter().map(move |line| StrokeRecord {
            frame: frame.clone(),
            class: stroke.class,
            points: line.clone(),
            radius: stroke.radius,
        })
    });
    let file = StrokesFile {
        classes: labels.classes.clone(),
        strokes: records.collect(),
    };
    // Plain structs of numbers and strings always have a JSON form.
    serde_json::to_string_pretty(&file).unwrap_or_default()
}
