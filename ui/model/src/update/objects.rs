//! Actions on objects: saying, naming, merging and deleting them.

use std::sync::Arc;

use inplace_core::labels::{Edit, FoundObject, History, ObjectId};
use inplace_core::semantics::KnownPart;

use crate::dialogs::Dialog;
use crate::layer::Layer;
use crate::model::Model;
use crate::tool::DrawnLine;
use crate::workspace::Workspace;

impl Model {
    /// From now on, strokes of the current class say a new object of it; returns whether they do.
    pub(crate) fn say_new_object(&mut self) -> bool {
        let sentence = self.with_workspace(Workspace::say_new_object);
        !self.refuse(sentence)
    }

    /// Draws on a new object, and then goes on with what was said before.
    pub(crate) fn draw_object(&mut self, line: DrawnLine) {
        let Some(workspace) = self.state.workspace() else {
            return;
        };
        let (before, unnamed) = (workspace.chosen(), workspace.class.is_none());
        if unnamed || self.say_new_object() {
            self.draw(line);
        }
        if let Some(Dialog::FirstClass { new_object, .. }) = &mut self.state.dialog {
            *new_object = true;
        }
        self.with_workspace(|workspace| drop(workspace.choose_again(before)));
    }

    /// Takes over the objects that were found, and keeps those that no stroke names in the project, so that their numbers
    /// stay.
    pub(crate) fn see_objects(&mut self, found: Arc<[FoundObject]>, parts: Arc<[KnownPart]>) {
        let Some(workspace) = self.state.workspace_mut() else {
            return;
        };
        workspace.found = found;
        // Another object may get the number of one that is gone.
        let view = &workspace.class_view;
        let named = view.hidden.all_but.iter().chain(&view.hidden.objects);
        let named = named.chain(&view.locked_objects).copied();
        let gone: Vec<ObjectId> = named.filter(|&id| workspace.object(id).is_none()).collect();
        let is_gone = !gone.is_empty();
        if is_gone {
            workspace.change_class_view(|view| {
                view.hidden.all_but = view.hidden.all_but.filter(|id| !gone.contains(id));
                view.hidden.objects.retain(|id| !gone.contains(id));
                view.locked_objects.retain(|id| !gone.contains(id));
            });
        }
        if workspace.parts != parts || is_gone {
            workspace.parts = parts;
            self.keep_view();
        }
    }

    pub(crate) fn merge_object(&mut self, from: ObjectId, into: ObjectId) {
        let Some(target) = self.known_object(into) else {
            return;
        };
        let is_said = self.says(from);
        if self.locked_refuses_object(&target.object) {
            return;
        }
        let merged = self.change_object(from, |history, object| history.merge_object(object, &target));
        if merged && is_said {
            self.with_workspace(|workspace| workspace.choose_object(into));
        }
    }

    pub(super) fn delete_object(&mut self, id: ObjectId) {
        let is_said = self.says(id);
        if self.change_object(id, |history, _| history.delete_object(id)) && is_said {
            self.with_workspace(|workspace| workspace.say(None));
        }
    }

    /// Whether strokes of the current class say this object.
    fn says(&self, id: ObjectId) -> bool {
        let said = self.state.workspace().and_then(Workspace::said);
        said.is_some_and(|said| said.id == id)
    }

    /// Shows an object in the frame that has most of its pixels.
    pub(crate) fn go_to_object(&mut self, id: ObjectId) {
        let Some(object) = self.known_object(id) else {
            return;
        };
        let place = object
            .click
            .as_ref()
            .and_then(|click| Some((click.frame, click.first_point()?)));
        let Some((frame, pixel)) = place else {
            let sentence = format!("No frame shows \"{}\" yet.", object.object.name);
            return self.state.messages.info(sentence);
        };
        self.leave_suggestions();
        self.with_workspace(|workspace| {
            workspace.go_to(frame);
            workspace.view.center_on(pixel);
            workspace.space.shown = false;
        });
    }

    pub(crate) fn known_object(&self, id: ObjectId) -> Option<FoundObject> {
        self.state.workspace().and_then(|workspace| workspace.object(id))
    }

    /// Shows the layer of objects with this one alone, or again with all others.
    pub(crate) fn show_only(&mut self, id: ObjectId, only: bool) {
        if only {
            self.state.settings.layer = Layer::Objects;
        }
        self.change_class_view(|view| {
            view.hidden.all_but = only.then_some(id);
            view.hidden.objects.remove(&id);
        });
    }

    /// Changes an object unless it or its class is locked; returns whether anything changed.
    pub(super) fn change_object(
        &mut self,
        id: ObjectId,
        change: impl FnOnce(&mut History, &FoundObject) -> Option<Edit>,
    ) -> bool {
        let Some(object) = self.known_object(id) else {
            return false;
        };
        if self.locked_refuses_object(&object.object) {
            return false;
        }
        let mut changed = false;
        self.edit(|history| {
            let edit = change(history, &object);
            changed = edit.is_some();
            edit
        });
        changed
    }
}
