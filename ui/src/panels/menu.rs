//! The menu bar with the document's name and whether it is saved.

use egui::{Align, Button, Layout, Ui};

use crate::action::{Action, Actions};
use crate::canvas::Layer;
use crate::dialogs::{Dialog, Purpose};
use crate::english;
use crate::english::{dialogs, layers, menu as words, saving, work};
use crate::exporting::Progress;
use crate::keeper::{Keeper, SavedState};
use crate::keymap::KeyMap;
use crate::keys;
use crate::preferences::{Change, Pane};
use crate::state::AppState;
use crate::widgets::main_button_enabled;

/// Below this width of what is left beside the menus, the Save button gives way: it is in the File menu.
const ROOMY: f32 = 360.0;
/// Height of the bar, of a menu's margins, and a little room at the lower end of the window.
const BELOW_THE_BAR: f32 = 72.0;
/// Room for the words about saving.
const STATE_WIDTH: f32 = 80.0;

/// Draws the menu bar.
pub fn show(ui: &mut Ui, state: &AppState, actions: &mut Actions) {
    egui::MenuBar::new().ui(ui, |ui| {
        ui.menu_button(words::FILE, |ui| scrolled(ui, |ui| file(ui, state, actions)));
        ui.menu_button(words::EDIT, |ui| edit(ui, state, actions));
        ui.menu_button(words::VIEW, |ui| scrolled(ui, |ui| view(ui, state, actions)));
        ui.menu_button(words::HELP, |ui| {
            entry(
                ui,
                true,
                dialogs::KEYS,
                "?",
                actions,
                Action::Show(Some(Dialog::Help)),
            );
        });
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let wide = ui.available_width() >= ROOMY;
            if state.workspace().is_some() {
                ui.scope(|ui| {
                    // The menu bar's own buttons have no frames; these do.
                    ui.reset_style();
                    export_button(ui, state, actions);
                    let keys = keys::text(&state.preferences.keys, "Ctrl+S");
                    if wide && ui.button(dialogs::SAVE).on_hover_text(keys).clicked() {
                        actions.push(Action::Save);
                    }
                });
            }
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| document(ui, state));
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
fn document(ui: &mut Ui, state: &AppState) {
    let Some(name) = state.document_name() else {
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
    if let Some(keeper) = &state.keeper {
        saved(ui, keeper);
    }
}

/// Whether the work is on the disk, in two words and in a sentence.
fn saved(ui: &mut Ui, keeper: &Keeper) {
    let (saved, named) = (keeper.saved_state(), keeper.is_named());
    let text = egui::RichText::new(saving::state(saved, named));
    let text = match saved {
        SavedState::Failing | SavedState::MemoryOnly => text.color(ui.visuals().warn_fg_color),
        SavedState::Saved | SavedState::Writing => text.weak(),
    };
    ui.add(egui::Label::new(text).truncate())
        .on_hover_text(saving::explanation(saved, named, keeper.path()));
}

fn export_button(ui: &mut Ui, state: &AppState, actions: &mut Actions) {
    let runs = matches!(state.export, Some(Progress::Writing(..)));
    let button = main_button_enabled(ui, !runs, words::EXPORT)
        .on_hover_text(keys::text(&state.preferences.keys, "Ctrl+E"));
    if button.on_disabled_hover_text(work::EXPORT_RUNS).clicked() {
        actions.push(Action::Show(Some(Dialog::export())));
    }
}

fn file(ui: &mut Ui, state: &AppState, actions: &mut Actions) {
    let open = state.workspace().is_some();
    entry(
        ui,
        true,
        words::OPEN,
        "Ctrl+O",
        actions,
        Action::Show(Some(Dialog::open())),
    );
    entry(
        ui,
        true,
        words::OPEN_FOLDER,
        "",
        actions,
        Action::Browse(Purpose::Scene),
    );
    entry(
        ui,
        true,
        words::OPEN_PROJECT,
        "",
        actions,
        Action::Browse(Purpose::Project),
    );
    ui.menu_button(english::start::OPEN_RECENT, |ui| recents(ui, state, actions));
    ui.separator();
    entry(ui, open, dialogs::SAVE, "Ctrl+S", actions, Action::Save);
    let path = String::new();
    entry(
        ui,
        open,
        words::SAVE_AS,
        "",
        actions,
        Action::Show(Some(Dialog::SaveAs { path })),
    );
    entry(
        ui,
        open,
        words::EXPORT,
        "Ctrl+E",
        actions,
        Action::Show(Some(Dialog::export())),
    );
    entry(
        ui,
        open,
        words::IMPORT,
        "",
        actions,
        Action::Show(Some(Dialog::import())),
    );
    let labels = state.workspace().map(|workspace| workspace.document().labels());
    let imported = labels.is_some_and(|labels| labels.imported.is_some());
    entry(
        ui,
        imported,
        words::REMOVE_IMPORTED,
        "",
        actions,
        Action::RemoveImported,
    );
    ui.separator();
    entry(
        ui,
        true,
        words::SETTINGS,
        "Ctrl+,",
        actions,
        Action::Show(Some(Dialog::settings())),
    );
    ui.separator();
    entry(ui, open, words::CLOSE_SCENE, "", actions, Action::CloseScene);
    entry(ui, true, words::QUIT, "", actions, Action::Quit);
}

fn recents(ui: &mut Ui, state: &AppState, actions: &mut Actions) {
    let recents = &state.preferences.recents;
    if recents.is_empty() {
        ui.weak(english::start::NO_RECENTS);
    }
    for recent in recents.iter() {
        let there = state.found.get(&recent.place).is_none_or(|found| found.there);
        let text = if there {
            recent.name.clone()
        } else {
            english::start::not_found(&recent.name)
        };
        let button = ui.add_enabled(there, Button::new(text).truncate());
        let path = recent.place.path().display().to_string();
        if button
            .on_hover_text(&path)
            .on_disabled_hover_text(&path)
            .clicked()
        {
            actions.push(recent.place.open());
            ui.close();
        }
    }
}

fn edit(ui: &mut Ui, state: &AppState, actions: &mut Actions) {
    let history = state.workspace().map(|workspace| workspace.document().history());
    let named = |verb: &str, name: Option<&str>| match name {
        Some(name) => (true, words::history(verb, name)),
        None => (false, verb.to_owned()),
    };
    let (can_undo, undo) = named(words::UNDO, history.and_then(|history| history.undo_name()));
    let (can_redo, redo) = named(words::REDO, history.and_then(|history| history.redo_name()));
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
    if ui.checkbox(&mut outlines, layers::BORDERS).changed() {
        actions.push(Action::SetOutlines(outlines));
    }
    let mut legend = state.settings.legend;
    if ui.checkbox(&mut legend, layers::LEGEND).changed() {
        actions.push(Action::SetLegend(legend));
    }
    let mut compare = state.settings.compare;
    if ui.checkbox(&mut compare, layers::COMPARE_IN_MENU).changed() {
        actions.push(Action::ToggleCompare);
    }
    ui.separator();
    let open = state.workspace().is_some();
    entry(ui, open, words::FIT, "F", actions, Action::Fit);
    entry(ui, open, words::SPACE, "V", actions, Action::ToggleSpace);
    ui.separator();
    let window = ui.ctx().content_rect().size();
    for pane in Pane::ALL {
        let mut shown = state.preferences.layout.shows(pane, window);
        if ui.checkbox(&mut shown, english::layout::pane(pane)).changed() {
            let usual = pane.fits(window) == shown;
            actions.push(Action::Prefer(Change::Pane(pane, (!usual).then_some(shown))));
        }
    }
    ui.separator();
    let current = ui.ctx().options(|options| options.theme_preference);
    for (preference, name) in [
        (egui::ThemePreference::Dark, words::DARK_THEME),
        (egui::ThemePreference::Light, words::LIGHT_THEME),
        (egui::ThemePreference::System, english::settings::AS_THE_SYSTEM),
    ] {
        if ui.radio(current == preference, name).clicked() {
            actions.push(Action::SetTheme(preference));
            ui.close();
        }
    }
}

/// An entry of a menu; `keys` is the default key of its action, and the present one is shown.
fn entry(ui: &mut Ui, enabled: bool, text: &str, keys: &str, actions: &mut Actions, action: Action) {
    let mut button = Button::new(text);
    if !keys.is_empty() {
        button = button.shortcut_text(keys::text(&KeyMap::of(ui.ctx()), keys));
    }
    if ui.add_enabled(enabled, button).clicked() {
        actions.push(action);
        ui.close();
    }
}
