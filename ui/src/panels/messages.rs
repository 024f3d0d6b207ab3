//! Short messages at the bottom of the canvas: the one place where errors are shown.

use egui::accesskit::Live;
use inplace_model::messages::{Level, Message, Messages};
use inplace_model::{Command, Commands};

use crate::theme;
use crate::widgets::{Icon, icon_button};

/// Draws the messages over the lower part of `area`; Escape dismisses the newest, unless it has
/// something else to do.
pub fn show(
    ctx: &egui::Context,
    messages: &Messages,
    area: egui::Rect,
    escape: bool,
    commands: &mut Commands,
) {
    let Some(newest) = messages.shown.last() else {
        return;
    };
    if escape && ctx.input(|input| input.key_pressed(egui::Key::Escape)) {
        commands.push(Command::Dismiss(newest.id));
    }
    let bottom = area.center_bottom() - egui::vec2(0.0, theme::GAP * 2.0);
    egui::Area::new(egui::Id::unique("messages"))
        .order(egui::Order::Foreground)
        .pivot(egui::Align2::CENTER_BOTTOM)
        .fixed_pos(bottom)
        .show(ctx, |ui| {
            let width = (area.width() - 32.0).clamp(160.0, 560.0);
            ui.set_max_width(width);
            // What is too long for the area scrolls: it must not cover the tools above.
            egui::ScrollArea::vertical()
                .max_height((area.height() - 4.0 * theme::GAP).max(48.0))
                .stick_to_bottom(true)
                .auto_shrink(true)
                .show(ui, |ui| {
                    for message in &messages.shown {
                        show_one(ui, message, width, commands);
                    }
                });
        });
}

fn show_one(ui: &mut egui::Ui, message: &Message, width: f32, commands: &mut Commands) {
    let visuals = ui.visuals();
    let (icon, color, name, live) = match message.level {
        Level::Info => (Icon::Info, theme::of(visuals).accent, "Message", Live::Polite),
        Level::Error => (Icon::Warning, visuals.error_fg_color, "Error", Live::Assertive),
    };
    let mut frame = egui::Frame::popup(ui.style()).inner_margin(12);
    if message.level == Level::Error {
        frame = frame.stroke(egui::Stroke::new(1.0, color));
    }
    frame.show(ui, |ui| {
        ui.horizontal(|ui| {
            let (rect, response) = ui.allocate_exact_size(egui::vec2(18.0, 18.0), egui::Sense::hover());
            response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, name));
            icon.paint(ui.painter(), rect, color);
            // The icon, the button and the frame around them.
            let room = (width - 104.0).max(64.0);
            ui.scope(|ui| {
                ui.set_max_width(room);
                let text = ui.add(egui::Label::new(&message.text).wrap().selectable(true));
                ui.ctx()
                    .accesskit_node_builder(text.id, |node| node.set_live(live));
            });
            if icon_button(ui, Icon::Close, "Dismiss message").clicked() {
                commands.push(Command::Dismiss(message.id));
            }
        });
    });
}
