//! Results on disk: label maps, data sets and the labelled surface. Each file is written under a temporary name and
//! renamed, so that a killed run leaves no half file.

mod atomic;
mod boxes;
mod cityscapes;
mod coco;
mod coco_instances;
mod coco_panoptic;
mod colors;
mod comparison;
mod components;
mod error;
mod format;
mod hugging_face;
mod ids;
mod inputs;
mod labelme;
mod layout;
mod memory;
mod objects;
mod original;
mod overlay;
mod ply;
mod pngs;
mod polygons;
mod report;
mod run_length;
mod solid;
#[cfg(test)]
mod testing;
mod views;
mod voc;
mod yolo;

use std::path::Path;

pub use atomic::write as write_whole;
pub use comparison::{Agreement, ClassAgreement, ClassMatching, Difference, Labelling, compare};
pub use error::ExportError;
use error::Refusal;
pub use format::{Format, export};
pub use ids::IdMap;
pub use inputs::{Inputs, digest, finished};
pub use layout::{LabelledScene, Written, is_capture};
pub use memory::{peak_memory, resident_memory, total_memory};
pub use pngs::prepare_pngs;
pub use report::{PhaseSeconds, Report};
pub use views::{Views, export_views};

use ids::Ids;

use crate::labels::{Class, LabelSet, strokes_json};
use crate::scene::Frame;

/// The name of a run's report in its folder.
const REPORT: &str = "report.json";

/// What is exported of each map, whatever the format.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// Pixels whose class is less probable than this (0..=1) become void; maps of which no probabilities are known, such
    /// as a project's saved ones, are an error then.
    pub least_probability: Option<f32>,
    /// Other numbers for the classes.
    pub ids: Option<IdMap>,
}

impl Options {
    /// What the ids of a project's classes become.
    fn ids_of<'a>(&self, classes: &'a [Class]) -> Ids<'a> {
        Ids::new(classes, self.ids.as_ref())
    }
}

/// Makes the folder and these inside it, and tries whether files can be written there: call it before
/// any work whose result is to be kept there.
///
/// # Errors
/// [`ExportError::Unwritable`].
pub fn prepare(folder: &Path, inner: &[&str]) -> Result<(), ExportError> {
    let inner = inner.iter().map(|name| folder.join(name));
    for folder in std::iter::once(folder.to_path_buf()).chain(inner) {
        atomic::prepare(&folder).map_err(|error| ExportError::unwritable(&folder, error))?;
    }
    Ok(())
}

/// Removes a file of an earlier export that must not stand beside those of this one; returns whether it was there.
///
/// # Errors
/// [`ExportError::Unwritable`].
fn remove(path: &Path) -> Result<bool, ExportError> {
    match std::fs::remove_file(path) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(ExportError::unwritable(path, error)),
    }
}

/// Writes `report.json` into an export's folder.
///
/// # Errors
/// [`ExportError::Unwritable`].
pub fn write_report(folder: &Path, report: &Report) -> Result<(), ExportError> {
    write_json(&folder.join(REPORT), report)
}

/// Writes a strokes file for the frames of a scene; strokes on other frames (that have vanished from the
/// scene) are left out.
///
/// # Errors
/// [`ExportError::Unwritable`].
pub fn write_strokes(path: &Path, labels: &LabelSet, frames: &[Frame]) -> Result<(), ExportError> {
    write(path, (strokes_json(labels, frames) + "\n").as_bytes())
}

/// Writes a value as a JSON file, under a temporary name first.
///
/// # Errors
/// [`ExportError::Unwritable`].
pub fn write_json<T: serde::Serialize + ?Sized>(path: &Path, value: &T) -> Result<(), ExportError> {
    let mut text = serde_json::to_vec_pretty(value)
        .map_err(|error| ExportError::unwritable(path, std::io::Error::other(error)))?;
    text.push(b'\n');
    write(path, &text)
}

/// Writes a file under a temporary name first.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), ExportError> {
    let written = atomic::write(path, bytes);
    written
        .map(|_| ())
        .map_err(|error| ExportError::unwritable(path, error))
}

#[cfg(test)]
mod tests;
