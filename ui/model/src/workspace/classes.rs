//! The current class, and the classes that are locked or hidden.

use inplace_core::labels::{Class, ClassId, Pixel, Stroke, VOID, erase, pixels_of, rasterise};

use super::Workspace;
use crate::class_view::ClassView;

impl Workspace {
    /// Makes a class current.
    pub fn choose_class(&mut self, class: ClassId) {
        if class == VOID || self.document.labels().class(class).is_some() {
            self.class = Some(class);
            self.said = None;
        }
    }

    /// Locks, hides and shows classes.
    pub fn change_class_view(&mut self, change: impl FnOnce(&mut ClassView)) {
        change(&mut self.class_view);
        self.document.hide(&self.class_view.hidden);
    }

    /// Whether what is labelled as a class has to stay as it is.
    pub fn is_locked(&self, class: ClassId) -> bool {
        self.class_view.locked.contains(&class)
    }

    /// Whether a class is left out of the overlay.
    pub fn is_hidden(&self, class: ClassId) -> bool {
        self.class_view.hidden.contains(&class)
    }

    /// Why a lock keeps a stroke from being drawn, a sentence; `None` where none does.
    pub fn lock_on(&self, stroke: &Stroke) -> Option<String> {
        let own = self.document.labels().class(stroke.class);
        if let Some(Class { name, .. }) = own.filter(|class| self.is_locked(class.id)) {
            let sentence = format!("\"{name}\" is locked: unlock it in the class list to label with it.");
            return Some(sentence);
        }
        let Class { name, .. } = self.locked_under(stroke)?;
        Some(format!(
            "This would cover what is labelled \"{name}\", which is locked: unlock it, or draw beside it."
        ))
    }

    /// The locked class that a stroke would cover, if any.
    fn locked_under(&self, stroke: &Stroke) -> Option<&Class> {
        let labels = self.document.labels();
        let camera = &self.scene.frames.get(stroke.frame)?.camera;
        let mut others = labels.strokes_of(stroke.frame);
        if !others.any(|(_, other)| self.is_locked(other.class)) {
            return None;
        }
        let drawn = rasterise(labels, stroke.frame, camera.width, camera.height);
        let covered = pixels_of(stroke, camera.width, camera.height);
        let mut classes = covered.iter().filter_map(|pixel| drawn.get(pixel));
        let (class, _) = classes.find(|(class, _)| *class != stroke.class && self.is_locked(*class))?;
        labels.class(*class)
    }

    /// The locked class whose strokes on the frame in view an eraser would have changed, if any.
    pub fn locked_under_eraser(&self, path: &[Pixel], radius: u32) -> Option<&Class> {
        let labels = self.document.labels();
        let locked = labels
            .strokes_of(self.frame_index)
            .filter(|(_, stroke)| self.is_locked(stroke.class));
        let mut touched = locked.filter(|(_, stroke)| erase(stroke, path, radius).is_some());
        touched.next().and_then(|(_, stroke)| labels.class(stroke.class))
    }
}
