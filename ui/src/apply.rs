//! Carrying out actions.

use std::path::PathBuf;
use std::sync::Arc;

use inplace_core::labels::{ClassId, Edit, History, LabelImages, Stroke, Trust, VOID, read_label_images};
use inplace_core::project::Step;
use inplace_core::session::Command;

use crate::action::Action;
use crate::app::App;
use crate::canvas::{Line, Tool, stepped_brush};
use crate::dialogs::{Dialog, Purpose};
use crate::exporting::{Export, Progress};
use crate::jobs::Done;
use crate::keeper::SavedState;
use crate::opening::Target;
use crate::state::LARGEST_BRUSH;
use crate::workspace::Workspace;

impl App {
    /// Carries out one action.
    pub(crate) fn apply(&mut self, action: Action) {
        match action {
            Action::OpenScene(source) => self.open(Target::Scene(source)),
            Action::OpenProject(path) => self.open(Target::Project(path)),
            Action::OpenPath(path) => self.open(Target::Path(path)),
            Action::Save => self.save(),
            Action::SaveTo(path) => self.save_to(path),
            Action::ExportTo(folder) => self.export_to(folder),
            Action::ImportFrom(folder, trust) => self.import_from(folder, trust),
            Action::RemoveImported => self.edit(History::remove_imported),
            Action::ShowFolder(folder) => self.jobs.show_folder(folder),
            Action::Copy(text) => self.ctx.copy_text(text),
            Action::Browse(purpose) => self.jobs.browse(purpose),
            Action::Show(dialog) => self.show(dialog),
            Action::CloseScene => self.close(),
            Action::Quit => self.ctx.send_viewport_cmd(egui::ViewportCommand::Close),
            Action::Dismiss(id) => self.state.toasts.dismiss(id),
            Action::DismissExport => self.state.export = None,

            Action::Draw(line) => self.draw(line),
            Action::LabelAt { frame, pixel, class } => {
                self.with_workspace(|workspace| {
                    workspace.choose_class(class);
                    workspace.go_to_place(frame, pixel);
                });
                self.edit(|history| Some(history.add_stroke(Stroke::click(frame, class, pixel))));
                self.note_click();
            }
            Action::Undo => self.step(History::undo, Step::Undo),
            Action::Redo => self.step(History::redo, Step::Redo),

            Action::AddClass(name) => self.add_class(&name),
            Action::ChooseClass(class) => self.choose_class(class),
            Action::ChooseSlot(slot) => self.choose_slot(slot),
            Action::RenameClass(id, name) => self.change_class(id, |class| class.name = name),
            Action::RecolorClass(id, color) => self.change_class(id, |class| class.color = color),
            Action::DeleteClass(id) => self.edit(|history| history.delete_class(id)),
            Action::MergeClass(from, into) => self.edit(|history| history.merge_class(from, into)),

            Action::GoToFrame(frame) => self.go_to(|_| Some(frame)),
            Action::StepFrame(step) => {
                self.go_to(|workspace| workspace.frame_index().checked_add_signed(step));
            }
            Action::GoToSuggestion(index) => {
                self.with_workspace(|workspace| workspace.go_to_suggestion(index));
                self.looked_away();
            }
            Action::NextSuggestion => self.next_suggestion(),

            Action::ChooseLayer(layer) => self.state.settings.layer = layer,
            Action::CycleLayer => self.state.settings.layer = self.state.settings.layer.next(),
            Action::SetOpacity(opacity) => self.state.settings.opacity = opacity.clamp(0.0, 1.0),
            Action::SetOutlines(outlines) => self.state.settings.outlines = outlines,
            Action::SetBrush(radius) => self.state.settings.brush = radius.min(LARGEST_BRUSH),
            Action::StepBrush(steps) => {
                self.state.settings.brush = stepped_brush(self.state.settings.brush, steps);
            }
            Action::ChooseTool(tool) => self.state.settings.tool = tool,
            Action::ToggleTool => {
                self.state.settings.tool = match self.state.settings.tool {
                    Tool::Label => Tool::Erase,
                    Tool::Erase => Tool::Label,
                };
            }
            Action::SetView(view) => self.with_workspace(|workspace| workspace.view = view),
            Action::TogglePause => self.with_workspace(Workspace::toggle_pause),
            Action::SetTheme(preference) => self.ctx.set_theme(preference),
        }
    }

    fn with_workspace(&mut self, change: impl FnOnce(&mut Workspace)) {
        if let Some(workspace) = self.state.workspace_mut() {
            change(workspace);
        }
    }

    /// Changes the labels and keeps the edit.
    fn edit(&mut self, change: impl FnOnce(&mut History) -> Option<Edit>) {
        let edit = self
            .state
            .workspace_mut()
            .and_then(|workspace| workspace.edit(change));
        self.keep(edit.map(Step::Do));
    }

    fn step(&mut self, change: fn(&mut History) -> Option<Edit>, step: Step) {
        let edit = self
            .state
            .workspace_mut()
            .and_then(|workspace| workspace.step_history(change));
        self.keep(edit.map(|_| step));
    }

    fn keep(&mut self, step: Option<Step>) {
        let Some(step) = step else {
            return;
        };
        let history = self
            .state
            .workspace()
            .map(|workspace| workspace.document().history());
        let brought = match (&step, history) {
            (Step::Do(edit), Some(history)) => history.brought_by(edit),
            _ => None,
        };
        let images = brought.map(|(id, images)| Step::Import(id, Arc::clone(images)));
        if let Some(keeper) = &mut self.state.keeper {
            images
                .into_iter()
                .chain([step])
                .for_each(|step| keeper.record(step));
        }
    }

    fn draw(&mut self, line: Line) {
        let radius = self.state.settings.brush;
        let Some(workspace) = self.state.workspace_mut() else {
            return;
        };
        if line.tool == Tool::Label && workspace.class().is_none() {
            let waiting = Stroke {
                frame: workspace.frame_index(),
                class: VOID,
                radius,
                lines: vec![line.points],
            };
            let name = String::new();
            self.state.dialog = Some(Dialog::FirstClass { name, waiting });
            return;
        }
        let labelled = line.tool == Tool::Label;
        let edit = workspace.draw(line, radius);
        self.keep(edit.map(Step::Do));
        if labelled {
            self.note_click();
        }
    }

    /// Starts waiting for the overlay of the click that just changed the labels.
    fn note_click(&mut self) {
        let Some(workspace) = self.state.workspace() else {
            return;
        };
        let (generation, frame) = (workspace.document().generation(), workspace.frame_index());
        if let Some(stats) = &mut self.state.stats {
            stats.clicked(generation, frame);
        }
    }

    fn looked_away(&mut self) {
        if let Some(stats) = &mut self.state.stats {
            stats.looked_away();
        }
    }

    fn add_class(&mut self, name: &str) {
        let waiting = match self.state.dialog.take() {
            Some(Dialog::FirstClass { waiting, .. }) => Some(waiting),
            other => {
                self.state.dialog = other;
                None
            }
        };
        let mut added = VOID;
        self.edit(|history| {
            let (id, edit) = history.add_class(name);
            added = id;
            Some(edit)
        });
        self.choose_class(added);
        if let Some(waiting) = waiting {
            let stroke = Stroke {
                class: added,
                ..waiting
            };
            self.edit(|history| Some(history.add_stroke(stroke)));
            self.note_click();
        }
    }

    /// A class is chosen to label with it.
    fn choose_class(&mut self, class: ClassId) {
        self.state.settings.tool = Tool::Label;
        self.with_workspace(|workspace| workspace.choose_class(class));
    }

    fn choose_slot(&mut self, slot: usize) {
        let class = self.state.workspace().and_then(|workspace| {
            let Some(index) = slot.checked_sub(1) else {
                return Some(VOID);
            };
            workspace.document().classes().get(index).map(|class| class.id)
        });
        if let Some(class) = class {
            self.choose_class(class);
        }
    }

    fn change_class(&mut self, id: ClassId, change: impl FnOnce(&mut inplace_core::labels::Class)) {
        self.edit(|history| {
            let mut class = history.labels().class(id)?.clone();
            change(&mut class);
            history.change_class(class)
        });
    }

    fn go_to(&mut self, frame: impl FnOnce(&Workspace) -> Option<usize>) {
        let mut moved = false;
        self.with_workspace(|workspace| {
            if let Some(frame) = frame(workspace) {
                moved = workspace.go_to(frame);
            }
        });
        if moved {
            self.looked_away();
        }
    }

    fn next_suggestion(&mut self) {
        let Some(workspace) = self.state.workspace_mut() else {
            return;
        };
        if workspace.go_to_next_suggestion() {
            self.looked_away();
        } else {
            self.state
                .toasts
                .info("There are no suggestions yet: label something first.");
        }
    }

    fn show(&mut self, dialog: Option<Dialog>) {
        let needs_scene = matches!(
            dialog,
            Some(Dialog::SaveAs { .. } | Dialog::Export { .. } | Dialog::Import { .. })
        );
        if needs_scene && self.state.workspace().is_none() {
            return;
        }
        self.give_up_focus();
        self.state.dialog = match dialog {
            Some(Dialog::SaveAs { path }) if path.is_empty() => Some(Dialog::SaveAs {
                path: self.state.suggested_path(".inplace"),
            }),
            Some(Dialog::Export { path }) if path.is_empty() => {
                let out = self.state.out.as_ref().map(|out| out.display().to_string());
                Some(Dialog::Export {
                    path: out.unwrap_or_else(|| self.state.suggested_path("-labels")),
                })
            }
            dialog => dialog,
        };
    }

    /// So that the first field of a dialog can have the keyboard.
    fn give_up_focus(&self) {
        self.ctx.memory_mut(|memory| {
            if let Some(focused) = memory.focused() {
                memory.surrender_focus(focused);
            }
        });
    }

    /// The system's dialog was answered. Without an answer the path fields are the way.
    pub(crate) fn picked(&mut self, purpose: Purpose, path: Option<PathBuf>) {
        let Some(path) = path else {
            return;
        };
        match (&mut self.state.dialog, purpose) {
            (Some(dialog @ (Dialog::SaveAs { .. } | Dialog::Export { .. } | Dialog::Import { .. })), _) => {
                dialog.take_path(&path);
            }
            (_, Purpose::Scene) => {
                self.open(Target::Scene(inplace_core::scene::SceneSource::Folder(path)));
            }
            (_, Purpose::Project) => self.open(Target::Project(path)),
            (_, Purpose::SaveAs | Purpose::Export | Purpose::Import) => {}
        }
    }

    fn save(&mut self) {
        let (Some(workspace), Some(keeper)) = (self.state.workspace(), &self.state.keeper) else {
            return;
        };
        if !keeper.is_named() {
            self.show(Some(Dialog::SaveAs { path: String::new() }));
            return;
        }
        workspace.session().send(Command::Save);
        let path = keeper.path().display().to_string();
        let failing = keeper.saved_state() == SavedState::Failing;
        self.keep_results();
        if failing {
            self.state.toasts.error(format!(
                "{path} still cannot be written; save under another name with \"Save as\"."
            ));
        } else {
            self.state.toasts.info(format!("Saved to {path}"));
        }
    }

    fn save_to(&mut self, path: PathBuf) {
        self.state.dialog = None;
        let (Some(workspace), Some(keeper)) = (self.state.workspace(), &self.state.keeper) else {
            return;
        };
        workspace.session().send(Command::Save);
        if !keeper.save_to(path.clone()) {
            self.write_new_project(path);
        }
    }

    /// There was no file to keep the work in so far: make one.
    fn write_new_project(&mut self, path: PathBuf) {
        if let Some(keeper) = &mut self.state.keeper {
            keeper.begin_snapshot();
        }
        let Some(workspace) = self.state.workspace() else {
            return;
        };
        let (scene, history) = (
            Arc::clone(workspace.scene()),
            workspace.document().history().clone(),
        );
        let (open, ctx, serial) = (self.state.read, self.ctx.clone(), workspace.serial());
        self.jobs.spawn("save", move |tell| {
            let wake = move || ctx.request_repaint();
            tell(
                match crate::opening::new_project(path, &scene, open, history, wake) {
                    Ok(keeper) => Done::Kept(serial, Box::new(keeper)),
                    Err(sentence) => Done::Failed(sentence),
                },
            );
        });
    }

    fn import_from(&mut self, folder: PathBuf, trust: Trust) {
        self.state.dialog = None;
        let Some(workspace) = self.state.workspace() else {
            return;
        };
        let (scene, serial) = (Arc::clone(workspace.scene()), workspace.serial());
        self.jobs.spawn("import", move |tell| {
            tell(match read_label_images(&folder, &scene, trust) {
                Ok(images) => Done::Imported(serial, Box::new(images)),
                Err(error) => Done::Failed(error.to_string()),
            });
        });
    }

    /// Label images were read.
    pub(crate) fn imported(&mut self, serial: u64, images: LabelImages) {
        if self
            .state
            .workspace()
            .is_none_or(|workspace| workspace.serial() != serial)
        {
            return;
        }
        let (count, unmatched) = (images.labels.maps.len(), images.unmatched);
        self.edit(|history| Some(history.import(images)));
        let plural = if count == 1 { "" } else { "s" };
        let mut sentence = format!("Imported {count} label image{plural}.");
        if unmatched > 0 {
            sentence += &format!(" Left out, because they are named like no frame: {unmatched}.");
        }
        self.state.toasts.info(sentence);
    }

    fn export_to(&mut self, folder: PathBuf) {
        self.state.dialog = None;
        let Some(workspace) = self.state.workspace() else {
            return;
        };
        let Some(maps) = workspace.session().maps().cloned() else {
            return;
        };
        let export = Export {
            scene: Arc::clone(workspace.scene()),
            labels: workspace.document().labels().clone(),
            generation: workspace.document().generation(),
            maps,
        };
        self.state.export = Some(Progress::Writing(0, workspace.scene().frames.len()));
        self.jobs.spawn("export", move |tell| {
            export.run(&folder, &|progress| tell(Done::Exported(progress)));
        });
    }
}
