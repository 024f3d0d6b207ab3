//! Where to label next, and going from one such place to another.

use inplace_core::guide::Suggestion;
use inplace_core::labels::{ClassId, Edit, Stroke, VOID};

use super::Workspace;
use crate::canvas::View;
use crate::guidance::Guidance;
use crate::surroundings::surroundings;

impl Workspace {
    /// Where to label next, best first.
    pub fn suggestions(&self) -> &[Suggestion] {
        self.guidance.listed()
    }

    /// The suggestion that the person is at.
    pub fn at_suggestion(&self) -> Option<usize> {
        self.guidance.at()
    }

    /// The suggestions and where the person is among them.
    pub fn guidance(&self) -> &Guidance {
        &self.guidance
    }

    /// The suggestions and where the person is among them.
    pub fn guidance_mut(&mut self) -> &mut Guidance {
        &mut self.guidance
    }

    /// Shows the place of a suggestion, as near as it takes to recognise it.
    pub fn show_suggestion(&mut self, index: usize) {
        let Some(place) = self.guidance.listed().get(index) else {
            return;
        };
        let shown = self.scene.frames.get(place.frame).map(|frame| {
            let size = egui::vec2(frame.camera.width as f32, frame.camera.height as f32);
            (place.frame, surroundings(size, place.pixel, &place.outline))
        });
        if let Some((frame, part)) = shown {
            self.go_to(frame);
            self.view = View::showing(part);
        }
    }

    /// Goes to a suggestion and shows it; returns whether it is there.
    pub fn go_to_suggestion(&mut self, index: usize) -> bool {
        let there = self.guidance.go_to(index);
        if there {
            self.show_suggestion(index);
        }
        there
    }

    /// Goes on to another suggestion and shows it; returns whether there is any.
    pub fn step_suggestion(&mut self, backwards: bool) -> bool {
        let next = self.guidance.step(backwards);
        if let Some(index) = next {
            self.show_suggestion(index);
        }
        next.is_some()
    }

    /// Labels the place of a suggestion; `None` when it is not there, or was answered before.
    pub fn answer_suggestion(&mut self, index: usize, class: ClassId) -> Option<Edit> {
        let place = self.guidance.listed().get(index)?;
        let exists = class == VOID || self.document.labels().class(class).is_some();
        if !exists || self.guidance.answer_of(index).is_some() {
            return None;
        }
        let click = Stroke::click(place.frame, class, place.pixel);
        let edit = self.edit(|history| Some(history.add_stroke(click)))?;
        let stroke = edit.strokes.last()?.id;
        self.guidance.answered(index, class, stroke);
        Some(edit)
    }
}
