//! The menu bar with the document's name and whether it is saved.

use egui::{Align, Button, Layout, Ui};

use crate::action::{Action, Actions};
use crate::canvas::{Layer, View};
use crate::dialogs::{Dialog, Purpose};
use crate::exporting::Progress;
use crate::keeper::SavedState;
use crate::state::AppState;
use crate::widgets::main_button;

/// Draws the menu bar.
pub fn show(ui: &mut Ui, state: &AppState, actions: &mut Actions) {
    egui::MenuBar::new().ui(ui, |ui| {
        ui.menu_button("File", |ui| file(ui, state, actions));
        ui.menu_button("Edit", |ui| edit(ui, state, actions));
        ui.menu_button("View", |ui| view(ui, state, actions));
        ui.menu_button("Help", |ui| {
            entry(
                ui,
                true,
                "Keys and gestures",
                "?",
                actions,
                Action::Show(Some(Dialog::Help)),
            );
        });
        if let Some(name) = state.document_name() {
            ui.separator();
            ui.add(egui::Label::new(egui::RichText::new(name).strong()).truncate());
            let (words, explanation) = saved_in_words(state);
            ui.weak(words).on_hover_text(explanation);
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            // The menu bar's own buttons have no frames; these do.
            ui.reset_style();
            if state.workspace().is_some() {
                export_button(ui, state, actions);
                if ui.button("Save").on_hover_text("Ctrl+S").clicked() {
                    actions.push(Action::Save);
                }
            }
        });
    });
}

fn export_button(ui: &mut Ui, state: &AppState, actions: &mut Actions) {
    if let Some(Progress::Writing(done, total)) = &state.export {
        let share = *done as f32 / (*total).max(1) as f32;
        let bar = egui::ProgressBar::new(share).text(format!("Exporting {done} of {total}"));
        ui.add(bar.desired_width(160.0));
    } else if main_button(ui, "Export").on_hover_text("Ctrl+E").clicked() {
        actions.push(Action::Show(Some(Dialog::export())));
    }
}

/// Whether the work is on the disk, in two words and in a sentence.
fn saved_in_words(state: &AppState) -> (&'static str, String) {
    let Some(keeper) = &state.keeper else {
        return ("", String::new());
    };
    let path = keeper.path().display();
    match (keeper.saved_state(), keeper.is_named()) {
        (SavedState::Saved, true) => ("saved", format!("Every edit is in {path}")),
        (SavedState::Saved, false) => (
            "autosaved",
            format!("Every edit is kept in {path}; save to give it a name of its own"),
        ),
        (SavedState::Writing, _) => ("saving", format!("Writing to {path}")),
        (SavedState::Failing, _) => (
            "not saved",
            format!("{path} cannot be written; your work is in memory, and writing is tried again"),
        ),
        (SavedState::MemoryOnly, _) => (
            "not saved",
            "There is no file to keep your work in: it is in memory only".to_owned(),
        ),
    }
}

fn file(ui: &mut Ui, state: &AppState, actions: &mut Actions) {
    let open = state.workspace().is_some();
    entry(
        ui,
        true,
        "Open...",
        "Ctrl+O",
        actions,
        Action::Show(Some(Dialog::open())),
    );
    entry(
        ui,
        true,
        "Open folder...",
        "",
        actions,
        Action::Browse(Purpose::Scene),
    );
    entry(
        ui,
        true,
        "Open project...",
        "",
        actions,
        Action::Browse(Purpose::Project),
    );
    ui.separator();
    entry(ui, open, "Save", "Ctrl+S", actions, Action::Save);
    let path = String::new();
    entry(
        ui,
        open,
        "Save as...",
        "",
        actions,
        Action::Show(Some(Dialog::SaveAs { path })),
    );
    entry(
        ui,
        open,
        "Export...",
        "Ctrl+E",
        actions,
        Action::Show(Some(Dialog::export())),
    );
    entry(
        ui,
        open,
        "Import labels...",
        "",
        actions,
        Action::Show(Some(Dialog::import())),
    );
    let labels = state.workspace().map(|workspace| workspace.document().labels());
    let imported = labels.is_some_and(|labels| labels.imported.is_some());
    entry(
        ui,
        imported,
        "Remove imported labels",
        "",
        actions,
        Action::RemoveImported,
    );
    ui.separator();
    entry(ui, open, "Close scene", "", actions, Action::CloseScene);
    entry(ui, true, "Quit", "", actions, Action::Quit);
}

fn edit(ui: &mut Ui, state: &AppState, actions: &mut Actions) {
    let history = state.workspace().map(|workspace| workspace.document().history());
    let named = |verb: &str, name: Option<&str>| match name {
        Some(name) => (true, format!("{verb} {name}")),
        None => (false, verb.to_owned()),
    };
    let (can_undo, undo) = named("Undo", history.and_then(|history| history.undo_name()));
    let (can_redo, redo) = named("Redo", history.and_then(|history| history.redo_name()));
    entry(ui, can_undo, &undo, "Ctrl+Z", actions, Action::Undo);
    entry(ui, can_redo, &redo, "Ctrl+Shift+Z", actions, Action::Redo);
}

fn view(ui: &mut Ui, state: &AppState, actions: &mut Actions) {
    for layer in Layer::ALL {
        let chosen = state.settings.layer == layer;
        if ui.radio(chosen, layer.name()).clicked() {
            actions.push(Action::ChooseLayer(layer));
            ui.close();
        }
    }
    let mut outlines = state.settings.outlines;
    if ui.checkbox(&mut outlines, "Borders between classes").changed() {
        actions.push(Action::SetOutlines(outlines));
    }
    ui.separator();
    let open = state.workspace().is_some();
    entry(ui, open, "Fit image", "F", actions, Action::SetView(View::FITTED));
    ui.separator();
    let current = ui.ctx().options(|options| options.theme_preference);
    for (preference, name) in [
        (egui::ThemePreference::Dark, "Dark theme"),
        (egui::ThemePreference::Light, "Light theme"),
        (egui::ThemePreference::System, "As the system"),
    ] {
        if ui.radio(current == preference, name).clicked() {
            actions.push(Action::SetTheme(preference));
            ui.close();
        }
    }
}

fn entry(ui: &mut Ui, enabled: bool, text: &str, keys: &str, actions: &mut Actions, action: Action) {
    let mut button = Button::new(text);
    if !keys.is_empty() {
        button = button.shortcut_text(keys);
    }
    if ui.add_enabled(enabled, button).clicked() {
        actions.push(action);
        ui.close();
    }
}
