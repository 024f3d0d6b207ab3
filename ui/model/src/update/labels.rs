//! Actions that change the labels.

use std::sync::Arc;

use inplace_core::labels::{Class, ClassId, Edit, History, Pixel, Stroke, VOID};
use inplace_core::project::Step;

use crate::class_view::Named;
use crate::dialogs::Dialog;
use crate::effect::Effect;
use crate::model::Model;
use crate::tool::DrawnLine;
use crate::workspace::Workspace;

impl Model {
    /// Changes the labels and keeps the edit.
    pub(crate) fn edit(&mut self, change: impl FnOnce(&mut History) -> Option<Edit>) {
        let edit = self.with_workspace(|workspace| workspace.edit(change));
        self.keep(edit.map(Step::Do));
    }

    /// Adds a stroke of the current class and keeps the edit.
    fn label(&mut self, stroke: Stroke) {
        let edit = self.with_workspace(|workspace| workspace.label(stroke));
        self.keep(edit.map(Step::Do));
    }

    pub(crate) fn step(&mut self, change: fn(&mut History) -> Option<Edit>, step: Step) {
        let edit = self.with_workspace(|workspace| workspace.step_history(change));
        self.keep(edit.map(|_| step));
    }

    pub(crate) fn keep(&mut self, step: Option<Step>) {
        let Some(step) = step else {
            return;
        };
        let workspace = self.state.workspace();
        let history = workspace.map(|workspace| workspace.document.history());
        let brought = match (&step, history) {
            (Step::Do(edit), Some(history)) => history.brought_by(edit),
            _ => None,
        };
        let images = brought.map(|(id, images)| Step::Import(id, Arc::clone(images)));
        if let Some(project) = &mut self.state.project {
            let steps = images.into_iter().chain([step]);
            let steps = steps.filter_map(|step| project.remember(step));
            self.effects.extend(steps.map(Effect::Record));
        }
    }

    pub(crate) fn draw(&mut self, line: DrawnLine) {
        let radius = self.state.settings.brush;
        let Some(workspace) = self.state.workspace_mut() else {
            return;
        };
        let labelled = line.tool.labels();
        if labelled && workspace.class.is_none() {
            let waiting = line.into_stroke(workspace.frame_index, VOID, radius);
            self.ask_for_first_class(waiting);
            return;
        }
        if let Some(class) = workspace.class.filter(|_| labelled) {
            let stroke = line.clone().into_stroke(workspace.frame_index, class, radius);
            if self.lock_refuses(&stroke) {
                return;
            }
        } else {
            self.say_what_stays(&line, radius);
        }
        let Some(workspace) = self.state.workspace_mut() else {
            return;
        };
        let edit = workspace.draw(line, radius);
        self.keep(edit.map(Step::Do));
        if labelled {
            self.note_click();
        }
    }

    fn ask_for_first_class(&mut self, waiting: Stroke) {
        let name = String::new();
        self.state.dialog = Some(Dialog::FirstClass { name, waiting });
    }

    /// A click has just changed the labels.
    pub(crate) fn note_click(&mut self) {
        let Some(workspace) = self.state.workspace() else {
            return;
        };
        self.effects.push(Effect::Labelled {
            generation: workspace.document.generation(),
            frame: workspace.frame_index,
        });
    }

    pub(crate) fn add_class(&mut self, name: &str) {
        let waiting = match self.state.dialog.take() {
            Some(Dialog::FirstClass { waiting, .. }) => Some(waiting),
            other => {
                self.state.dialog = other;
                None
            }
        };
        let added = self.new_class(name);
        self.choose(Named::Class(added));
        if let Some(waiting) = waiting {
            let stroke = Stroke {
                class: added,
                object: None,
                ..waiting
            };
            self.edit(|history| Some(history.add_stroke(stroke)));
            self.note_click();
        }
    }

    /// Adds a class; returns its id.
    pub(crate) fn new_class(&mut self, name: &str) -> ClassId {
        let mut added = VOID;
        self.edit(|history| {
            let (id, edit) = history.add_class(name);
            added = id;
            Some(edit)
        });
        added
    }

    /// A class or an object is chosen to label with it.
    pub(crate) fn choose(&mut self, named: Named) {
        self.choose_tool(self.state.settings.labelling);
        self.with_workspace(|workspace| match named {
            Named::Class(class) => workspace.choose_class(class),
            Named::Object(object) => workspace.choose_object(object),
        });
    }

    pub(crate) fn choose_slot(&mut self, slot: usize) {
        match (self.class_of_slot(slot), self.stroke_to_change()) {
            (Some(class), Some(stroke)) => self.change_stroke_class(stroke, class),
            (Some(class), None) => self.choose(Named::Class(class)),
            (None, _) => {}
        }
    }

    /// The n-th class of the list; 0 is void.
    pub(crate) fn class_of_slot(&self, slot: usize) -> Option<ClassId> {
        let Some(index) = slot.checked_sub(1) else {
            return Some(VOID);
        };
        let classes = self.state.workspace()?.document.classes();
        classes.get(index).map(|class| class.id)
    }

    pub(crate) fn change_class(&mut self, id: ClassId, change: impl FnOnce(&mut Class)) {
        self.edit(|history| {
            let mut class = history.labels().class(id)?.clone();
            change(&mut class);
            history.change_class(class)
        });
    }

    /// Labels what is outlined at the pointer.
    pub(crate) fn label_outlined(&mut self) {
        let workspace = self.state.workspace();
        let Some(region) = workspace.and_then(Workspace::outlined) else {
            let sentence = "Nothing is outlined here: point at something that a click would win.";
            return self.state.messages.info(sentence);
        };
        if self.lock_refuses(&region) {
            return;
        }
        self.leave_suggestions();
        self.label(region);
        self.note_click();
    }

    /// A click of the current class on a frame that need not be in view; asks for the first class.
    pub(crate) fn label_seen(&mut self, frame: usize, pixel: Pixel) {
        let Some(workspace) = self.state.workspace() else {
            return;
        };
        let Some(class) = workspace.class else {
            self.ask_for_first_class(Stroke::click(frame, VOID, pixel));
            return;
        };
        let click = Stroke::click(frame, class, pixel);
        if !self.lock_refuses(&click) {
            self.label(click);
        }
    }
}
