//! Carrying out actions.

mod classes;
mod files;
mod guidance;
mod labels;
mod layers;
mod opening;
mod preferences;
mod strokes;
mod view;
mod view3d;
mod work;

use std::time::Instant;

use inplace_core::labels::History;
use inplace_core::project::Step;

use crate::action::Action;
use crate::app::App;
use crate::canvas::{Tool, stepped_brush};
use crate::class_view::ClassView;
use crate::dialogs::Dialog;
use crate::opening::Target;
use crate::state::LARGEST_BRUSH;
use crate::workspace::Workspace;

impl App {
    /// Carries out one action.
    pub(crate) fn apply(&mut self, action: Action) {
        self.with_workspace(|workspace| workspace.overview_mut().log_mut().acted(Instant::now()));
        match action {
            Action::OpenScene(source) => self.open(Target::Scene(source)),
            Action::OpenProject(path) => self.open(Target::Project(path)),
            Action::OpenPath(path) => self.open(Target::Path(path)),
            Action::OpenMoved(project, folder) => self.open(Target::Moved { project, folder }),
            Action::Save => self.save(),
            Action::SaveTo(path) => self.save_to(path),
            Action::Export(choice) => self.export(choice),
            Action::CancelExport => self.cancel_export(),
            Action::CancelImport => self.cancel_import(),
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

            Action::Draw(line) => {
                self.leave_suggestions();
                self.draw(line);
            }
            Action::SelectStroke(stroke) => self.with_workspace(|workspace| workspace.select(stroke)),
            Action::GoToStroke(stroke) => self.go_to_stroke(stroke),
            Action::DeleteStroke(stroke) => self.delete_stroke(stroke),
            Action::DeleteSelected => self.delete_selected(),
            Action::ChangeStrokeClass(stroke, class) => self.change_stroke_class(stroke, class),
            Action::LabelSeen { frame, pixel } => self.label_seen(frame, pixel),
            Action::Undo => self.step(History::undo, Step::Undo),
            Action::Redo => self.step(History::redo, Step::Redo),

            Action::AddClass(name) => self.add_class(&name),
            Action::ChooseClass(class) => self.choose_class(class),
            Action::ChooseSlot(slot) => self.choose_slot(slot),
            Action::RenameClass(id, name) => self.rename_class(id, name),
            Action::RecolorClass(id, color) => self.change_class(id, |class| class.color = color),
            Action::DeleteClass(id) => self.delete_class(id),
            Action::MergeClass(from, into) => self.merge_class(from, into),
            Action::AddClasses(classes) => self.add_classes(&classes),
            Action::MoveClass(id, place) => self.edit(|history| history.move_class(id, place)),
            Action::MoveClassBeside {
                class,
                neighbour,
                below,
            } => self.move_class_beside(class, neighbour, below),
            Action::SetClassLocked(id, locked) => self.change_class_view(|view| view.set_locked(id, locked)),
            Action::SetClassHidden(id, hidden) => self.change_class_view(|view| view.set_hidden(id, hidden)),
            Action::UnlockClasses => self.change_class_view(ClassView::unlock_all),
            Action::ShowClasses => self.change_class_view(ClassView::show_all),
            Action::FindClass(purpose) => self.find_class(purpose),
            Action::UseClass(purpose, class) => self.use_class(purpose, class),
            Action::UseNewClass(purpose, name) => self.use_new_class(purpose, &name),
            Action::ReadClasses(path) => self.read_classes(path),
            Action::SaveClassesTo(path) => self.save_classes_to(path),

            Action::GoToFrame(frame) => self.go_to(|_| Some(frame)),
            Action::StepFrame(step) => self.go_to(|workspace| workspace.stepped(step)),
            Action::FindFrame(text) => self.find_frame(&text),
            Action::FilterFrames(filter) => {
                self.with_workspace(|workspace| workspace.overview_mut().frames_mut().set_filter(filter));
            }
            Action::OrderFrames(order) => {
                self.with_workspace(|workspace| workspace.overview_mut().frames_mut().set_order(order));
            }
            Action::ShowSide(side) => self.state.side = side,
            Action::SwitchSide => self.state.side = self.state.side.other(),
            Action::GoToSuggestion(index) => self.go_to_suggestion(index),
            Action::NextSuggestion => self.step_suggestion(false),
            Action::PreviousSuggestion => self.step_suggestion(true),
            Action::AnswerSuggestion(index, class) => self.answer_suggestion(index, class),
            Action::AnswerLikely(rank) => self.answer_likely(rank),
            Action::AnswerSlot(slot) => self.answer_slot(slot),
            Action::SkipSuggestion => self.skip_suggestion(),
            Action::ListSkipped => self.with_workspace(|workspace| workspace.guidance_mut().list_skipped()),
            Action::LeaveSuggestions => self.leave_suggestions(),
            Action::HoldSuggestions(held) => {
                self.with_workspace(|workspace| workspace.guidance_mut().hold(held));
            }

            Action::ChooseLayer(layer) => self.state.settings.layer = layer,
            Action::CycleLayer => self.state.settings.layer = self.state.settings.layer.next(),
            Action::SetOpacity(opacity) => self.state.settings.opacity = opacity.clamp(0.0, 1.0),
            Action::SetOutlines(outlines) => self.state.settings.outlines = outlines,
            Action::SetLegend(legend) => self.state.settings.legend = legend,
            Action::ToggleCompare => self.state.settings.compare = !self.state.settings.compare,
            Action::ChooseOtherLayer(layer) => self.state.settings.other_layer = layer,
            Action::SetSplit(split) => self.state.settings.split = split.clamp(0.0, 1.0),
            Action::SetBrush(radius) => self.state.settings.brush = radius.min(LARGEST_BRUSH),
            Action::StepBrush(steps) => {
                self.state.settings.brush = stepped_brush(self.state.settings.brush, steps);
            }
            Action::ChooseTool(tool) => self.choose_tool(tool),
            Action::ToggleTool => self.choose_tool(match self.state.settings.tool {
                Tool::Erase => self.state.settings.labelling,
                _ => Tool::Erase,
            }),
            Action::SetView(view) => self.with_workspace(|workspace| workspace.view = view),
            Action::Fit => self.with_workspace(Workspace::fit),
            Action::ToggleSpace => {
                self.with_workspace(|workspace| workspace.space.shown = !workspace.space.shown);
            }
            Action::SetSpace(space) => self.with_workspace(|workspace| workspace.space = space),
            Action::TogglePause => self.with_workspace(Workspace::toggle_pause),
            Action::SetTheme(theme) => self.set_theme(theme),
            Action::Prefer(change) => self.prefer(change),
        }
    }

    pub(super) fn with_workspace(&mut self, change: impl FnOnce(&mut Workspace)) {
        if let Some(workspace) = self.state.workspace_mut() {
            change(workspace);
        }
    }

    pub(super) fn show(&mut self, dialog: Option<Dialog>) {
        let needs_scene = matches!(
            dialog,
            Some(
                Dialog::SaveAs { .. }
                    | Dialog::Export(_)
                    | Dialog::Import { .. }
                    | Dialog::AddClasses(_)
                    | Dialog::SaveClasses { .. }
            )
        );
        if needs_scene && self.state.workspace().is_none() {
            return;
        }
        self.give_up_focus();
        self.state.dialog = match dialog {
            Some(Dialog::SaveAs { path }) if path.is_empty() => Some(Dialog::SaveAs {
                path: self.state.suggested_path(".inplace"),
            }),
            Some(Dialog::Export(choice)) if choice.path.is_empty() => {
                let mut last = self.state.export_choice.clone();
                if last.path.is_empty() {
                    last.path = self.state.suggested_path("-labels");
                }
                Some(Dialog::Export(last))
            }
            Some(Dialog::SaveClasses { path }) if path.is_empty() => Some(Dialog::SaveClasses {
                path: self.state.suggested_path("-classes.json"),
            }),
            Some(Dialog::AddClasses(mut dialog)) => {
                dialog.begin(self.present_classes());
                Some(Dialog::AddClasses(dialog))
            }
            dialog => dialog,
        };
    }

    /// So that the first field of a dialog can have the keyboard.
    pub(super) fn give_up_focus(&self) {
        self.ctx.memory_mut(|memory| {
            if let Some(focused) = memory.focused() {
                memory.surrender_focus(focused);
            }
        });
    }
}
