//! The labels being edited, with what the panels want to know about them at every frame.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use inplace_core::labels::{Class, ClassId, Edit, History, LabelSet, Stroke, StrokeId};

use crate::class_view::Hidden;
use crate::palette::{Palette, VOID_COLOR, VOID_NAME};
use crate::versioned::Versioned;

/// Labels with undo and redo, their generation and their colours.
#[derive(Debug)]
pub struct Document {
    history: History,
    generation: u64,
    palette: Versioned<Arc<Palette>>,
    hidden: Hidden,
    index: StrokeIndex,
}

/// Which strokes there are, by what the window asks for; every edit changes only its own part of it.
#[derive(Debug, Default)]
struct StrokeIndex {
    of_frame: BTreeMap<usize, BTreeSet<StrokeId>>,
    count_of_class: BTreeMap<ClassId, usize>,
}

impl StrokeIndex {
    fn add(&mut self, id: StrokeId, stroke: &Stroke) {
        if self.of_frame.entry(stroke.frame).or_default().insert(id) {
            *self.count_of_class.entry(stroke.class).or_default() += 1;
        }
    }

    fn remove(&mut self, id: StrokeId, stroke: &Stroke) {
        let ids = self.of_frame.get_mut(&stroke.frame);
        if ids.is_some_and(|ids| ids.remove(&id))
            && let Some(count) = self.count_of_class.get_mut(&stroke.class)
        {
            *count = count.saturating_sub(1);
        }
    }
}

impl Document {
    /// Goes on from labels with their edits; `generation` is that of the newest maps made from them.
    pub fn new(history: History, generation: u64) -> Self {
        let mut index = StrokeIndex::default();
        for (&id, stroke) in &history.labels().strokes {
            index.add(id, stroke);
        }
        Self {
            palette: Versioned::new(Palette::new(&history.labels().classes)),
            history,
            generation,
            hidden: Hidden::default(),
            index,
        }
    }

    /// The labels as they are now.
    pub fn labels(&self) -> &LabelSet {
        self.history.labels()
    }

    /// The labels with the edits that led to them.
    pub fn history(&self) -> &History {
        &self.history
    }

    /// The classes, in the order shown.
    pub fn classes(&self) -> &[Class] {
        &self.history.labels().classes
    }

    /// Name and colour of a class; those of void where there is no such class.
    pub fn name_and_color(&self, id: ClassId) -> (&str, [u8; 3]) {
        let class = self.labels().class(id);
        class.map_or((VOID_NAME, VOID_COLOR), |class| (&class.name, class.color))
    }

    /// Name of what a stroke says: the object, or else the class.
    pub fn name_said(&self, stroke: &Stroke) -> &str {
        let object = stroke.object.and_then(|id| self.labels().object(id));
        object.map_or_else(|| self.name_and_color(stroke.class).0, |object| &object.name)
    }

    /// Counts up with every change that the maps may follow.
    pub fn generation(&self) -> u64 {
        self.generation
    }

    /// The classes' colours.
    pub fn palette(&self) -> &Versioned<Arc<Palette>> {
        &self.palette
    }

    /// Leaves classes and objects out of the palette.
    pub fn hide(&mut self, hidden: &Hidden) {
        if *hidden != self.hidden {
            self.hidden.clone_from(hidden);
            self.renew_palette();
        }
    }

    /// Number of strokes of a frame.
    pub fn strokes_of_frame(&self, frame: usize) -> usize {
        self.index.of_frame.get(&frame).map_or(0, BTreeSet::len)
    }

    /// Number of frames that have strokes.
    pub fn labelled_frames(&self) -> usize {
        let frames = self.index.of_frame.values();
        frames.filter(|strokes| !strokes.is_empty()).count()
    }

    /// Number of strokes of a class.
    pub fn strokes_of_class(&self, class: ClassId) -> usize {
        self.index.count_of_class.get(&class).copied().unwrap_or(0)
    }

    /// The strokes of a frame, earliest first.
    pub fn strokes_on(&self, frame: usize) -> impl DoubleEndedIterator<Item = (StrokeId, &Arc<Stroke>)> {
        let strokes = &self.labels().strokes;
        let ids = self.index.of_frame.get(&frame).into_iter().flatten();
        ids.filter_map(|id| Some((*id, strokes.get(id)?)))
    }

    /// Changes the history; `None` when nothing changed.
    pub fn edit(&mut self, change: impl FnOnce(&mut History) -> Option<Edit>) -> Option<Edit> {
        let edit = change(&mut self.history)?;
        if edit.changes_maps() {
            self.generation += 1;
        }
        if edit.classes.is_some() {
            self.renew_palette();
        }
        for change in &edit.strokes {
            if let Some(before) = &change.before {
                self.index.remove(change.id, before);
            }
            if let Some(after) = &change.after {
                self.index.add(change.id, after);
            }
        }
        Some(edit)
    }

    fn renew_palette(&mut self) {
        self.palette = Versioned::new(Palette::hiding(self.classes(), &self.hidden));
    }
}

/// The frame that an edit shows best: the one that it marks, or that of its last stroke.
pub fn frame_of(edit: &Edit) -> Option<usize> {
    if let Some(change) = edit.checked {
        return Some(change.frame);
    }
    let change = edit.strokes.last()?;
    let stroke = change.after.as_ref().or(change.before.as_ref())?;
    Some(stroke.frame)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn after_every_edit_the_index_is_that_of_the_labels_and_one_without_effect_is_no_new_generation() {
        let mut history = History::default();
        let (wall, _) = history.add_class("wall");
        let (floor, _) = history.add_class("floor");
        let mut document = Document::new(history, 0);
        let mut last = None;
        type Step<'a> = &'a dyn Fn(&mut History, Option<StrokeId>) -> Option<Edit>;
        let steps: [Step<'_>; 10] = [
            &|history, _| Some(history.add_stroke(Stroke::click(4, wall, [1, 1]))),
            &|history, _| Some(history.add_stroke(Stroke::polygon(4, floor, &[[3, 3], [9, 3], [9, 9]]))),
            &|history, _| history.erase_where(4, &[[5, 3]], 1, |_| true),
            &|history, last| history.change_stroke_class(last?, wall),
            &|history, _| Some(history.add_stroke(Stroke::click(2, floor, [1, 1]))),
            &|history, _| history.merge_class(floor, wall),
            &|history, last| history.delete_stroke(last?),
            &|history, _| history.undo(),
            &|history, _| history.undo(),
            &|history, _| history.delete_class(wall),
        ];
        for (number, step) in steps.iter().enumerate() {
            let edit = document.edit(|history| step(history, last)).unwrap();
            last = edit.strokes.last().map(|change| change.id);
            let fresh = Document::new(document.history().clone(), 0);
            for frame in 0..6 {
                let ids = |document: &Document| -> Vec<StrokeId> {
                    document.strokes_on(frame).map(|(id, _)| id).collect()
                };
                assert_eq!(ids(&document), ids(&fresh), "frame {frame} after step {number}");
            }
            for class in [0, wall, floor] {
                let counts = [&document, &fresh].map(|document| document.strokes_of_class(class));
                assert_eq!(counts[0], counts[1], "class {class} after step {number}");
            }
        }
        let generation = document.generation();
        assert!(document.edit(|history| history.delete_class(wall)).is_none());
        assert_eq!(document.generation(), generation);
    }
}
