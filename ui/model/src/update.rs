//! The one place where the state changes: commands of the person, and what session, project file and jobs tell.

mod audit;
mod classes;
mod comparison;
mod events;
mod files;
mod labels;
mod objects;
mod opening;
mod preferences;
mod strokes;
mod suggestions;
mod view;
mod work;

use std::sync::Arc;
use std::time::Instant;

use inplace_core::labels::{History, Stroke, VOID};
use inplace_core::project::{JournalEvent, Step};
use inplace_core::session::{Event, Session};

use crate::class_view::{Hidden, set};
use crate::command::Command;
use crate::dialogs::Dialog;
use crate::effect::Effect;
use crate::jobs::{Done, Job, JobTools};
use crate::model::{Model, Stage};
use crate::tool::{LARGEST_BRUSH, Tool, stepped_brush};
use crate::workspace::Workspace;

/// What the model is told.
#[derive(Debug)]
pub enum Input {
    /// A person asks for something.
    Command(Command),
    /// A job has come further, or has ended.
    Done(Done),
    /// A session for what is being opened has started.
    SessionStarted(Session),
    /// The worker told something.
    Session(Event),
    /// The project file's journal told something.
    Journal(JournalEvent),
    /// A frame of the window begins.
    FrameBegins {
        /// Now.
        now: Instant,
        /// Width and height of the window in points of the screen, unless it fills the screen.
        window: Option<[f32; 2]>,
    },
}

impl From<Command> for Input {
    fn from(command: Command) -> Self {
        Self::Command(command)
    }
}

impl Model {
    /// Takes something into account; returns what is to be done outside, in order.
    pub fn update(&mut self, input: impl Into<Input>) -> Vec<Effect> {
        match input.into() {
            Input::Command(command) => self.command(command),
            Input::Done(done) => self.job_done(done),
            Input::SessionStarted(session) => {
                if let Stage::Opening(opening) = &mut self.state.stage {
                    opening.session = Some(session);
                }
            }
            Input::Session(event) => self.session_event(event),
            Input::Journal(event) => self.journal_event(event),
            Input::FrameBegins { now, window } => self.frame_begins(now, window),
        }
        let settings = self.state.settings;
        self.with_workspace(|workspace| workspace.follow_hover(&settings));
        let asked = self.with_workspace(Workspace::take_outbox);
        self.effects.extend(asked.into_iter().map(Effect::Session));
        std::mem::take(&mut self.effects)
    }

    fn command(&mut self, command: Command) {
        let before = self.state.settings;
        if !matches!(
            command,
            Command::Render(_) | Command::Hover(_) | Command::SeeObjects(..)
        ) {
            self.with_workspace(|workspace| workspace.overview.log.acted(Instant::now()));
        }
        match command {
            Command::Open(target) => self.open(target),
            Command::Dropped(path) => self.dropped(path),
            Command::Save => self.save(),
            Command::SaveTo(path) => self.save_to(path, false),
            Command::ReplaceFile(path) => self.save_to(path, true),
            Command::Export(choice) => self.export(choice),
            Command::CancelExport => self.cancel_export(),
            Command::CancelImport => self.cancel_import(),
            Command::CompareWith(project) => self.compare_with(project),
            Command::CancelComparison => self.stop_beginning_comparison(),
            Command::EndComparison => self.end_comparison(),
            Command::ImportFrom(folder, trust) => self.import_from(folder, trust),
            Command::RemoveImported => self.edit(History::remove_imported),
            Command::ShowFolder(folder) => self.effects.push(Effect::ShowFolder(folder)),
            Command::Browse(purpose) => self.effects.push(Effect::Browse(purpose)),
            Command::Show(dialog) => self.show(dialog),
            Command::Edit(dialog) => self.edit_dialog(dialog),
            Command::CloseScene if self.loses_labels() => {}
            Command::CloseScene | Command::End => self.close(),
            Command::Quit => self.effects.push(Effect::CloseWindow),
            Command::CloseWindow => self.close_window(),
            Command::Dismiss(id) => self.state.messages.dismiss(id),
            Command::DismissExport => self.state.export = None,

            Command::Draw(line) => {
                self.leave_suggestions();
                self.draw(line);
            }
            Command::DrawObject(line) => {
                self.leave_suggestions();
                self.draw_object(line);
            }
            Command::SelectStroke(stroke) => self.with_workspace(|workspace| workspace.select(stroke)),
            Command::GoToStroke(stroke) => {
                self.leave_suggestions();
                self.with_workspace(|workspace| workspace.go_to_stroke(stroke));
            }
            Command::DeleteStroke(stroke) => self.delete_stroke(stroke),
            Command::DeleteSelected => self.delete_selected(),
            Command::ChangeStrokeClass(stroke, class) => self.change_stroke_class(stroke, class),
            Command::LabelOutlined => self.label_outlined(),
            Command::LabelSeen(frame, pixel, chosen) => {
                self.label_seen(Stroke::click(frame, VOID, pixel), chosen);
            }
            Command::ToggleChecked => {
                let frame = self.state.workspace().map(|workspace| workspace.frame_index);
                self.edit(|history| frame.map(|frame| history.toggle_checked(frame)));
            }
            Command::Undo => self.step(History::undo, Step::Undo),
            Command::Redo => self.step(History::redo, Step::Redo),

            Command::AddClass(purpose, name) => self.add_class(purpose, &name),
            Command::Choose(named) => self.choose(named),
            Command::ChooseSlot(slot) => self.choose_slot(slot),
            Command::Rename(named, name) => self.rename(named, name),
            Command::RecolorClass(id, color) => self.change_class(id, |class| class.color = color),
            Command::SayNewObject => drop(self.say_new_object()),
            Command::MergeObject(from, into) => self.merge_object(from, into),
            Command::GoToObject(object) => self.go_to_object(object),
            Command::SeeObjects(found, parts) => self.see_objects(found, parts),
            Command::UnfoldClass(class, unfolded) => {
                self.change_class_view(|view| set(&mut view.unfolded, class, unfolded));
            }
            Command::SetClassThing(id, thing) => self.change_class(id, |class| class.thing = thing),
            Command::Delete(named) => self.delete(named),
            Command::MergeClass(from, into) => self.merge_class(from, into),
            Command::AddClasses(classes) => self.add_classes(&classes),
            Command::MoveClass(id, place) => self.edit(|history| history.move_class(id, place)),
            Command::SetLocked(named, locked) => {
                self.change_class_view(|view| view.set_locked(named, locked));
            }
            Command::SetHidden(named, hidden) => {
                self.change_class_view(|view| view.set_hidden(named, hidden));
            }
            Command::ShowOnly(id, only) => self.show_only(id, only),
            Command::UnlockAll => self.change_class_view(|view| {
                view.locked.clear();
                view.locked_objects.clear();
            }),
            Command::ShowAll => self.change_class_view(|view| view.hidden = Hidden::default()),
            Command::FindClass(purpose) => self.find_class(purpose),
            Command::UseClass(purpose, class) => self.use_class(purpose, class),
            Command::ReadClasses(path) => self.read_classes(path),
            Command::SaveClassesTo(path) => self.save_classes_to(path),

            Command::GoToFrame(frame) => self.go_to(|_| Some(frame)),
            Command::StepFrame(step) => {
                self.go_to(|workspace| workspace.overview.frames.step(workspace.frame_index, step));
            }
            Command::FindFrame(text) => self.find_frame(&text),
            Command::FilterFrames(filter) => {
                self.with_workspace(|workspace| workspace.overview.frames.set_filter(filter));
            }
            Command::OrderFrames(order) => {
                self.with_workspace(|workspace| workspace.overview.frames.set_order(order));
            }
            Command::ShowSide(side) => self.state.side = side,
            Command::SwitchSide => self.state.side = self.state.side.other(),
            Command::GoToSuggestion(index) => self.go_to_suggestion(index),
            Command::NextSuggestion => self.step_suggestion(false),
            Command::PreviousSuggestion => self.step_suggestion(true),
            Command::AnswerSuggestion(index, label) => self.answer_suggestion(index, label),
            Command::AnswerNew => self.answer_new(),
            Command::AnswerLikely(rank) => self.answer_likely(rank),
            Command::SkipSuggestion => self.skip_suggestion(),
            Command::ListSkipped => self.with_workspace(|workspace| {
                workspace.suggestions.list_skipped();
            }),
            Command::LeaveSuggestions => self.leave_suggestions(),
            Command::DrawAudit(percent) => self.draw_audit(percent),
            Command::GoToAudited(index) => self.go_to_audited(index),
            Command::Judge(verdict) => self.judge(verdict),
            Command::LeaveAudit => self.leave_audit(),
            Command::HoldSuggestions(held) => {
                self.with_workspace(|workspace| workspace.suggestions.hold(held));
            }

            Command::ChooseLayer(layer) => self.state.settings.layer = layer,
            Command::CycleLayer => {
                self.state.settings.layer = self.state.settings.layer.next(self.state.is_compared());
            }
            Command::SetOpacity(opacity) => self.state.settings.opacity = opacity.clamp(0.0, 1.0),
            Command::SetOutlines(outlines) => self.state.settings.outlines = outlines,
            Command::SetLegend(legend) => self.state.settings.legend = legend,
            Command::SetPreview(preview) => self.state.settings.preview = preview,
            Command::ToggleCompare => self.state.settings.compare = !self.state.settings.compare,
            Command::ChooseOtherLayer(layer) => self.state.settings.other_layer = layer,
            Command::SetSplit(split) => self.state.settings.split = split.clamp(0.0, 1.0),
            Command::SetBrush(radius) => self.state.settings.brush = radius.min(LARGEST_BRUSH),
            Command::StepBrush(steps) => {
                self.state.settings.brush = stepped_brush(self.state.settings.brush, steps);
            }
            Command::ChooseTool(tool) => self.choose_tool(tool),
            Command::ToggleTool => self.choose_tool(match self.state.settings.tool {
                Tool::Erase => self.state.settings.labelling,
                _ => Tool::Erase,
            }),
            Command::Render(viewpoint) => self.with_workspace(|workspace| workspace.render(viewpoint)),
            Command::SetView(view) => self.with_workspace(|workspace| workspace.view = view),
            Command::Fit => self.with_workspace(Workspace::fit),
            Command::ToggleSpace => {
                self.with_workspace(|workspace| workspace.space.shown = !workspace.space.shown);
            }
            Command::SetSpace(mut space) => self.with_workspace(|workspace| {
                // Whoever asked for the frame meanwhile sees it.
                space.shown &= workspace.space.shown;
                workspace.space = space;
            }),
            Command::TogglePause => self.with_workspace(Workspace::toggle_pause),
            Command::Prefer(change) => self.prefer(change),
            Command::Hover(pixel) => self.with_workspace(|workspace| workspace.hover.pixel = pixel),
            Command::HideOverlay(hidden) => self.state.overlay_hidden = hidden,
        }
        let now = self.state.settings;
        if now != before {
            self.state.preferences.note_settings(before, now);
        }
    }

    /// Has work done on another thread; `broken` makes of a sentence what the work led to where it breaks off, so that
    /// nothing waits for it any more.
    pub(crate) fn start(
        &mut self,
        name: &'static str,
        broken: impl Fn(String) -> Done + Send + Sync + 'static,
        work: impl FnOnce(&JobTools, &(dyn Fn(Done) + Sync)) -> Done + Send + 'static,
    ) {
        let (broken, work) = (Arc::new(broken), Box::new(work));
        self.effects.push(Effect::Start(Job { name, broken, work }));
    }

    /// Does something with the open scene; nothing where there is none.
    pub(crate) fn with_workspace<Told: Default>(
        &mut self,
        change: impl FnOnce(&mut Workspace) -> Told,
    ) -> Told {
        self.state.workspace_mut().map(change).unwrap_or_default()
    }

    pub(crate) fn show(&mut self, mut dialog: Option<Dialog>) {
        let opens_anywhere = matches!(
            dialog,
            None | Some(Dialog::Open(_) | Dialog::Help | Dialog::Settings(_))
        );
        if !opens_anywhere && self.state.workspace().is_none() {
            return;
        }
        self.give_up_focus();
        match &mut dialog {
            Some(Dialog::SaveAs(path)) if path.is_empty() => *path = self.state.suggested_path(".inplace"),
            Some(Dialog::SaveClasses(path)) if path.is_empty() => {
                *path = self.state.suggested_path("-classes.json");
            }
            Some(Dialog::Export(choice)) if choice.path.is_empty() => {
                choice.clone_from(&self.state.export_choice);
                if choice.path.is_empty() {
                    choice.path = self.state.suggested_path("-labels");
                }
            }
            _ => {}
        }
        self.state.dialog = dialog;
    }

    /// Takes over what was typed or chosen in the dialog shown; it may have been closed meanwhile.
    fn edit_dialog(&mut self, edited: Dialog) {
        if let Some(dialog) = &mut self.state.dialog
            && std::mem::discriminant(dialog) == std::mem::discriminant(&edited)
        {
            *dialog = edited;
        }
    }

    /// So that the first field of a dialog can have the keyboard.
    fn give_up_focus(&mut self) {
        self.effects.push(Effect::GiveUpFocus);
    }
}
