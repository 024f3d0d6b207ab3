//! The labels being edited, with what the panels want to know about them at every frame.

use std::collections::BTreeMap;
use std::sync::Arc;

use inplace_core::labels::{Class, ClassId, Edit, History, LabelSet};

use crate::canvas::Palette;

/// Labels with undo and redo, their generation and their colours.
#[derive(Debug)]
pub struct Document {
    history: History,
    generation: u64,
    palette: Arc<Palette>,
    palette_serial: u64,
    strokes_by_frame: BTreeMap<usize, usize>,
    strokes_by_class: BTreeMap<ClassId, usize>,
}

impl Document {
    /// Goes on from labels with their edits; `generation` is that of the newest maps made from them.
    pub fn new(history: History, generation: u64) -> Self {
        let mut document = Self {
            palette: Palette::new(&history.labels().classes),
            history,
            generation,
            palette_serial: 1,
            strokes_by_frame: BTreeMap::new(),
            strokes_by_class: BTreeMap::new(),
        };
        document.count();
        document
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

    /// Counts up with every change.
    pub fn generation(&self) -> u64 {
        self.generation
    }

    /// The classes' colours, and a number that changes with them.
    pub fn palette(&self) -> (&Arc<Palette>, u64) {
        (&self.palette, self.palette_serial)
    }

    /// Number of strokes of a frame.
    pub fn strokes_of_frame(&self, frame: usize) -> usize {
        self.strokes_by_frame.get(&frame).copied().unwrap_or(0)
    }

    /// Number of frames that have strokes.
    pub fn labelled_frames(&self) -> usize {
        self.strokes_by_frame.len()
    }

    /// Number of strokes of a class.
    pub fn strokes_of_class(&self, class: ClassId) -> usize {
        self.strokes_by_class.get(&class).copied().unwrap_or(0)
    }

    /// Changes the history; `None` when nothing changed.
    pub fn edit(&mut self, change: impl FnOnce(&mut History) -> Option<Edit>) -> Option<Edit> {
        let edit = change(&mut self.history)?;
        self.generation += 1;
        if edit.classes.is_some() {
            self.palette = Palette::new(self.classes());
            self.palette_serial += 1;
        }
        self.count();
        Some(edit)
    }

    fn count(&mut self) {
        self.strokes_by_frame.clear();
        self.strokes_by_class.clear();
        for stroke in self.history.labels().strokes.values() {
            *self.strokes_by_frame.entry(stroke.frame).or_default() += 1;
            *self.strokes_by_class.entry(stroke.class).or_default() += 1;
        }
    }
}

/// The frame that an edit shows best: that of its last stroke.
pub fn frame_of(edit: &Edit) -> Option<usize> {
    let change = edit.strokes.last()?;
    let stroke = change.after.as_ref().or(change.before.as_ref())?;
    Some(stroke.frame)
}

#[cfg(test)]
mod tests {
    use super::*;
    use inplace_core::labels::Stroke;

    #[test]
    fn counts_and_colours_follow_the_edits() {
        let mut document = Document::new(History::default(), 0);
        let mut wall = 0;
        document.edit(|history| {
            let (id, edit) = history.add_class("wall");
            wall = id;
            Some(edit)
        });
        document.edit(|history| Some(history.add_stroke(Stroke::click(4, wall, [1, 1]))));
        assert_eq!(document.generation(), 2);
        assert_eq!(document.palette().0.class(wall)[3], 255);
        assert_eq!(
            (document.strokes_of_frame(4), document.strokes_of_class(wall)),
            (1, 1)
        );
        let undone = document.edit(History::undo).unwrap();
        assert_eq!(frame_of(&undone), Some(4));
        assert_eq!(document.strokes_of_frame(4), 0);
    }

    #[test]
    fn an_edit_without_effect_is_no_new_generation() {
        let mut document = Document::new(History::default(), 7);
        assert!(document.edit(History::undo).is_none());
        assert_eq!(document.generation(), 7);
    }
}
