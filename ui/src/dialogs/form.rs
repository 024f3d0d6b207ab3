//! What dialogs are made of: fields, and the buttons at the end.

use egui::{Key, Ui};
use inplace_model::dialogs::Purpose;
use inplace_model::{Command, Commands};

use crate::widgets::main_button_enabled;

/// Height for what scrolls in a dialog.
pub fn room(ctx: &egui::Context) -> f32 {
    (ctx.content_rect().height() - 176.0).max(96.0)
}

/// A [`text_field`] for a path.
pub fn path_field(ui: &mut Ui, path: &mut String, name: &str) -> bool {
    text_field(ui, path, name, "/path/to/...")
}

/// A field that has the keyboard unless something else has; returns whether Enter was pressed in it.
pub fn text_field(ui: &mut Ui, text: &mut String, name: &str, hint: &'static str) -> bool {
    let edit = egui::TextEdit::singleline(text)
        .hint_text(hint)
        .desired_width(f32::INFINITY)
        .margin(egui::vec2(8.0, 6.0));
    let response = ui.add(edit).accessible_name(name);
    let first = ui.memory(|memory| memory.focused().is_none());
    if first && !response.lost_focus() {
        response.request_focus();
    }
    response.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter))
}

/// A button that asks for a file or a folder.
pub fn browse(ui: &mut Ui, text: &str, purpose: Purpose, commands: &mut Commands) {
    if ui.button(text).clicked() {
        commands.push(Command::Browse(purpose));
    }
}

/// One line of controls from the right.
pub fn at_the_end(ui: &mut Ui, controls: impl FnOnce(&mut Ui)) {
    ui.horizontal(|ui| {
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), controls);
    });
}

/// The row of buttons at the end of a dialog.
pub fn confirm(
    ui: &mut Ui,
    verb: &str,
    possible: bool,
    entered: bool,
    commands: &mut Commands,
    command: impl FnOnce() -> Command,
) {
    ui.add_space(8.0);
    at_the_end(ui, |ui| {
        let confirmed = main_button_enabled(ui, possible, verb).clicked();
        if possible && (confirmed || entered) {
            commands.push(command());
        }
        if ui.button("Cancel").clicked() {
            commands.push(Command::Show(None));
        }
    });
}

/// The button at the end of a dialog that asks for nothing.
pub fn close(ui: &mut Ui, commands: &mut Commands) {
    ui.add_space(8.0);
    at_the_end(ui, |ui| {
        if ui.button("Close").clicked() {
            commands.push(Command::Show(None));
        }
    });
}
