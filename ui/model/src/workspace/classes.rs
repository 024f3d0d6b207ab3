//! The current class, and the classes and objects that are locked or hidden.

use std::collections::BTreeMap;

use inplace_core::labels::{
    ClassId, Object, ObjectId, Pixel, Stroke, StrokeId, VOID, erase, pixels_of, rasterise,
};

use super::Workspace;
use crate::class_view::ClassView;
use crate::tool::DrawnLine;

impl Workspace {
    /// Makes a class current.
    pub fn choose_class(&mut self, class: ClassId) {
        if class == VOID || self.document.labels().class(class).is_some() {
            self.class = Some(class);
            self.said = None;
        }
    }

    /// Locks, hides and shows classes and objects.
    pub fn change_class_view(&mut self, change: impl FnOnce(&mut ClassView)) {
        change(&mut self.class_view);
        self.document.hide(&self.class_view.hidden);
    }

    /// Whether what is labelled as a class has to stay as it is.
    pub fn is_locked(&self, class: ClassId) -> bool {
        self.class_view.locked.contains(&class)
    }

    /// Whether what is labelled as an object has to stay as it is, whatever its class.
    pub fn is_object_locked(&self, object: ObjectId) -> bool {
        self.class_view.locked_objects.contains(&object)
    }

    /// Whether a class is left out of the overlay.
    pub fn is_hidden(&self, class: ClassId) -> bool {
        self.class_view.hidden.classes.contains(&class)
    }

    /// Whether a stroke is left out of the overlay: with its class, with its object, or beside another object.
    pub fn is_stroke_hidden(&self, id: StrokeId, stroke: &Stroke) -> bool {
        let hidden = &self.class_view.hidden;
        self.is_hidden(stroke.class)
            || match self.object_of_stroke(id, stroke) {
                Some(object) => hidden.has(object),
                None => hidden.all_but.is_some(),
            }
    }

    /// The name of the class or object whose lock keeps a stroke as it is.
    pub fn locked_by(&self, id: StrokeId, stroke: &Stroke) -> Option<&str> {
        if self.is_locked(stroke.class) {
            return Some(&self.document.labels().class(stroke.class)?.name);
        }
        if self.class_view.locked_objects.is_empty() {
            return None;
        }
        let object = self.object_of_stroke(id, stroke)?;
        self.is_object_locked(object)
            .then(|| self.name_of_object(object))?
    }

    /// Whether a line of this radius is refused: by a lock, or on a new object as its class has none. Without a class none
    /// is, as one is asked for.
    pub fn refuses(&self, line: &DrawnLine, radius: u32, on_new_object: bool) -> bool {
        let Some(class) = self.class else {
            return false;
        };
        let stroke = line.clone().into_stroke(self.frame_index, class, radius);
        if on_new_object {
            self.new_object(class).is_none() || self.lock_on_saying(&stroke, None).is_some()
        } else {
            self.lock_on(&stroke).is_some()
        }
    }

    /// Why a lock keeps a stroke from being drawn, a sentence; `None` where none does.
    pub fn lock_on(&self, stroke: &Stroke) -> Option<String> {
        self.lock_on_saying(stroke, self.said().filter(|said| said.class == stroke.class))
    }

    /// The same of a stroke that says this object, or its class alone.
    pub(crate) fn lock_on_saying(&self, stroke: &Stroke, said: Option<&Object>) -> Option<String> {
        let own = self.document.labels().class(stroke.class);
        let own = own
            .filter(|class| self.is_locked(class.id))
            .map(|class| &class.name);
        let said_locked = said.filter(|said| self.is_object_locked(said.id));
        if let Some(name) = own.or(said_locked.map(|said| &said.name)) {
            let sentence = format!("\"{name}\" is locked: unlock it in the class list to label with it.");
            return Some(sentence);
        }
        let name = self.locked_under(stroke, said.map(|said| said.id))?;
        Some(format!(
            "This would cover what is labelled \"{name}\", which is locked: unlock it, or draw beside it."
        ))
    }

    /// The name of the locked class or object that a stroke would cover which says `said`, if any.
    fn locked_under(&self, stroke: &Stroke, said: Option<ObjectId>) -> Option<&str> {
        let labels = self.document.labels();
        let camera = &self.scene.frames.get(stroke.frame)?.camera;
        let locked: BTreeMap<StrokeId, &str> = labels
            .strokes_of(stroke.frame)
            .filter(|(id, other)| {
                let object = self.object_of_stroke(*id, other);
                other.class != stroke.class || object.is_some_and(|object| Some(object) != said)
            })
            .filter_map(|(id, other)| Some((id, self.locked_by(id, other)?)))
            .collect();
        if locked.is_empty() {
            return None;
        }
        let drawn = rasterise(labels, stroke.frame, camera.width, camera.height);
        let covered = pixels_of(stroke, camera.width, camera.height);
        let at = |pixel| drawn.binary_search_by_key(pixel, |&(at, _)| at).ok();
        let mut strokes = covered.iter().filter_map(at).map(|at| drawn[at].1.1);
        strokes.find_map(|id| locked.get(&id).copied())
    }

    /// The name of the locked class or object whose strokes on the frame in view an eraser would have changed, if any.
    pub fn locked_under_eraser(&self, path: &[Pixel], radius: u32) -> Option<&str> {
        let labels = self.document.labels();
        let strokes = labels.strokes_of(self.frame_index);
        let locked = strokes.filter_map(|(id, stroke)| Some((stroke, self.locked_by(id, stroke)?)));
        let mut touched = locked.filter(|(stroke, _)| erase(stroke, path, radius).is_some());
        touched.next().map(|(_, name)| name)
    }
}
