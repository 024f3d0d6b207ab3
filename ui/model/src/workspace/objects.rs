//! Saying which object of its class the next strokes are on.

use inplace_core::labels::{Edit, Object, Stroke};

use super::Workspace;

impl Workspace {
    /// The object that strokes of the current class say; the first of them adds it.
    pub fn said(&self) -> Option<&Object> {
        self.said.as_ref()
    }

    /// From now on, strokes of the current class say a new object of it; returns a sentence where it can have none.
    pub(crate) fn say_new_object(&mut self) -> Option<String> {
        let labels = self.document.labels();
        let class = self.class.and_then(|class| labels.class(class));
        let Some(class) = class else {
            return Some("Choose the class of the object first.".to_owned());
        };
        self.said = self.document.history().next_object(class.id, &self.seen_objects);
        let sentence = match class.thing {
            false => format!(
                "\"{}\" is stuff, which has no objects: its menu in the class list makes it a thing.",
                class.name
            ),
            true => "All numbers that objects can have are taken.".to_owned(),
        };
        self.said.is_none().then_some(sentence)
    }

    /// Adds a stroke of the current class, which says the object that is being said.
    pub(crate) fn label(&mut self, stroke: Stroke) -> Option<Edit> {
        let Some(said) = self.said.clone().filter(|said| said.class == stroke.class) else {
            return self.edit(|history| Some(history.add_stroke(stroke)));
        };
        if self.document.labels().object(said.id).is_some() {
            let object = Some(said.id);
            return self.edit(|history| Some(history.add_stroke(Stroke { object, ..stroke })));
        }
        let others = std::mem::take(&mut self.seen_objects);
        let mut added = None;
        let edit = self.edit(|history| {
            let (id, edit) = history.add_object(stroke, &others)?;
            added = Some(id);
            Some(edit)
        });
        self.seen_objects = others;
        let labels = self.document.labels();
        self.said = added.and_then(|id| labels.object(id)).cloned();
        edit
    }

    /// Ends saying an object that strokes of the current class cannot say any more.
    pub(super) fn check_said(&mut self) {
        let labels = self.document.labels();
        let class = self.class.and_then(|class| labels.class(class));
        let is_possible = |said: &Object| {
            let said = labels.object(said.id).unwrap_or(said);
            class.is_some_and(|class| class.thing && class.id == said.class)
        };
        if !self.said.as_ref().is_some_and(is_possible) {
            self.said = None;
        }
    }
}
