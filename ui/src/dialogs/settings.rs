//! What a person can choose once for all scenes: looks, threads, keys, hints.

use egui::{Align, ComboBox, Event, Key, Layout, RichText, ScrollArea, Slider, ThemePreference, Ui};

use crate::action::{Action, Actions};
use crate::dialogs::{at_the_end, room};
use crate::english::settings as words;
use crate::keymap::{KeyMap, Shortcut};
use crate::keys::{self, Row};
use crate::preferences::Change;
use crate::state::AppState;
use crate::theme;

/// The scales to choose from, in percent.
const SCALES: [u16; 7] = [100, 125, 150, 175, 200, 250, 300];

/// The settings, with the key that is being chosen.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SettingsPage {
    choosing: Option<Choosing>,
}

/// A key being chosen.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Choosing {
    /// What it does is what this key does by default.
    default: Shortcut,
    /// What was pressed, where it cannot simply be taken.
    taken: Option<Taken>,
}

/// A key that does something else.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Taken {
    /// It cannot be chosen at all.
    Fixed(Shortcut),
    /// It does something that can do without it.
    By {
        pressed: Shortcut,
        does: &'static str,
        default: Shortcut,
    },
}

impl SettingsPage {
    /// The settings as they are opened.
    pub const fn new() -> Self {
        Self { choosing: None }
    }

    /// Takes the key that is being waited for; before anything else looks at the keys.
    pub(super) fn listen(&mut self, ctx: &egui::Context, actions: &mut Actions) {
        let Some(choosing) = &mut self.choosing else {
            return;
        };
        if choosing.taken.is_some() || ctx.current_pass_index() > 0 {
            return;
        }
        let mut pressed = None;
        ctx.input_mut(|input| {
            input.events.retain(|event| match event {
                Event::Key {
                    key,
                    pressed: true,
                    modifiers,
                    ..
                } => {
                    pressed = pressed.or(Some(Shortcut::new(*modifiers, *key)));
                    false
                }
                Event::Text(_) | Event::Cut | Event::Copy | Event::Paste(_) => false,
                _ => true,
            });
        });
        let Some(pressed) = pressed else {
            return;
        };
        if pressed.key == Key::Escape {
            self.choosing = None;
            return;
        }
        let default = choosing.default;
        match keys::meaning(&KeyMap::of(ctx), pressed) {
            _ if pressed.is_fixed() => choosing.taken = Some(Taken::Fixed(pressed)),
            Some((does, other)) if other != default => {
                choosing.taken = Some(Taken::By {
                    pressed,
                    does,
                    default: other,
                });
            }
            _ => {
                actions.push(Action::Prefer(Change::Key(default, Some(pressed))));
                self.choosing = None;
            }
        }
    }

    /// Draws the settings.
    pub(super) fn show(&mut self, ui: &mut Ui, state: &AppState, actions: &mut Actions) {
        ScrollArea::vertical()
            .auto_shrink([false, true])
            .max_height(room(ui.ctx()))
            .show(ui, |ui| {
                // Room for the scroll bar.
                ui.set_max_width(ui.available_width() - 12.0);
                section(ui, words::APPEARANCE);
                appearance(ui, state, actions);
                section(ui, words::TRAINING);
                training(ui, state, actions);
                section(ui, words::HINTS);
                hints(ui, state, actions);
                section(ui, words::KEYS);
                self.keys(ui, state, actions);
            });
        ui.add_space(8.0);
        at_the_end(ui, |ui| {
            if ui.button(crate::english::dialogs::CLOSE).clicked() {
                actions.push(Action::Show(None));
            }
        });
    }

    fn keys(&mut self, ui: &mut Ui, state: &AppState, actions: &mut Actions) {
        ui.weak(words::KEYS_EXPLANATION);
        let map = &state.preferences.keys;
        for row in keys::TABLE {
            if row.choices().next().is_some() {
                ui.push_id(row.words.does, |ui| self.key_row(ui, row, map, actions));
            }
        }
        let reset = ui.add_enabled(!map.is_default(), egui::Button::new(words::RESET_KEYS));
        if reset.clicked() {
            self.choosing = None;
            actions.push(Action::Prefer(Change::ResetKeys));
        }
    }

    fn key_row(&mut self, ui: &mut Ui, row: &'static Row, map: &KeyMap, actions: &mut Actions) {
        ui.horizontal_top(|ui| {
            let width = (0.48 * ui.available_width()).max(120.0);
            let height = ui.spacing().interact_size.y;
            let label = egui::Label::new(row.words.does).wrap();
            ui.allocate_ui_with_layout(egui::vec2(width, height), Layout::top_down(Align::Min), |ui| {
                ui.set_min_size(egui::vec2(width, height));
                ui.add_space(5.0);
                ui.add(label);
            });
            ui.horizontal_wrapped(|ui| {
                for default in row.choices() {
                    self.key_button(ui, row, map, default, actions);
                }
            });
        });
        let taken = match &self.choosing {
            Some(Choosing {
                default,
                taken: Some(taken),
            }) if row.choices().any(|choice| choice == *default) => Some((*default, taken.clone())),
            _ => None,
        };
        if let Some((default, taken)) = taken {
            self.conflict(ui, default, &taken, actions);
        }
    }

    fn key_button(
        &mut self,
        ui: &mut Ui,
        row: &'static Row,
        map: &KeyMap,
        default: Shortcut,
        actions: &mut Actions,
    ) {
        let waits = matches!(
            &self.choosing,
            Some(Choosing { default: chosen, taken: None }) if *chosen == default
        );
        let present = map.present(default).map(|present| present.to_string());
        let name = words::key_name(row.words.does, present.as_deref(), default);
        let text = match (waits, &present) {
            (true, _) => RichText::new(words::PRESS_A_KEY).color(theme::on_accent(ui.visuals())),
            (false, Some(present)) => RichText::new(present).monospace(),
            (false, None) => RichText::new(words::NO_KEY).weak(),
        };
        let mut button = egui::Button::new(text);
        if waits {
            button = button.fill(theme::accent(ui.visuals()));
        }
        let response = ui.add(button).accessible_name(name);
        if response.clicked() {
            self.choosing = Some(Choosing { default, taken: None });
        }
        if waits {
            // Arrows and Tab are keys to choose, too.
            let filter = egui::EventFilter {
                tab: true,
                horizontal_arrows: true,
                vertical_arrows: true,
                escape: true,
            };
            response.request_focus();
            ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, filter));
        }
        if map.is_moved(default) {
            let reset = ui
                .small_button(words::RESET)
                .on_hover_text(words::reset_tip(default));
            if reset
                .accessible_name(words::reset_name(row.words.does, default))
                .clicked()
            {
                self.choosing = None;
                // Whatever has that key now has to give it back.
                if let Some((_, other)) = keys::meaning(map, default)
                    && other != default
                {
                    actions.push(Action::Prefer(Change::Key(other, None)));
                }
                actions.push(Action::Prefer(Change::Key(default, Some(default))));
            }
        }
    }

    fn conflict(&mut self, ui: &mut Ui, default: Shortcut, taken: &Taken, actions: &mut Actions) {
        ui.horizontal_wrapped(|ui| {
            let color = ui.visuals().warn_fg_color;
            match taken {
                Taken::Fixed(pressed) => {
                    ui.colored_label(color, words::fixed(*pressed));
                }
                Taken::By {
                    pressed,
                    does,
                    default: other,
                } => {
                    ui.colored_label(color, words::taken(*pressed, does));
                    if ui.button(words::USE_IT_HERE).clicked() {
                        actions.push(Action::Prefer(Change::Key(*other, None)));
                        actions.push(Action::Prefer(Change::Key(default, Some(*pressed))));
                        self.choosing = None;
                    }
                }
            }
            if ui.button(words::ANOTHER_KEY).clicked() {
                self.choosing = Some(Choosing { default, taken: None });
            }
            if ui.button(words::LEAVE_IT).clicked() {
                self.choosing = None;
            }
        });
    }
}

fn section(ui: &mut Ui, title: &str) {
    ui.add_space(8.0);
    ui.label(RichText::new(title).size(15.0).strong());
}

/// A line with what is chosen at the left and the control beside it.
fn line(ui: &mut Ui, text: &str, control: impl FnOnce(&mut Ui)) {
    ui.horizontal(|ui| {
        let size = egui::vec2(128.0, ui.spacing().interact_size.y);
        ui.allocate_ui(size, |ui| {
            ui.set_min_width(size.x);
            ui.label(text);
        });
        control(ui);
    });
}

fn appearance(ui: &mut Ui, state: &AppState, actions: &mut Actions) {
    let preferences = &state.preferences;
    line(ui, words::THEME, |ui| {
        for (theme, name) in [
            (ThemePreference::Dark, words::DARK),
            (ThemePreference::Light, words::LIGHT),
            (ThemePreference::System, words::AS_THE_SYSTEM),
        ] {
            if ui.radio(preferences.theme == theme, name).clicked() {
                actions.push(Action::SetTheme(theme));
            }
        }
    });
    line(ui, words::SCALE, |ui| {
        let chosen = words::percent(preferences.scale);
        let shown = ComboBox::from_id_salt("scale")
            .selected_text(chosen)
            .show_ui(ui, |ui| {
                for scale in SCALES {
                    if ui
                        .selectable_label(preferences.scale == scale, words::percent(scale))
                        .clicked()
                    {
                        actions.push(Action::Prefer(Change::Scale(scale)));
                    }
                }
            });
        shown.response.accessible_name(words::SCALE);
        let keys = ["Ctrl++", "Ctrl+-", "Ctrl+0"].map(|key| keys::text(&preferences.keys, key));
        ui.add(egui::Label::new(RichText::new(words::scale_keys(&keys)).weak()).truncate());
    });
    line(ui, words::OPACITY, |ui| {
        let mut percent = 100.0 * state.settings.opacity;
        let slider = Slider::new(&mut percent, 0.0..=100.0).integer().suffix(" %");
        if ui.add(slider).accessible_name(words::OPACITY).changed() {
            actions.push(Action::SetOpacity(percent / 100.0));
        }
    });
}

fn training(ui: &mut Ui, state: &AppState, actions: &mut Actions) {
    let chosen = state.preferences.threads;
    line(ui, words::THREADS, |ui| {
        let usual = crate::run::usual_threads();
        let text = chosen.map_or_else(|| words::automatic(usual), |threads| threads.to_string());
        let shown = ComboBox::from_id_salt("threads")
            .width(160.0)
            .selected_text(text)
            .show_ui(ui, |ui| {
                let mut choice = |ui: &mut Ui, threads: Option<usize>, text: String| {
                    if ui.selectable_label(chosen == threads, text).clicked() {
                        actions.push(Action::Prefer(Change::Threads(threads)));
                    }
                };
                choice(ui, None, words::automatic(usual));
                for threads in 1..=crate::run::cores() {
                    choice(ui, Some(threads), threads.to_string());
                }
            });
        shown.response.accessible_name(words::THREADS);
    });
    ui.add(egui::Label::new(RichText::new(words::THREADS_EXPLANATION).weak()).wrap());
}

fn hints(ui: &mut Ui, state: &AppState, actions: &mut Actions) {
    let seen = state.preferences.hints_seen.len();
    ui.horizontal_wrapped(|ui| {
        if ui
            .add_enabled(seen > 0, egui::Button::new(words::RESET_HINTS))
            .clicked()
        {
            actions.push(Action::Prefer(Change::ResetHints));
        }
        ui.weak(words::hints_seen(seen, crate::hints::Hint::ALL.len()));
    });
}
