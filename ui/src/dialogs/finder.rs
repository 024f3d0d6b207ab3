//! The class finder: part of a name is enough.

use std::borrow::Cow;

use egui::{Key, Modifiers, Pos2, Rect, Role, ScrollArea, Sense, Ui, WidgetInfo, pos2, vec2};
use inplace_model::dialogs::{ClassFinder, FoundClass};
use inplace_model::{Command, Commands};

use super::form::text_field;
use crate::theme;
use crate::widgets::{Icon, key_cap, line_of_text, swatch};

const WIDTH: f32 = 288.0;
const LINE: f32 = 28.0;
/// Lines that are shown without scrolling.
const LINES: usize = 9;

/// Draws the popup; pushes what was chosen.
pub fn show(ctx: &egui::Context, finder: &mut ClassFinder, at: Pos2, commands: &mut Commands) {
    let id = egui::Id::unique("class finder");
    let area = egui::Modal::default_area(id)
        .anchor(egui::Align2::LEFT_TOP, corner(at, ctx.content_rect()).to_vec2());
    let frame = egui::Frame::popup(&ctx.global_style()).inner_margin(8);
    let modal = egui::Modal::new(id).area(area).frame(frame);
    let modal = modal.backdrop_color(egui::Color32::from_black_alpha(40));
    let modal = modal.show(ctx, |ui| {
        ui.set_width(WIDTH);
        contents(ui, finder, commands);
    });
    if modal.should_close() {
        commands.push(Command::Show(None));
    }
}

/// The left upper corner, so that all of the popup is inside the window.
fn corner(at: Pos2, window: Rect) -> Pos2 {
    let size = vec2(WIDTH + 24.0, (LINES as f32 + 1.0) * LINE + 64.0);
    let last = (window.max - size).max(window.min);
    at.clamp(window.min, last)
}

fn contents(ui: &mut Ui, finder: &mut ClassFinder, commands: &mut Commands) {
    let keys = [Key::ArrowDown, Key::ArrowUp, Key::Enter];
    let pressed = |key| ui.input_mut(|input| input.consume_key(Modifiers::NONE, key));
    let [down, up, enter] = keys.map(pressed);
    let before = finder.text.clone();
    text_field(ui, &mut finder.text, "Find class", "Part of a name");
    let typed = finder.text != before;
    if typed {
        finder.line = 0;
    }
    let found = finder.found();
    let last = found.len().saturating_sub(1);
    finder.line = match (down, up) {
        (true, false) => (finder.line + 1).min(last),
        (false, true) => finder.line.saturating_sub(1),
        _ => finder.line.min(last),
    };
    let clicked = lines(ui, finder, &found, typed || down || up);
    ui.add_space(theme::GAP);
    ui.add(
        egui::Label::new(egui::RichText::new("Up and Down, Enter, Escape").weak().small()).selectable(false),
    );
    let chosen = clicked.or(enter.then_some(finder.line));
    if let Some(found) = chosen.and_then(|line| found.get(line)) {
        commands.push(match found {
            FoundClass::Class(index) => Command::UseClass(finder.purpose, finder.classes[*index].id),
            FoundClass::New => Command::AddClass(finder.purpose, finder.text.trim().to_owned()),
        });
    }
}

/// The lines; returns the one that was clicked on.
fn lines(ui: &mut Ui, finder: &ClassFinder, found: &[FoundClass], moved: bool) -> Option<usize> {
    let mut clicked = None;
    ui.spacing_mut().item_spacing.y = 0.0;
    ScrollArea::vertical()
        .auto_shrink([false, true])
        .max_height(LINES as f32 * LINE)
        .show_viewport(ui, |ui, viewport| {
            let corner = ui.max_rect().min;
            let width = ui.available_width();
            ui.set_height(found.len() as f32 * LINE);
            let at = |line: usize| {
                Rect::from_min_size(pos2(corner.x, corner.y + line as f32 * LINE), vec2(width, LINE))
            };
            let first = (viewport.min.y / LINE).floor().max(0.0) as usize;
            let end = ((viewport.max.y / LINE).ceil() as usize).min(found.len());
            for (line, item) in found.iter().enumerate().take(end).skip(first) {
                if draw_line(ui, finder, at(line), line, item) {
                    clicked = Some(line);
                }
            }
            if moved {
                ui.scroll_to_rect(at(finder.line), None);
            }
        });
    clicked
}

fn draw_line(ui: &Ui, finder: &ClassFinder, rect: Rect, line: usize, found: &FoundClass) -> bool {
    let words: Cow<'_, str> = match found {
        FoundClass::Class(index) => finder.classes[*index].name.as_str().into(),
        FoundClass::New => format!("New class \"{}\"", finder.text.trim()).into(),
    };
    let chosen = line == finder.line;
    let response = ui.interact(rect, ui.scope_id().with(line), Sense::CLICK);
    response.widget_info(|| WidgetInfo::selected(Role::ListBoxOption, true, chosen, &words));
    let visuals = ui.visuals();
    if chosen {
        ui.painter().rect_filled(rect, 4, theme::of(visuals).accent);
    } else if response.hovered() {
        ui.painter().rect_filled(rect, 4, visuals.widgets.hovered.bg_fill);
    }
    let color = if chosen {
        theme::of(visuals).on_accent
    } else {
        visuals.text_color()
    };
    let left = pos2(rect.left() + 16.0, rect.center().y);
    let mut end = rect.right() - 8.0;
    match found {
        FoundClass::Class(index) => {
            swatch(ui.painter(), left, finder.classes[*index].color, 16.0);
            if let Some(digit) = finder.digit(*index) {
                end -= 24.0;
                let center = pos2(end + 12.0, rect.center().y);
                if chosen {
                    let font = egui::FontId::monospace(11.0);
                    let middle = egui::Align2::CENTER_CENTER;
                    ui.painter().text(center, middle, digit, font, color);
                } else {
                    key_cap(ui, center, &digit.to_string());
                }
            }
        }
        FoundClass::New => {
            let place = Rect::from_center_size(left, vec2(16.0, 16.0));
            Icon::Add.paint(ui.painter(), place, color);
        }
    }
    let place = Rect::from_min_max(pos2(rect.left() + 32.0, rect.top()), pos2(end, rect.bottom()));
    let cut = line_of_text(ui, place, &words, 14.0, color);
    let response = if cut {
        response.on_hover_text(words)
    } else {
        response
    };
    response.clicked()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_popup_stays_inside_the_window() {
        let window = Rect::from_min_size(Pos2::ZERO, vec2(1280.0, 720.0));
        for at in [pos2(0.0, 0.0), pos2(1279.0, 719.0), pos2(600.0, 300.0)] {
            let corner = corner(at, window);
            assert!(window.contains(corner) && corner.x <= 1280.0 - WIDTH && corner.y < 400.0);
        }
    }
}
