//! The edits of a damaged project: which can still be undone, and what they say about the labels.

use std::collections::BTreeMap;

use crate::labels::{Class, Edit, Stroke, StrokeId};

/// What the readable edits come to.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct Replay {
    /// The edits around the cursor without a gap: those that undo and redo can walk through.
    pub(super) kept: Vec<Edit>,
    /// How many of them are in force.
    pub(super) cursor: usize,
    /// Edits that are not among them.
    pub(super) lost: usize,
    /// Every stroke that an edit tells of, as it should be now; `None` = it should not be there.
    pub(super) strokes: BTreeMap<StrokeId, Option<Stroke>>,
    /// The classes as they should be now, where an edit tells of them.
    pub(super) classes: Option<Vec<Class>>,
}

impl Replay {
    /// Replays edits by their numbers. Where it is not known how many are in force, that is found out by what agrees
    /// with the strokes that were `read`.
    pub(super) fn of(
        edits: &BTreeMap<usize, Edit>,
        cursor: Option<usize>,
        read: &BTreeMap<StrokeId, Stroke>,
    ) -> Self {
        let count = edits.last_key_value().map_or(0, |(&last, _)| last + 1);
        // Edits at the end may be lost, but not more than could have made all of the strokes.
        let possible = cursor.filter(|&cursor| cursor <= count + read.len());
        let cursor = possible.unwrap_or_else(|| likely_cursor(edits, read));
        let gap_before = missing_below(edits, cursor);
        let start = gap_before.map_or(0, |gap| gap + 1);
        let kept: Vec<Edit> = (start..)
            .map_while(|number| edits.get(&number).cloned())
            .collect();
        let mut strokes = BTreeMap::new();
        let mut classes = None;
        for edit in edits.range(..cursor).map(|(_, edit)| edit) {
            for change in &edit.strokes {
                strokes.insert(change.id, change.after.clone());
            }
            if let Some((_, after)) = &edit.classes {
                classes = Some(after.clone());
            }
        }
        // What an undone edit found is what is there now, if no edit in force tells.
        for edit in edits.range(cursor..).map(|(_, edit)| edit) {
            for change in &edit.strokes {
                strokes.entry(change.id).or_insert_with(|| change.before.clone());
            }
            if let (None, Some((before, _))) = (&classes, &edit.classes) {
                classes = Some(before.clone());
            }
        }
        Self {
            lost: count.max(cursor) - kept.len(),
            cursor: cursor - start,
            kept,
            strokes,
            classes,
        }
    }
}

/// The highest number below `cursor` that no edit has.
fn missing_below(edits: &BTreeMap<usize, Edit>, cursor: usize) -> Option<usize> {
    let mut expected = cursor;
    for (&number, _) in edits.range(..cursor).rev() {
        if number + 1 != expected {
            break;
        }
        expected = number;
    }
    expected.checked_sub(1)
}

/// The number of edits after which most of the strokes that were read are as the edits say; the largest of several.
fn likely_cursor(edits: &BTreeMap<usize, Edit>, read: &BTreeMap<StrokeId, Stroke>) -> usize {
    let mut states: BTreeMap<StrokeId, bool> = BTreeMap::new();
    let (mut agreeing, mut most, mut likely) = (0_usize, 0, 0);
    for (&number, edit) in edits {
        for change in &edit.strokes {
            let Some(stroke) = read.get(&change.id) else {
                continue;
            };
            let agrees = change.after.as_ref() == Some(stroke);
            let before = states.insert(change.id, agrees).unwrap_or(false);
            agreeing = agreeing + usize::from(agrees) - usize::from(before);
        }
        if agreeing >= most {
            (most, likely) = (agreeing, number + 1);
        }
    }
    likely
}

/// All strokes that an edit tells of, before and after it.
pub(super) fn strokes_of(edit: &Edit) -> impl Iterator<Item = &Stroke> {
    let changes = edit.strokes.iter();
    changes
        .flat_map(|change| [&change.before, &change.after])
        .flatten()
}
