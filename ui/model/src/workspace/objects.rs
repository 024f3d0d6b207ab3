//! The objects of the scene, and saying which of them the next strokes are on.

use inplace_core::labels::{ClassId, Edit, FoundObject, Object, ObjectId, Stroke, StrokeId, VOID};

use super::Workspace;

/// What strokes say: a class, and of a thing an object.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Chosen {
    /// The class; `None` before there is any.
    pub class: Option<ClassId>,
    /// The object, which may not be there yet.
    pub object: Option<FoundObject>,
}

impl Workspace {
    /// What strokes say now.
    pub fn chosen(&self) -> Chosen {
        Chosen {
            class: self.class,
            object: self.said.clone(),
        }
    }

    /// From now on, strokes say what was chosen before, if that is there and another; returns what to go back to.
    pub(crate) fn choose_again(&mut self, chosen: Chosen) -> Option<Chosen> {
        let before = self.chosen();
        let is_there = |&class: &ClassId| class == VOID || self.document.labels().class(class).is_some();
        if before == chosen || !chosen.class.as_ref().is_some_and(is_there) {
            return None;
        }
        self.class = chosen.class;
        self.say(chosen.object);
        Some(before)
    }

    /// The object that strokes of the current class say; one that is not there yet is added by the first of them.
    pub fn said(&self) -> Option<&Object> {
        let said = &self.said.as_ref()?.object;
        Some(self.document.labels().object(said.id).unwrap_or(said))
    }

    /// The objects of a class by their numbers, with where they are as far as the window has found them.
    pub fn objects_of(&self, class: ClassId) -> Vec<(&Object, Option<&FoundObject>)> {
        let labels = self.document.labels();
        let found = self.found.iter().map(|found| (&found.object, Some(found)));
        let parts = found.filter(|(object, _)| labels.object(object.id).is_none());
        let listed = labels.objects.iter().filter(|object| object.class == class);
        let listed = listed.map(|object| {
            let own = |found: &&FoundObject| found.object.id == object.id;
            (object, self.found.iter().find(own))
        });
        let parts = parts.filter(|(object, _)| object.class == class);
        let mut objects: Vec<_> = listed.chain(parts).collect();
        objects.sort_by_key(|(object, _)| object.id);
        objects
    }

    /// Whether no object of its class has a smaller number.
    pub fn is_first_of_class(&self, object: &Object) -> bool {
        let found = self.found.iter().map(|found| &found.object);
        let mut all = self.document.labels().objects.iter().chain(found);
        all.all(|other| other.class != object.class || other.id >= object.id)
    }

    /// What is known of an object; `None` of one that labels and maps do not have.
    pub(crate) fn object(&self, id: ObjectId) -> Option<FoundObject> {
        let found = self.found.iter().find(|found| found.object.id == id).cloned();
        match (self.document.labels().object(id).cloned(), found) {
            (Some(object), Some(found)) => Some(FoundObject { object, ..found }),
            (Some(object), None) => Some(object.into()),
            (None, found) => found,
        }
    }

    /// The object that a stroke says, or the part of the surface that it lies on as far as the window has found them.
    pub(super) fn object_of_stroke(&self, id: StrokeId, stroke: &Stroke) -> Option<ObjectId> {
        let lies_on = |found: &&FoundObject| found.strokes.contains(&id);
        let part = || self.found.iter().find(lies_on).map(|found| found.object.id);
        stroke.object.or_else(part)
    }

    /// The name of an object that labels or maps have.
    pub(super) fn name_of_object(&self, id: ObjectId) -> Option<&str> {
        let found = self.found.iter().map(|found| &found.object);
        let mut known = self.document.labels().objects.iter().chain(found);
        known
            .find(|object| object.id == id)
            .map(|object| object.name.as_str())
    }

    /// Whether the objects are listed, so that they have to be looked for.
    pub fn lists_objects(&self) -> bool {
        let unfolded = &self.class_view.unfolded;
        let mut classes = self.document.classes().iter();
        classes.any(|class| class.thing && unfolded.contains(&class.id))
    }

    /// From now on, strokes of the current class say a new object of it; returns a sentence where it can have none.
    pub(crate) fn say_new_object(&mut self) -> Option<String> {
        let is_class = |&id: &ClassId| self.document.labels().class(id).is_some();
        let Some(class) = self.class.filter(is_class) else {
            return Some("Choose the class of the object first.".to_owned());
        };
        self.said = self.new_object(class);
        self.said.is_none().then(|| self.why_no_object(class))
    }

    /// Why there can be no new object of a class, a sentence.
    pub(crate) fn why_no_object(&self, class: ClassId) -> String {
        match self.document.labels().class(class) {
            Some(class) if !class.thing => format!(
                "\"{}\" is stuff, which has no objects: its menu in the class list makes it a thing.",
                class.name
            ),
            _ => "All numbers that objects can have are taken.".to_owned(),
        }
    }

    /// From now on, strokes say this object.
    pub(crate) fn choose_object(&mut self, id: ObjectId) {
        if let Some(object) = self.object(id) {
            self.choose_class(object.object.class);
            self.said = Some(object);
        }
    }

    /// From now on, strokes of the current class say this object, or none.
    pub(crate) fn say(&mut self, said: Option<FoundObject>) {
        self.said = said;
        self.check_said();
    }

    /// Adds a stroke of the current class, which says the object that is being said.
    pub(crate) fn label(&mut self, stroke: Stroke) -> Option<Edit> {
        let Some(said) = self.said.clone().filter(|said| said.object.class == stroke.class) else {
            return self.edit(|history| Some(history.add_stroke(stroke)));
        };
        let listed = self.document.labels().object(said.object.id).is_some();
        let object = match said.click {
            // One that is not there yet; its number may have been given to a part of the surface meanwhile.
            None if !listed => self.new_object(stroke.class)?,
            _ => self.object(said.object.id).unwrap_or(said),
        };
        let edit = self.edit(|history| history.label_object(&object, stroke));
        if edit.is_some() {
            self.said = self.object(object.object.id);
        }
        edit
    }

    pub(crate) fn new_object(&self, class: ClassId) -> Option<FoundObject> {
        let found = self.found.iter().map(|found| &found.object);
        let parts = self.parts.iter().map(|part| &part.object);
        let others: Vec<Object> = found.chain(parts).cloned().collect();
        let object = self.document.history().next_object(class, &others)?;
        Some(object.into())
    }

    /// Ends saying an object that strokes of the current class cannot say any more.
    pub(super) fn check_said(&mut self) {
        let labels = self.document.labels();
        let class = self.class.and_then(|class| labels.class(class));
        let is_possible = |said: &Object| {
            let said = labels.object(said.id).unwrap_or(said);
            class.is_some_and(|class| class.thing && class.id == said.class)
        };
        if !self.said.as_ref().is_some_and(|said| is_possible(&said.object)) {
            self.said = None;
        }
    }
}
