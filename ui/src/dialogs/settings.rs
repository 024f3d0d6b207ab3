//! What a person can choose once for all scenes: looks, threads, keys, hints.

use egui::{Align, Event, Layout, RichText, ScrollArea, Slider, Ui};
use inplace_core::cores;
use inplace_model::dialogs::{ChosenKey, Purpose, typed_path};
use inplace_model::hints::Hint;
use inplace_model::keymap::{KeyMap, Shortcut};
use inplace_model::preferences::{PreferenceChange, Theme, usual_threads};
use inplace_model::{Command, Commands, Model};

use super::form::{close, room};
use crate::keys;
use crate::keys::table::{LARGER, Line, SMALLER, TABLE, USUAL_SIZE, UiCommand};
use crate::theme;
use crate::widgets::{choice_box, weak_text};

/// The scales to choose from, in percent.
const SCALES: [u16; 7] = [100, 125, 150, 175, 200, 250, 300];

/// What the features are.
const FEATURES_MEAN: &str = "A network that was trained on photographs recognises what looks alike: labels are a little better while each class has one or two clicks. Inplace does not ship one; the guide says where to get the file";

/// Takes the key that is being waited for; before anything else looks at the keys.
pub fn listen(choosing: &mut Option<ChosenKey>, ctx: &egui::Context, commands: &mut Commands) {
    let Some(ChosenKey {
        default,
        pressed: None,
    }) = *choosing
    else {
        return;
    };
    let mut pressed = None;
    ctx.input_mut(|input| {
        input.events.retain(|event| {
            let key = keys::pressed(event);
            pressed = pressed.or_else(|| key.and_then(|(modifiers, key)| keys::shortcut(modifiers, key)));
            let typed = matches!(event, Event::Text(_) | Event::Cut | Event::Copy | Event::Paste(_));
            key.is_none() && !typed
        });
    });
    let Some(pressed) = pressed.map(Shortcut::of_layout) else {
        return;
    };
    if pressed == Shortcut::key("Escape") {
        *choosing = None;
        return;
    }
    let other = keys::meaning(&keys::map_of(ctx), pressed).filter(|&(_, other)| other != default);
    if pressed.is_fixed() || other.is_some() {
        let pressed = Some(pressed);
        *choosing = Some(ChosenKey { default, pressed });
    } else {
        commands.push(Command::Prefer(PreferenceChange::Key(default, Some(pressed))));
        *choosing = None;
    }
}

pub fn show(choosing: &mut Option<ChosenKey>, ui: &mut Ui, model: &Model, commands: &mut Commands) {
    ScrollArea::vertical()
        .auto_shrink([false, true])
        .max_height(room(ui.ctx()))
        .show(ui, |ui| {
            // Room for the scroll bar.
            ui.set_max_width(ui.available_width() - 12.0);
            section(ui, "Appearance");
            appearance(ui, model, commands);
            section(ui, "Training");
            training(ui, model, commands);
            section(ui, "Hints");
            hints(ui, model, commands);
            section(ui, "Keys");
            let map = &model.preferences.keys;
            Keys {
                choosing,
                map,
                commands,
            }
            .show(ui);
        });
    close(ui, commands);
}

/// The keys of all commands, to choose others.
struct Keys<'a> {
    choosing: &'a mut Option<ChosenKey>,
    map: &'a KeyMap,
    commands: &'a mut Commands,
}

impl Keys<'_> {
    fn show(&mut self, ui: &mut Ui) {
        ui.weak(
            "Press a button, then the new key; Escape leaves it as it is. The digits always choose classes.",
        );
        for line in TABLE {
            if let Line::Command(command) = line {
                ui.push_id(command.does, |ui| self.row(ui, command));
            }
        }
        let reset = ui.add_enabled(!self.map.is_default(), egui::Button::new("Reset all keys"));
        if reset.clicked() {
            *self.choosing = None;
            self.commands.push(Command::Prefer(PreferenceChange::ResetKeys));
        }
    }

    fn row(&mut self, ui: &mut Ui, row: &UiCommand) {
        ui.horizontal_top(|ui| {
            let width = (0.48 * ui.available_width()).max(120.0);
            let height = ui.spacing().interact_size.y;
            let label = egui::Label::new(row.does).wrap();
            ui.allocate_ui_with_layout(egui::vec2(width, height), Layout::top_down(Align::Min), |ui| {
                ui.set_min_size(egui::vec2(width, height));
                ui.add_space(5.0);
                ui.add(label);
            });
            ui.horizontal_wrapped(|ui| {
                for &default in row.keys {
                    self.button(ui, row, default);
                }
            });
        });
        if let Some(ChosenKey {
            default,
            pressed: Some(pressed),
        }) = *self.choosing
            && row.keys.contains(&default)
        {
            self.conflict(ui, default, pressed);
        }
    }

    fn button(&mut self, ui: &mut Ui, row: &UiCommand, default: Shortcut) {
        let waiting = Some(ChosenKey {
            default,
            pressed: None,
        });
        let waits = *self.choosing == waiting;
        let present = self.map.present(default).map(|present| present.to_string());
        // The default tells the keys of one action apart.
        let name = match &present {
            Some(present) => format!("{}: {present}", row.does),
            None => format!("{}: no key, by default {default}", row.does),
        };
        let text = match (waits, &present) {
            (true, _) => RichText::new("Press a key...").color(theme::of(ui.visuals()).on_accent),
            (false, Some(present)) => RichText::new(present).monospace(),
            (false, None) => RichText::new("no key").weak(),
        };
        let mut button = egui::Button::new(text);
        if waits {
            button = button.fill(theme::of(ui.visuals()).accent);
        }
        let response = ui.add(button).accessible_name(name);
        if response.clicked() {
            *self.choosing = waiting;
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
        if self.map.is_moved(default) {
            let reset = ui
                .small_button("Reset")
                .on_hover_text(format!("Back to {default}"));
            let name = format!("Reset {} to {default}", row.does);
            if reset.accessible_name(name).clicked() {
                *self.choosing = None;
                // Whatever has that key now has to give it back.
                if let Some((_, other)) = keys::meaning(self.map, default)
                    && other != default
                {
                    self.give(other, None);
                }
                self.give(default, Some(default));
            }
        }
    }

    /// Gives what a key does by default another key, or none.
    fn give(&mut self, default: Shortcut, present: Option<Shortcut>) {
        self.commands
            .push(Command::Prefer(PreferenceChange::Key(default, present)));
    }

    fn conflict(&mut self, ui: &mut Ui, default: Shortcut, pressed: Shortcut) {
        ui.horizontal_wrapped(|ui| {
            let color = ui.visuals().warn_fg_color;
            if pressed.is_fixed() {
                let fixed = format!("{pressed} cannot be given away: the window needs it.");
                ui.colored_label(color, fixed);
            } else if let Some((does, other)) = keys::meaning(self.map, pressed) {
                ui.colored_label(color, format!("{pressed} is taken: {does}."));
                if ui.button("Use it here").clicked() {
                    self.give(other, None);
                    self.give(default, Some(pressed));
                    *self.choosing = None;
                }
            }
            if ui.button("Another key").clicked() {
                *self.choosing = Some(ChosenKey {
                    default,
                    pressed: None,
                });
            }
            if ui.button("Leave it").clicked() {
                *self.choosing = None;
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

fn appearance(ui: &mut Ui, model: &Model, commands: &mut Commands) {
    let preferences = &model.preferences;
    line(ui, "Theme", |ui| {
        ui.horizontal_wrapped(|ui| {
            for (theme, name) in [
                (Theme::Dark, "Dark"),
                (Theme::Light, "Light"),
                (Theme::System, "As the system"),
            ] {
                if ui.radio(preferences.theme == theme, name).clicked() {
                    commands.push(Command::Prefer(PreferenceChange::Theme(theme)));
                }
            }
        });
    });
    line(ui, "Scale", |ui| {
        let chosen = format!("{}%", preferences.scale);
        let width = ui.spacing().combo_width;
        choice_box(ui, "Scale", width, chosen, |ui| {
            for scale in SCALES {
                let choice = ui.selectable_label(preferences.scale == scale, format!("{scale}%"));
                if choice.clicked() {
                    commands.push(Command::Prefer(PreferenceChange::Scale(scale)));
                }
            }
        });
        let keys = [&LARGER, &SMALLER, &USUAL_SIZE].map(|command| command.key(ui.ctx()));
        ui.add(egui::Label::new(RichText::new(keys.join("  ")).weak()).truncate());
    });
    line(ui, "Overlay opacity", |ui| {
        let mut percent = 100.0 * model.settings.opacity;
        let slider = Slider::new(&mut percent, 0.0..=100.0).integer().suffix(" %");
        if ui.add(slider).accessible_name("Overlay opacity").changed() {
            commands.push(Command::SetOpacity(percent / 100.0));
        }
    });
}

fn training(ui: &mut Ui, model: &Model, commands: &mut Commands) {
    let chosen = model.preferences.threads;
    line(ui, "Threads", |ui| {
        let automatic = format!("Automatic ({})", usual_threads());
        let text = chosen.map_or_else(|| automatic.clone(), |threads| threads.to_string());
        choice_box(ui, "Threads", 160.0, text, |ui| {
            let mut choice = |ui: &mut Ui, threads: Option<usize>, text: String| {
                if ui.selectable_label(chosen == threads, text).clicked() {
                    commands.push(Command::Prefer(PreferenceChange::Threads(threads)));
                }
            };
            choice(ui, None, automatic);
            for threads in 1..=cores() {
                choice(ui, Some(threads), threads.to_string());
            }
        });
    });
    line(ui, "Features", |ui| features(ui, model, commands));
    weak_text(
        ui,
        "Used from the next scene that you open on. Fewer leave more of the computer to other programs.",
    );
}

/// The file of a pretrained network, which can be typed or chosen.
fn features(ui: &mut Ui, model: &Model, commands: &mut Commands) {
    let file = &model.preferences.features;
    let mut path = file
        .as_ref()
        .map(|file| file.display().to_string())
        .unwrap_or_default();
    let browse = ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
        let browse = ui.button("Browse...").on_hover_text(FEATURES_MEAN);
        let edit = egui::TextEdit::singleline(&mut path).hint_text("none (a MobileNetV2 file)");
        let edit = ui
            .add(edit.desired_width(f32::INFINITY).align(egui::Align2::LEFT_CENTER))
            .on_hover_text(FEATURES_MEAN);
        if edit.accessible_name("Features").changed() {
            let file = (!path.is_empty()).then(|| typed_path(&path));
            commands.push(Command::Prefer(PreferenceChange::Features(file)));
        }
        browse
    });
    if browse.inner.clicked() {
        commands.push(Command::Browse(Purpose::Features));
    }
}

fn hints(ui: &mut Ui, model: &Model, commands: &mut Commands) {
    let seen = model.preferences.hints_seen.len();
    ui.horizontal_wrapped(|ui| {
        if ui
            .add_enabled(seen > 0, egui::Button::new("Show all hints again"))
            .clicked()
        {
            commands.push(Command::Prefer(PreferenceChange::ResetHints));
        }
        ui.weak(format!("{seen} of {} seen", Hint::ALL.len()));
    });
}
