//! Whether strokes, classes and edits say the same: most of what a person said is in the file twice.

use std::collections::BTreeSet;
use std::path::Path;

use super::contents::some_names;
use super::error::Fault;
use crate::labels::{Edit, History, LabelSet, Stroke, StrokeId};
use crate::scene::LARGEST_SIDE;

/// A warning about the file at `path`, where its labels are not those that its edits lead to when all are undone, all
/// redone, and those after the cursor undone again. They are in a file that was only written here. `stems` are the names of
/// its frames.
pub(super) fn warning(path: &Path, history: &History, stems: &[String]) -> Option<String> {
    let mut replayed = history.clone();
    while replayed.undo().is_some() {}
    while replayed.redo().is_some() {}
    let (edits, cursor) = history.edits();
    for _ in cursor..edits.len() {
        replayed.undo();
    }
    let (own, other) = (history.labels(), replayed.labels());
    let strokes = own.strokes.keys().chain(other.strokes.keys()).copied();
    let strokes: BTreeSet<StrokeId> = strokes
        .filter(|id| own.strokes.get(id) != other.strokes.get(id))
        .collect();
    let mut parts = Vec::new();
    if !strokes.is_empty() {
        let frames = strokes.iter().filter_map(|id| own.strokes.get(id));
        let stems: BTreeSet<&str> = frames
            .filter_map(|stroke| stems.get(stroke.frame).map(String::as_str))
            .collect();
        let on = match stems.len() {
            0 => String::new(),
            _ => format!(" on {}", some_names(stems.iter().copied())),
        };
        parts.push(format!("strokes{on} ({})", strokes.len()));
    }
    let imports_differ = history.imports().1 != replayed.imports().1;
    for (differ, what) in [
        (own.classes != other.classes, "the classes"),
        (own.objects != other.objects, "the objects"),
        (imports_differ, "the imported label images"),
        (own.checked != other.checked, "the frames that are checked"),
    ] {
        if differ {
            parts.push(what.to_owned());
        }
    }
    (!parts.is_empty()).then(|| {
        format!(
            "{}: differs from its own edit history in {}, so something has changed the file from outside; check them",
            path.display(),
            parts.join(" and ")
        )
    })
}

/// A radius that no stroke has.
const WIDEST: u32 = 1 << 20;

/// Whether a stroke can have been drawn. Points may lie beyond their image, which may have become smaller, but not
/// beyond every image: following a line of four billion pixels would take minutes.
fn is_sane(stroke: &Stroke) -> bool {
    let near = |point: &[u32; 2]| point.iter().all(|&place| u64::from(place) <= LARGEST_SIDE);
    stroke.radius <= WIDEST && stroke.lines.iter().flatten().all(near)
}

/// A number that no stroke and no import gets; above those that a file has, there must be numbers for new ones.
const MOST_ID: u64 = 1 << 62;

/// Whether a stroke or an import can have this number.
pub(super) fn is_id(number: u64) -> bool {
    number < MOST_ID
}

/// A number of a stroke or an import that an edit names and none can have.
fn foreign_id(edit: &Edit) -> Option<u64> {
    let imports = edit
        .imported
        .iter()
        .flat_map(|change| [change.before, change.after]);
    let strokes = edit.strokes.iter().map(|change| change.id.0);
    strokes
        .chain(imports.flatten().map(|id| id.0))
        .find(|&id| !is_id(id))
}

/// Refuses labels that name frames, classes or pixels that there cannot be.
pub(super) fn check(labels: &LabelSet, edits: &[Edit], frames: usize) -> Result<(), Fault> {
    let damaged = |reason: String| Err(Fault::Damage(reason));
    for (id, stroke) in &labels.strokes {
        if !is_id(id.0) {
            return damaged(format!("no stroke has the number {}", id.0));
        }
        if stroke.frame >= frames {
            return damaged(format!("stroke {} is on a frame that it does not list", id.0));
        }
        if stroke.class != crate::labels::VOID && labels.class(stroke.class).is_none() {
            return damaged(format!("stroke {} is of a class that it does not list", id.0));
        }
        let of_class = |id| {
            labels
                .object(id)
                .is_some_and(|object| object.class == stroke.class)
        };
        if !stroke.object.is_none_or(of_class) {
            return damaged(format!(
                "stroke {} is of an object that its class does not list",
                id.0
            ));
        }
        if !is_sane(stroke) {
            return damaged(format!("stroke {} is far outside of every image", id.0));
        }
    }
    for (number, edit) in edits.iter().enumerate() {
        if let Some(id) = foreign_id(edit) {
            return damaged(format!(
                "edit {number} is of a stroke or an import with the number {id}"
            ));
        }
        let strokes = edit.strokes.iter();
        let mut strokes = strokes
            .flat_map(|change| [&change.before, &change.after])
            .flatten();
        let is_listed = edit.checked.is_none_or(|change| change.frame < frames);
        if !is_listed || !strokes.all(|stroke| stroke.frame < frames && is_sane(stroke)) {
            return damaged(format!(
                "edit {number} is on a frame or a pixel that there is not"
            ));
        }
    }
    Ok(())
}
