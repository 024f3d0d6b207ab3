//! Judging random places: the audit of the maps, and going from one of its places to another.

use inplace_core::guide::audit::{Audit, Verdict};
use inplace_core::labels::Pixel;

use super::Workspace;
use crate::view::{ImagePart, View};

/// The audit of a scene, and where the person is in it.
#[derive(Debug, Default)]
pub struct Auditing {
    /// The audit; `None` before one was drawn.
    pub audit: Option<Audit>,
    /// The place that keys judge.
    pub at: Option<usize>,
    /// Whether places are being drawn.
    pub is_drawing: bool,
}

impl Workspace {
    /// Frame and pixel of a place; `None` where the scene has no such frame any more.
    pub fn audited_place(&self, index: usize) -> Option<(usize, Pixel)> {
        let audit = self.auditing.audit.as_ref()?;
        let place = audit.places.get(index)?;
        let stem = &audit.frames.get(place.frame)?.stem;
        let frame = self.scene.frames.iter().position(|frame| frame.stem == *stem)?;
        Some((frame, place.pixel))
    }

    /// Shows a place, from now on the one that keys judge; whether it is there.
    pub(crate) fn show_audited(&mut self, index: usize) -> bool {
        let Some((frame, pixel)) = self.audited_place(index) else {
            return false;
        };
        self.go_to(frame);
        let camera = &self.scene.frames[frame].camera;
        let size = glam::vec2(camera.width as f32, camera.height as f32);
        self.view = View::Part(ImagePart::around(size, pixel, &[]));
        self.space.shown = false;
        self.suggestions.leave();
        self.auditing.at = Some(index);
        true
    }

    /// Says this of the place at hand and shows the next one; whether there is one.
    pub(crate) fn judge(&mut self, verdict: Verdict) -> bool {
        let at = self.auditing.at.take();
        let next = self.auditing.audit.as_mut().and_then(|audit| {
            audit.places.get_mut(at?)?.verdict = Some(verdict);
            audit.next()
        });
        next.is_some_and(|next| self.show_audited(next))
    }
}
