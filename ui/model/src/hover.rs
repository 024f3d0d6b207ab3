//! What a click at the pointer would win.

use std::sync::Arc;

use inplace_core::labels::{Pixel, Stroke};
use inplace_core::session::Preview;

/// The place under the pointer, and what is known of a click there.
#[derive(Debug, Default)]
pub struct Hover {
    /// The pixel of the frame in view where a press would begin to label, if the pointer is on one.
    pub pixel: Option<Pixel>,
    /// What the worker was asked last; `None` where there is nothing to ask.
    asked: Option<Question>,
    /// What a click would win, if anything. While the pointer moves or the maps get better it is the newest that is known,
    /// of a place that the pointer has just left, so that the outline moves along and does not flicker.
    pub shown: Option<Arc<Preview>>,
}

/// A click, and the version of its frame's map that it would change.
#[derive(Clone, Debug, PartialEq)]
pub struct Question {
    /// The click.
    pub stroke: Stroke,
    /// The map.
    pub map: u64,
}

impl Hover {
    /// Takes over what there is to ask now; returns what the worker is to be asked, if it is something new.
    pub(crate) fn ask(&mut self, question: Option<Question>) -> Option<Stroke> {
        if question == self.asked {
            return None;
        }
        self.asked = question;
        let asked = self.asked.as_ref().map(|question| &question.stroke);
        let is_like = |shown: &Arc<Preview>| asked.is_some_and(|asked| same_but_place(asked, &shown.stroke));
        if !self.shown.as_ref().is_some_and(is_like) {
            self.shown = None;
        }
        asked.cloned()
    }

    /// Takes over an answer that is about the present labels; one to another kind of question came too late.
    pub(crate) fn take(&mut self, preview: Arc<Preview>) {
        let asked = self.asked.as_ref();
        if asked.is_some_and(|asked| same_but_place(&asked.stroke, &preview.stroke)) {
            self.shown = Some(preview).filter(|preview| !preview.won.is_empty());
        }
    }
}

/// Whether two clicks are the same but for their places on a frame.
fn same_but_place(a: &Stroke, b: &Stroke) -> bool {
    (a.frame, a.class, a.radius) == (b.frame, b.class, b.radius)
}
