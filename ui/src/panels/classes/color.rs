//! The colour of a class: its swatch is a button.

use egui::{Color32, Key, Popup, PopupCloseBehavior, Rect, Role, Sense, Ui, WidgetInfo, vec2};
use inplace_core::labels::{Class, default_color};
use inplace_model::{Command, Commands};

use crate::widgets::{focus_ring, swatch, text_line};

/// The swatch as a button that opens the colours to choose from.
pub(super) fn recolor_popup(ui: &Ui, class: &Class, rect: Rect, commands: &mut Commands) {
    let response = ui.interact(rect, ui.scope_id().with("colour"), Sense::click());
    let name = format!("Colour of {}", class.name);
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, &name));
    if response.has_focus() {
        focus_ring(ui, rect);
    }
    Popup::menu(&response)
        .close_behavior(PopupCloseBehavior::CloseOnClickOutside)
        .show(|ui| {
            ui.label(&name);
            egui::Grid::new("colours")
                .spacing([4.0, 4.0])
                .min_col_width(24.0)
                .show(ui, |ui| {
                    for id in 1..=24 {
                        let color = default_color(id);
                        let (cell, choice) = ui.allocate_exact_size(vec2(24.0, 24.0), Sense::click());
                        let words = format!("Colour {id}");
                        choice.widget_info(|| WidgetInfo::labeled(Role::Button, true, &words));
                        let side = if choice.hovered() { 24.0 } else { 20.0 };
                        swatch(ui.painter(), cell.center(), color, side);
                        if choice.has_focus() {
                            focus_ring(ui, cell);
                        }
                        if choice.clicked() {
                            commands.push(Command::RecolorClass(class.id, color));
                            ui.close();
                        }
                        if id % 6 == 0 {
                            ui.end_row();
                        }
                    }
                });
            custom_color(ui, class, commands);
        });
    response.on_hover_text(name);
}

/// Any colour as hexadecimal digits.
fn custom_color(ui: &mut Ui, class: &Class, commands: &mut Commands) {
    let id = ui.scope_id().with("custom colour");
    let [r, g, b] = class.color;
    // What is typed counts until the class has another colour.
    let typed = ui.data(|data| data.get_temp::<([u8; 3], String)>(id));
    let typed = typed.filter(|(before, _)| *before == class.color);
    let mut text = typed.map_or_else(|| format!("#{r:02x}{g:02x}{b:02x}"), |(_, text)| text);
    ui.horizontal(|ui| {
        let field = text_line(&mut text, "", 96.0);
        let response = ui.add(field).accessible_name("Colour as hexadecimal digits");
        let entered = response.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
        let parsed = Color32::from_hex(text.trim()).ok();
        let clicked = ui
            .add_enabled(parsed.is_some(), egui::Button::new("Use"))
            .clicked();
        if let Some(color) = parsed
            && (entered || clicked)
        {
            commands.push(Command::RecolorClass(class.id, [color.r(), color.g(), color.b()]));
            ui.close();
        }
    });
    ui.data_mut(|data| data.insert_temp(id, (class.color, text)));
}
