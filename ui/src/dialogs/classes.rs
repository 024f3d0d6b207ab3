//! The dialog that adds many classes.

use egui::{RichText, ScrollArea, Ui, vec2};
use inplace_core::labels::PALETTES;
use inplace_model::dialogs::{AddClasses, ClassChoice, ClassSource, Purpose, typed_path};
use inplace_model::text::counted;
use inplace_model::{Command, Commands};

use super::form::{browse, confirm, path_field, text_field};
use crate::widgets::{line_of_text, swatch, weak_text};

/// Height of a line of the list, in points.
const LINE: f32 = 26.0;

/// Draws the dialog that adds classes.
pub fn show(ui: &mut Ui, dialog: &mut AddClasses, commands: &mut Commands) {
    sources(dialog, ui);
    match dialog.source {
        ClassSource::Palette(index) => {
            let palette = &PALETTES[index];
            ui.weak(format!("{} classes: {}", dialog.choices.len(), palette.scenes));
        }
        ClassSource::File => file(dialog, ui, commands),
    }
    if let Some(problem) = &dialog.problem {
        let color = ui.visuals().error_fg_color;
        ui.add(egui::Label::new(RichText::new(problem).color(color)).wrap());
    }
    let found = dialog.found();
    if !dialog.choices.is_empty() {
        search_line(dialog, ui, &found);
    }
    lines(dialog, ui, &found);
    let count = dialog.ticked().count();
    let verb = format!("Add {}", counted(count, "class", "classes"));
    confirm(ui, &verb, count > 0, false, commands, || {
        Command::AddClasses(dialog.ticked().cloned().collect())
    });
}

fn sources(dialog: &mut AddClasses, ui: &mut Ui) {
    ui.horizontal_wrapped(|ui| {
        for (index, palette) in PALETTES.iter().enumerate() {
            let chosen = dialog.source == ClassSource::Palette(index);
            if ui.selectable_label(chosen, palette.name).clicked() {
                dialog.choose(ClassSource::Palette(index));
            }
        }
        if ui
            .selectable_label(dialog.source == ClassSource::File, "From a file")
            .clicked()
        {
            dialog.choose(ClassSource::File);
        }
    });
}

fn file(dialog: &mut AddClasses, ui: &mut Ui, commands: &mut Commands) {
    weak_text(
        ui,
        "A list such as [{\"id\": 1, \"name\": \"wall\", \"color\": [200, 200, 190]}, ...]; colours may be left out. An export's classes.json is one.",
    );
    let entered = path_field(ui, &mut dialog.path, "Class list file");
    ui.horizontal(|ui| {
        let path = dialog.path.trim();
        let read = ui.add_enabled(!path.is_empty(), egui::Button::new("Read"));
        if read.clicked() || entered && !path.is_empty() {
            commands.push(Command::ReadClasses(typed_path(path)));
        }
        browse(ui, "Browse...", Purpose::Classes, commands);
    });
}

fn search_line(dialog: &mut AddClasses, ui: &mut Ui, found: &[usize]) {
    ui.horizontal(|ui| {
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            for (text, tick) in [("Tick none", false), ("Tick all", true)] {
                if ui.button(text).clicked() {
                    for &index in found {
                        dialog.choices[index].ticked = tick;
                    }
                }
            }
            text_field(ui, &mut dialog.search, "Search in the list", "Search in the list");
        });
    });
}

fn lines(dialog: &mut AddClasses, ui: &mut Ui, found: &[usize]) {
    // As high with few lines as with many, so that the buttons below stay where they are.
    let room = ui.ctx().content_rect().height() - 380.0;
    let height = room.clamp(4.0 * LINE, 12.0 * LINE);
    ui.allocate_ui(vec2(ui.available_width(), height), |ui| {
        ui.set_min_height(height);
        if found.is_empty() && !dialog.choices.is_empty() {
            ui.weak("No class has this in its name.");
        }
        ui.spacing_mut().item_spacing.y = 0.0;
        ScrollArea::vertical()
            .auto_shrink([false, false])
            .max_height(height)
            .show_rows(ui, LINE, found.len(), |ui, range| {
                for &index in &found[range] {
                    line(dialog, ui, index);
                }
            });
    });
}

fn line(dialog: &mut AddClasses, ui: &mut Ui, index: usize) {
    let ClassChoice { class, ticked, there } = &mut dialog.choices[index];
    let there = *there;
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), LINE), egui::Sense::hover());
    let mut line = ui.new_child(
        egui::UiBuilder::new()
            .max_rect(rect)
            .id_salt(class.id)
            .layout(egui::Layout::left_to_right(egui::Align::Center)),
    );
    let mut shown = *ticked && !there;
    let check = line
        .add_enabled(!there, egui::Checkbox::without_text(&mut shown))
        .accessible_name(&class.name);
    if check.gained_focus() {
        check.scroll_to_me(None);
    }
    // The whole line is a target, not the little box alone.
    let row = line.interact(response.rect, line.scope_id().with("line"), egui::Sense::CLICK);
    if !there && (check.changed() || row.clicked()) {
        *ticked = !*ticked;
    }
    let left = check.rect.right() + 34.0;
    let center = egui::pos2(left - 18.0, rect.center().y);
    swatch(line.painter(), center, class.color, 16.0);
    let weak = ui.visuals().weak_text_color();
    let number = egui::Rect::from_x_y_ranges(left..=left + 44.0, rect.y_range());
    line_of_text(ui, number, &class.id.to_string(), 13.0, weak);
    let end = if there {
        rect.right() - 100.0
    } else {
        rect.right() - 8.0
    };
    let name = egui::Rect::from_min_max(number.right_top(), egui::pos2(end, rect.bottom()));
    let color = if there { weak } else { ui.visuals().text_color() };
    line_of_text(ui, name, &class.name, 14.0, color);
    if there {
        let note = egui::Rect::from_min_max(egui::pos2(end + 4.0, rect.top()), rect.max);
        line_of_text(ui, note, "already there", 13.0, weak);
    }
}
