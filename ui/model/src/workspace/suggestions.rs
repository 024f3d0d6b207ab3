//! Where to label next, and going from one such place to another.

use inplace_core::guide::Likely;
use inplace_core::labels::{ClassId, Edit, FoundObject, Label, ObjectId, Stroke, VOID};
use inplace_core::session::Phase;

use super::Workspace;
use crate::suggestions::Suggestions;
use crate::view::{ImagePart, View};

impl Workspace {
    /// Where to label next, and where the person is among these places.
    pub fn suggestions(&self) -> &Suggestions {
        &self.suggestions
    }

    /// Why no place is listed, and what to do.
    pub fn why_no_suggestion(&self) -> &'static str {
        if self.suggestions.skipped() > 0 {
            "All suggested places are skipped."
        } else if self.ended {
            "Training has stopped: there are no suggestions."
        } else if matches!(self.status.phase, Phase::Opening | Phase::FindingSurface) {
            "Suggestions come as soon as the surface of the scene is found; you can label meanwhile."
        } else {
            "Looking for the places that would settle most."
        }
    }

    /// Shows the place of a suggestion, as near as it takes to recognise it.
    pub fn show_suggestion(&mut self, index: usize) {
        let Some(place) = self.suggestions.listed.get(index) else {
            return;
        };
        let shown = self.scene.frames.get(place.frame).map(|frame| {
            let size = glam::vec2(frame.camera.width as f32, frame.camera.height as f32);
            (place.frame, ImagePart::around(size, place.pixel, &place.outline))
        });
        if let Some((frame, part)) = shown {
            self.go_to(frame);
            self.view = View::Part(part);
        }
    }

    /// What a likely class says of a place: the object that the nearest label says, while there is one that is not locked,
    /// or else the class alone.
    pub fn likely_label(&self, likely: &Likely) -> Label {
        let is_there = |id: &ObjectId| {
            let object = self.document.labels().object(*id);
            object.is_some_and(|object| object.class == likely.class) && !self.is_object_locked(*id)
        };
        Label::new(likely.class, likely.object.filter(is_there))
    }

    /// Labels the place of a suggestion, as this object of the class where there is one; `None` when it is not there, or was
    /// answered before.
    pub fn answer_suggestion(
        &mut self,
        index: usize,
        class: ClassId,
        object: Option<&FoundObject>,
    ) -> Option<Edit> {
        let place = self.suggestions.listed.get(index)?;
        let exists = class == VOID || self.document.labels().class(class).is_some();
        if !exists || self.suggestions.answer_of(index).is_some() {
            return None;
        }
        let click = Stroke::click(place.frame, class, place.pixel);
        let edit = self.edit(|history| match object {
            Some(object) => history.label_object(object, click),
            None => Some(history.add_stroke(click)),
        })?;
        let stroke = edit.strokes.last()?.id;
        self.suggestions.answered(index, class, stroke);
        Some(edit)
    }
}
