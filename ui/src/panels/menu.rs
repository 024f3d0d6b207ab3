//! The menu bar with the document's name and whether it is saved.

use std::path::Path;

use egui::{Align, Button, Layout, Ui};
use inplace_model::dialogs::{Dialog, Purpose};
use inplace_model::exporting::ExportProgress;
use inplace_model::layer::Layer;
use inplace_model::preferences::{Pane, PreferenceChange, Theme};
use inplace_model::project_session::{ProjectSession, SavedState};
use inplace_model::text::PROGRAM;
use inplace_model::{Command, Commands, Model};

use super::parts::{self, Menu, not_found};
use crate::keys::table;
use crate::pictures::Pictures;
use crate::widgets::main_button_enabled;

/// Below this width of what is left beside the menus, the Save button gives way: it is in the File menu.
const ROOMY: f32 = 360.0;
/// Height of the bar, of a menu's margins, and a little room at the lower end of the window.
const BELOW_THE_BAR: f32 = 72.0;
/// Room for the words about saving.
const STATE_WIDTH: f32 = 80.0;

/// On the button while an export runs.
const EXPORT_RUNS: &str = "An export is under way: wait for its end, or cancel it.";

pub fn show(ui: &mut Ui, model: &Model, pictures: &Pictures, commands: &mut Commands) {
    egui::MenuBar::new().ui(ui, |ui| {
        ui.menu_button("File", |ui| {
            scrolled(ui, |ui| file(ui, model, pictures, commands));
        });
        ui.menu_button("Edit", |ui| edit(ui, model, commands));
        ui.menu_button("View", |ui| scrolled(ui, |ui| view(ui, model, commands)));
        ui.menu_button("Help", |ui| Menu { ui, commands }.keyed(true, &table::HELP));
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let wide = ui.available_width() >= ROOMY;
            if model.workspace().is_some() {
                ui.scope(|ui| {
                    // The menu bar's own buttons have no frames; these do.
                    ui.reset_style();
                    export_button(ui, model, commands);
                    let save = &table::SAVE;
                    let hint = save.named(ui.ctx());
                    if wide && ui.button(save.name).on_hover_text(hint).clicked() {
                        commands.push(save.command.clone());
                    }
                });
            }
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| document(ui, model));
        });
    });
}

/// A menu that scrolls where the window is too low for it.
fn scrolled(ui: &mut Ui, entries: impl FnOnce(&mut Ui)) {
    let room = (ui.ctx().content_rect().height() - BELOW_THE_BAR).max(96.0);
    egui::ScrollArea::vertical()
        .max_height(room)
        .min_scrolled_height(room)
        .show(ui, entries);
}

/// The name of what is open, cut to the room there is, and whether it is saved.
fn document(ui: &mut Ui, model: &Model) {
    let Some(name) = model.document_name() else {
        return;
    };
    ui.separator();
    let room = ui.available_width() - STATE_WIDTH;
    if room > 0.0 {
        ui.scope(|ui| {
            ui.set_max_width(room);
            ui.add(egui::Label::new(egui::RichText::new(name).strong()).truncate());
        });
    }
    if let Some(project) = &model.project {
        saved(ui, project);
    }
}

/// Whether the work is on the disk, in two words and in a sentence.
fn saved(ui: &mut Ui, project: &ProjectSession) {
    let (saved, named) = (project.saved_state(), project.named);
    let text = egui::RichText::new(state(saved, named));
    let text = match saved {
        SavedState::Failing | SavedState::MemoryOnly => text.color(ui.visuals().warn_fg_color),
        SavedState::Saved | SavedState::Writing => text.weak(),
    };
    ui.add(egui::Label::new(text).truncate())
        .on_hover_text(explanation(saved, named, &project.path));
}

fn export_button(ui: &mut Ui, model: &Model, commands: &mut Commands) {
    let runs = matches!(model.export, Some(ExportProgress::Writing(..)));
    let export = &table::EXPORT;
    let button = main_button_enabled(ui, !runs, export.name).on_hover_text(export.named(ui.ctx()));
    if button.on_disabled_hover_text(EXPORT_RUNS).clicked() {
        commands.push(export.command.clone());
    }
}

fn file(ui: &mut Ui, model: &Model, pictures: &Pictures, commands: &mut Commands) {
    let open = model.workspace().is_some();
    let mut menu = Menu { ui, commands };
    menu.keyed(true, &table::OPEN);
    menu.entry(true, "Open folder...", Command::Browse(Purpose::Scene));
    menu.entry(true, "Open project...", Command::Browse(Purpose::Project));
    menu.ui
        .menu_button("Open recent", |ui| recents(ui, model, pictures, menu.commands));
    menu.ui.separator();
    menu.keyed(open, &table::SAVE);
    let save_as = Dialog::SaveAs(String::new());
    menu.entry(open, "Save as...", Command::Show(Some(save_as)));
    menu.keyed(open, &table::EXPORT);
    menu.entry(open, "Import labels...", Command::Show(Some(Dialog::import())));
    let labels = model.workspace().map(|workspace| workspace.document.labels());
    let imported = labels.is_some_and(|labels| labels.imported.is_some());
    menu.entry(imported, "Remove imported labels", Command::RemoveImported);
    let compare = Dialog::Compare(String::new());
    menu.entry(open, "Compare with...", Command::Show(Some(compare)));
    menu.entry(model.is_compared(), "End comparison", Command::EndComparison);
    menu.ui.separator();
    menu.keyed(true, &table::SETTINGS);
    menu.ui.separator();
    menu.entry(open, "Close scene", Command::CloseScene);
    menu.entry(true, "Quit", Command::Quit);
}

fn recents(ui: &mut Ui, model: &Model, pictures: &Pictures, commands: &mut Commands) {
    let recents = &model.preferences.recents;
    if recents.is_empty() {
        ui.weak("Nothing was opened yet");
    }
    for recent in recents.iter() {
        let there = pictures.of(&recent.place).is_none_or(|found| found.there);
        let text = if there {
            recent.name.clone()
        } else {
            not_found(&recent.name)
        };
        let button = ui.add_enabled(there, Button::new(text).truncate());
        let path = recent.place.path().display().to_string();
        if button
            .on_hover_text(&path)
            .on_disabled_hover_text(&path)
            .clicked()
        {
            commands.push(Command::open_again(&recent.place));
            ui.close();
        }
    }
}

fn edit(ui: &mut Ui, model: &Model, commands: &mut Commands) {
    let history = model.workspace().map(|workspace| workspace.document.history());
    for (command, edit) in [
        (&table::UNDO, history.and_then(|history| history.undo_name())),
        (&table::REDO, history.and_then(|history| history.redo_name())),
    ] {
        let name = match edit {
            Some(edit) => format!("{} {edit}", command.name),
            None => command.name.to_owned(),
        };
        Menu { ui, commands }.keyed_as(edit.is_some(), command, &name);
    }
    ui.separator();
    Menu { ui, commands }.keyed(model.workspace().is_some(), &table::MARK_CHECKED);
}

fn view(ui: &mut Ui, model: &Model, commands: &mut Commands) {
    for layer in Layer::present(model.is_compared()) {
        let chosen = model.settings.layer == layer;
        if ui.radio(chosen, layer.name()).clicked() {
            commands.push(Command::ChooseLayer(layer));
            ui.close();
        }
    }
    let mut check = |mut on: bool, name: &str, command: Command| {
        if ui.checkbox(&mut on, name).changed() {
            commands.push(command);
        }
    };
    let (outlines, legend, preview) = (
        model.settings.outlines,
        model.settings.legend,
        model.settings.preview,
    );
    check(
        outlines,
        "Borders between classes",
        Command::SetOutlines(!outlines),
    );
    check(legend, "Legend", Command::SetLegend(!legend));
    check(preview, "What a click would win", Command::SetPreview(!preview));
    check(
        model.settings.compare,
        "Compare two layers",
        Command::ToggleCompare,
    );
    ui.separator();
    let open = model.workspace().is_some();
    let mut menu = Menu { ui, commands };
    menu.keyed(open, &table::FIT);
    menu.keyed(open, &table::SPACE);
    ui.separator();
    let window = ui.ctx().content_rect().size();
    for pane in Pane::ALL {
        let mut shown = model.preferences.layout.shows(pane, window);
        if ui.checkbox(&mut shown, pane.title()).changed() {
            commands.push(parts::shown(ui, pane, shown));
        }
    }
    ui.separator();
    for (theme, name) in [
        (Theme::Dark, "Dark theme"),
        (Theme::Light, "Light theme"),
        (Theme::System, "As the system"),
    ] {
        if ui.radio(model.preferences.theme == theme, name).clicked() {
            commands.push(Command::Prefer(PreferenceChange::Theme(theme)));
            ui.close();
        }
    }
}

/// In two words, beside the name of what is open.
fn state(state: SavedState, named: bool) -> &'static str {
    match (state, named) {
        (SavedState::Saved, true) => "saved",
        (SavedState::Saved, false) => "autosaved",
        (SavedState::Writing, _) => "saving",
        (SavedState::Failing | SavedState::MemoryOnly, _) => "not saved",
    }
}

/// The same in a sentence.
fn explanation(state: SavedState, named: bool, path: &Path) -> String {
    let path = path.display();
    match (state, named) {
        (SavedState::Saved, true) => format!("Every edit is in {path}"),
        (SavedState::Saved, false) => {
            format!("Every edit is kept in {path}; save to give it a name of its own")
        }
        (SavedState::Writing, _) => format!("Writing to {path}"),
        (SavedState::Failing, _) => {
            format!("{path} cannot be written; your work is in memory, and writing is tried again")
        }
        (SavedState::MemoryOnly, _) => {
            format!("{path} cannot be written, and your work is in memory only; save it somewhere else")
        }
    }
}

/// Title of the window; `state` is `None` while nothing is kept.
pub fn window_title(document: Option<&str>, state: Option<SavedState>) -> String {
    let mark = match state {
        None | Some(SavedState::Saved) => "",
        Some(SavedState::Writing) => " (saving)",
        Some(SavedState::Failing | SavedState::MemoryOnly) => " (not saved)",
    };
    match document {
        Some(name) => format!("{name}{mark} - {PROGRAM}"),
        None => PROGRAM.to_owned(),
    }
}
