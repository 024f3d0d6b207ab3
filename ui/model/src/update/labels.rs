//! Actions that change the labels.

use std::sync::Arc;

use inplace_core::labels::{Class, ClassId, Edit, History, Stroke, VOID};
use inplace_core::project::Step;

use crate::class_view::Named;
use crate::dialogs::{ClassUse, Dialog};
use crate::effect::Effect;
use crate::model::Model;
use crate::tool::{DrawnLine, Tool};
use crate::workspace::Chosen;

impl Model {
    /// Changes the labels and keeps the edit.
    pub(crate) fn edit(&mut self, change: impl FnOnce(&mut History) -> Option<Edit>) {
        let edit = self.with_workspace(|workspace| workspace.edit(change));
        self.keep(edit.map(Step::Do));
    }

    /// Adds a stroke, as one of the current class, and keeps the edit; `false` where a lock refuses it, or where it waits for
    /// the name of the first class.
    pub(crate) fn label(&mut self, mut stroke: Stroke) -> bool {
        let Some(workspace) = self.state.workspace() else {
            return false;
        };
        let Some(class) = workspace.class else {
            self.state.dialog = Some(Dialog::FirstClass {
                name: String::new(),
                waiting: stroke,
                new_object: false,
            });
            return false;
        };
        stroke.class = class;
        let locked = workspace.lock_on(&stroke);
        if self.refuse(locked) {
            return false;
        }
        let edit = self.with_workspace(|workspace| {
            workspace.selected = None;
            workspace.label(stroke)
        });
        self.keep(edit.map(Step::Do));
        true
    }

    /// Labels what was clicked in the 3D view as what was chosen then.
    pub(crate) fn label_seen(&mut self, click: Stroke, chosen: Chosen) {
        let now = self.with_workspace(|workspace| workspace.choose_again(chosen));
        self.label(click);
        if let Some(now) = now {
            self.with_workspace(|workspace| drop(workspace.choose_again(now)));
        }
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
            steps.for_each(|step| project.record(step));
        }
    }

    pub(crate) fn draw(&mut self, line: DrawnLine) {
        let radius = self.state.settings.brush;
        let Some(workspace) = self.state.workspace() else {
            return;
        };
        if line.tool.labels() {
            if self.label(line.into_stroke(workspace.frame_index, VOID, radius)) {
                self.note_click();
            }
        } else if line.tool == Tool::Erase {
            self.say_what_stays(&line, radius);
            let edit = self.with_workspace(|workspace| {
                workspace.selected = None;
                workspace.erase(&line.points, radius)
            });
            self.keep(edit.map(Step::Do));
        }
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

    /// Adds a class and does something with it; a stroke that waited for the first one becomes one of it.
    pub(crate) fn add_class(&mut self, purpose: ClassUse, name: &str) {
        let dialog = self.state.dialog.take();
        let mut added = VOID;
        self.edit(|history| {
            let (id, edit) = history.add_class(name);
            added = id;
            Some(edit)
        });
        self.use_class(purpose, added);
        if let Some(Dialog::FirstClass {
            waiting, new_object, ..
        }) = dialog
        {
            if new_object {
                // Stuff has none.
                self.with_workspace(|workspace| drop(workspace.say_new_object()));
            }
            if self.label(waiting) {
                self.note_click();
            }
            self.with_workspace(|workspace| workspace.say(None));
        }
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
        let Some(workspace) = self.state.workspace() else {
            return;
        };
        let class = match slot.checked_sub(1) {
            Some(index) => workspace.document.classes().get(index).map(|class| class.id),
            None => Some(VOID),
        };
        let selected = workspace.selected;
        match (
            class,
            selected.filter(|_| self.state.settings.tool == Tool::Select),
        ) {
            (None, _) => {}
            (Some(class), _) if workspace.suggestions().is_active() => self.answer_with(class),
            (Some(class), Some(stroke)) => self.change_stroke_class(stroke, class),
            (Some(class), None) => self.choose(Named::Class(class)),
        }
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
        let Some(workspace) = self.state.workspace() else {
            return;
        };
        let outlined = workspace.hover.shown.as_ref();
        let Some(region) = outlined.and_then(|preview| preview.filled()) else {
            let sentence = "Nothing is outlined here: point at something that a click would win.";
            return self.state.messages.info(sentence);
        };
        self.leave_suggestions();
        if self.label(region) {
            self.note_click();
        }
    }
}

#[cfg(test)]
mod tests {
    use inplace_core::guide::Suggestion;
    use inplace_core::labels::StrokeId;
    use inplace_core::scene::demo::Shot;

    use super::*;
    use crate::Command;
    use crate::model::{Stage, Start};
    use crate::preferences::Preferences;
    use crate::workspace::Workspace;

    /// Two frames and the classes wall and floor, of which floor is chosen.
    fn model() -> Model {
        let mut model = Model::new(Start::default(), Preferences::default());
        let workspace = Workspace::of_test(Shot::new(2, [16, 16]).scene(&|_, _| {}));
        model.state.stage = Stage::Open(Box::new(workspace));
        for name in ["wall", "floor"] {
            model.update(Command::AddClass(ClassUse::Choose, name.to_owned()));
        }
        model
    }

    #[test]
    fn what_was_clicked_in_3d_is_what_was_chosen_then() {
        let mut model = model();
        let floor = model.workspace().unwrap().chosen();
        let wall = Chosen {
            class: Some(1),
            object: None,
        };
        for chosen in [wall, floor.clone(), Chosen::default()] {
            model.update(Command::LabelSeen(1, [3, 3], chosen));
        }
        let workspace = model.workspace().unwrap();
        let strokes = workspace.document.labels().strokes.values();
        assert_eq!(strokes.map(|stroke| stroke.class).collect::<Vec<_>>(), [1, 2, 2]);
        assert_eq!(workspace.chosen(), floor);
    }

    #[test]
    fn whoever_is_led_to_another_frame_has_left_the_suggestions() {
        let place = Suggestion {
            frame: 1,
            pixel: [3, 3],
            position: [0.0; 3].into(),
            outline: Vec::new(),
            share: 0.1,
            classes: Vec::new(),
        };
        for lead in [Command::Undo, Command::GoToStroke(StrokeId(1))] {
            let mut model = model();
            model.update(Command::Draw(DrawnLine {
                tool: Tool::Brush,
                points: vec![[8, 8]],
            }));
            model.with_workspace(|workspace| {
                let newest = workspace.document.generation();
                workspace
                    .suggestions
                    .take_list(newest, vec![place.clone()], newest);
            });
            model.update(Command::NextSuggestion);
            let at = |model: &Model| {
                let workspace = model.workspace().unwrap();
                (workspace.frame_index, workspace.suggestions().at())
            };
            assert_eq!(at(&model), (1, Some(0)));
            model.update(lead);
            assert_eq!(at(&model), (0, None));
        }
    }
}
