//! Edits: what a person can undo in one step.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::{Class, ImportId, ImportedLabels, LabelSet, Object, Stroke, StrokeId};

/// One stroke before and after an edit; `None` = not there.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StrokeChange {
    /// Which stroke.
    pub id: StrokeId,
    /// The stroke before the edit.
    pub before: Option<Stroke>,
    /// The stroke after the edit.
    pub after: Option<Stroke>,
}

impl StrokeChange {
    /// What makes a stroke another one, or takes it away.
    pub(super) fn of(id: StrokeId, before: &Stroke, after: Option<Stroke>) -> Self {
        let before = Some(before.clone());
        Self { id, before, after }
    }
}

/// Which label images are in force before and after an edit; [`History::imports`](super::History::imports) has them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ImportChange {
    /// Those before the edit.
    pub before: Option<ImportId>,
    /// Those after the edit.
    pub after: Option<ImportId>,
}

/// A frame was marked as checked, or the mark was taken away.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CheckChange {
    /// Index of the frame.
    pub frame: usize,
    /// Whether it is marked after the edit; before, it was the other way round.
    pub after: bool,
}

/// One step that a person can undo: everything that it changed, with what was there before.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Edit {
    /// What was done, for the undo menu: "scribble wall".
    pub name: String,
    /// Strokes that were added, changed or removed.
    pub strokes: Vec<StrokeChange>,
    /// The whole class list before and after, where it changed.
    pub classes: Option<(Vec<Class>, Vec<Class>)>,
    /// The whole list of objects before and after, where it changed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub objects: Option<(Vec<Object>, Vec<Object>)>,
    /// The label images from elsewhere, where they changed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub imported: Option<ImportChange>,
    /// The mark of a frame, where it changed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub checked: Option<CheckChange>,
}

impl Edit {
    /// The edit that takes this one back.
    pub fn inverse(&self) -> Self {
        let mut edit = self.clone();
        for change in &mut edit.strokes {
            std::mem::swap(&mut change.before, &mut change.after);
        }
        edit.classes = edit.classes.map(|(before, after)| (after, before));
        edit.objects = edit.objects.map(|(before, after)| (after, before));
        if let Some(change) = &mut edit.imported {
            std::mem::swap(&mut change.before, &mut change.after);
        }
        if let Some(change) = &mut edit.checked {
            change.after = !change.after;
        }
        edit
    }

    /// Whether the maps may be others after it: an edit that only marks a frame changes none.
    pub fn changes_maps(&self) -> bool {
        let rest = [
            self.classes.is_some(),
            self.objects.is_some(),
            self.imported.is_some(),
        ];
        !self.strokes.is_empty() || rest.contains(&true)
    }

    pub(super) fn apply(&self, labels: &mut LabelSet, imports: &BTreeMap<ImportId, Arc<ImportedLabels>>) {
        for change in &self.strokes {
            match &change.after {
                Some(stroke) => labels.strokes.insert(change.id, Arc::new(stroke.clone())),
                None => labels.strokes.remove(&change.id),
            };
        }
        if let Some((_, after)) = &self.classes {
            labels.classes.clone_from(after);
        }
        if let Some((_, after)) = &self.objects {
            labels.objects.clone_from(after);
        }
        if let Some(change) = &self.imported {
            labels.imported = change.after.and_then(|id| imports.get(&id)).cloned();
        }
        if let Some(CheckChange { frame, after }) = self.checked {
            match after {
                true => labels.checked.insert(frame),
                false => labels.checked.remove(&frame),
            };
        }
    }
}
