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

    /// The first place that nothing was said of, in a frame and of a class that are there.
    pub fn next_audited(&self) -> Option<usize> {
        let places = &self.auditing.audit.as_ref()?.places;
        let is_there = |index: usize| {
            let class = self.document.labels().class(places[index].class);
            class.is_some() && self.audited_place(index).is_some()
        };
        (0..places.len()).find(|&index| places[index].verdict.is_none() && is_there(index))
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
        if let (Some(at), Some(audit)) = (self.auditing.at.take(), &mut self.auditing.audit)
            && let Some(place) = audit.places.get_mut(at)
        {
            place.verdict = Some(verdict);
        }
        self.next_audited().is_some_and(|next| self.show_audited(next))
    }
}

#[cfg(test)]
mod tests {
    use inplace_core::guide::audit::{AuditPlace, AuditedFrame};
    use inplace_core::scene::demo::Shot;

    use super::*;

    #[test]
    fn places_of_frames_and_classes_that_are_gone_are_passed_over() {
        let mut workspace = Workspace::of_test(Shot::new(2, [16, 16]).scene(&|_, _| {}));
        let stem = workspace.scene.frames[1].stem.clone();
        let frames = ["gone".to_owned(), stem].map(|stem| AuditedFrame {
            stem,
            labelled: 1,
            entropy: 0.0,
        });
        let mut class = 0;
        workspace.edit(|history| {
            let (id, edit) = history.add_class("wall");
            class = id;
            Some(edit)
        });
        let places = [(1, class), (0, class), (1, class + 1), (1, class)].map(|(frame, class)| AuditPlace {
            frame,
            pixel: [1, 1],
            class,
            verdict: None,
        });
        workspace.auditing.audit = Some(Audit {
            frames: frames.into(),
            entropy: 0.0,
            places: places.into(),
            edits: 0,
            seed: 0,
        });
        assert!(workspace.show_audited(0) && workspace.judge(Verdict::Right));
        assert_eq!(workspace.auditing.at, Some(3));
        assert!(!workspace.judge(Verdict::Wrong));
    }
}
