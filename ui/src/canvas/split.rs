//! The canvas split between two layers of the same frame.

use egui::{
    Color32, CursorIcon, EventFilter, Key, Rect, Sense, Stroke, Ui, UiBuilder, WidgetInfo, pos2, vec2,
};
use inplace_model::layer::Layer;
use inplace_model::settings::Settings;
use inplace_model::{Command, Commands};

use crate::keys::table::NEXT_LAYER;
use crate::theme;
use crate::widgets::choice_box;

/// How far the border stays from the canvas's own, as a share of its width.
const MARGIN: f32 = 0.02;
/// How far the arrow keys move the border, as a share of the canvas's width.
const KEY_STEP: f32 = 0.02;
/// Half of the width that can be grabbed, in points.
const REACH: f32 = 6.0;
/// Radius of the grip in the middle.
const GRIP: f32 = 11.0;
/// Size of the menus in the upper corners.
const MENU: egui::Vec2 = vec2(152.0, 28.0);

/// A part of the canvas and the layer that it shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    pub clip: Rect,
    pub layer: Layer,
}

/// The parts of a canvas: one, or the left and the right one.
pub fn parts(canvas: Rect, settings: &Settings) -> Vec<Part> {
    let main = settings.layer;
    if !settings.compare {
        return vec![Part {
            clip: canvas,
            layer: main,
        }];
    }
    let (left, right) = canvas.split_left_right_at_x(border(canvas, settings));
    vec![
        Part {
            clip: right,
            layer: main,
        },
        Part {
            clip: left,
            layer: settings.other_layer,
        },
    ]
}

/// Where the border between the parts is.
fn border(canvas: Rect, settings: &Settings) -> f32 {
    canvas.left() + settings.split.clamp(MARGIN, 1.0 - MARGIN) * canvas.width()
}

/// What is left of the canvas below the menus of both sides, for what lies over its upper edge.
pub fn below_menus(canvas: Rect, settings: &Settings) -> Rect {
    if settings.compare {
        canvas.with_min_y((canvas.top() + theme::GAP + MENU.y).min(canvas.bottom()))
    } else {
        canvas
    }
}

/// Draws the border with its handle and the menus of both sides; `compared` says whether the scene is compared with another
/// project. Returns where nothing is to be drawn on the image.
pub fn show(
    ui: &mut Ui,
    canvas: Rect,
    (settings, compared): (&Settings, bool),
    commands: &mut Commands,
) -> Vec<Rect> {
    if !settings.compare {
        return Vec::new();
    }
    let x = border(canvas, settings);
    let mut covered = vec![handle(ui, canvas, x, settings, commands)];
    let top = canvas.top() + theme::GAP;
    for (left, room, layer, name, command) in [
        (
            canvas.left() + theme::GAP,
            x - canvas.left(),
            settings.other_layer,
            "Layer on the left",
            Command::ChooseOtherLayer as fn(Layer) -> Command,
        ),
        (
            canvas.right() - theme::GAP - MENU.x,
            canvas.right() - x,
            settings.layer,
            "Layer on the right",
            Command::ChooseLayer,
        ),
    ] {
        let rect = Rect::from_min_size(pos2(left, top), MENU);
        if room < MENU.x + 2.0 * theme::GAP {
            continue;
        }
        ui.scope_builder(UiBuilder::new().max_rect(rect), |ui| {
            if let Some(layer) = layer_menu(ui, name, (layer, compared), MENU.x) {
                commands.push(command(layer));
            }
        });
        covered.push(rect);
    }
    covered
}

fn handle(ui: &Ui, canvas: Rect, x: f32, settings: &Settings, commands: &mut Commands) -> Rect {
    let rect = Rect::from_x_y_ranges(x - REACH..=x + REACH, canvas.y_range());
    let id = ui.scope_id().with("split");
    let response = ui.interact(rect, id, Sense::drag());
    let share = settings.split.clamp(MARGIN, 1.0 - MARGIN);
    response.widget_info(|| WidgetInfo::slider(true, f64::from(share), "Border between the layers"));
    let mut wanted = share;
    if response.dragged()
        && let Some(position) = response.interact_pointer_pos()
    {
        wanted = (position.x - canvas.left()) / canvas.width().max(1.0);
    }
    if response.has_focus() {
        ui.memory_mut(|memory| {
            let filter = EventFilter {
                horizontal_arrows: true,
                ..EventFilter::default()
            };
            memory.set_focus_lock_filter(id, filter);
        });
        let steps = ui.input(|input| {
            let presses = |key| input.num_presses(key) as f32;
            presses(Key::ArrowRight) - presses(Key::ArrowLeft)
        });
        wanted += steps * KEY_STEP;
    }
    if wanted != share {
        commands.push(Command::SetSplit(wanted.clamp(MARGIN, 1.0 - MARGIN)));
    }
    if response.hovered() || response.dragged() {
        ui.set_cursor_icon(CursorIcon::ResizeHorizontal);
    }
    let active = response.hovered() || response.dragged() || response.has_focus();
    paint(ui, canvas, x, active);
    rect
}

fn paint(ui: &Ui, canvas: Rect, x: f32, active: bool) {
    let painter = ui.painter_at(canvas);
    let accent = theme::of(ui.visuals()).accent;
    let color = if active { accent } else { Color32::WHITE };
    let halo = Stroke::new(4.0, Color32::from_black_alpha(140));
    painter.vline(x, canvas.y_range(), halo);
    painter.vline(x, canvas.y_range(), Stroke::new(2.0, color));
    let center = pos2(x, canvas.center().y);
    let dark = Color32::from_black_alpha(190);
    painter.circle(center, GRIP, dark, Stroke::new(2.0, color));
    for side in [-1.0, 1.0] {
        let at = |x: f32, y: f32| center + vec2(side * x, y);
        let arrow = vec![at(3.0, -3.5), at(6.5, 0.0), at(3.0, 3.5)];
        painter.line(arrow, Stroke::new(1.5, Color32::WHITE));
    }
}

/// A menu of the layers, with that of differences where the scene is compared; returns the one that was chosen.
pub fn layer_menu(ui: &mut Ui, name: &str, (layer, compared): (Layer, bool), width: f32) -> Option<Layer> {
    let mut chosen = None;
    let menu = choice_box(ui, name, width, layer.name(), |ui| {
        for each in Layer::present(compared) {
            let entry = ui.selectable_label(each == layer, each.name());
            if entry.on_hover_text(each.explanation()).clicked() {
                chosen = Some(each);
            }
        }
    });
    let explanation = format!("{}. {}", layer.explanation(), NEXT_LAYER.named(ui.ctx()));
    menu.on_hover_text(explanation);
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parts_share_the_canvas_without_gap_or_overlap() {
        let canvas = Rect::from_min_size(pos2(100.0, 50.0), vec2(800.0, 400.0));
        let mut settings = Settings {
            layer: Layer::Depth,
            other_layer: Layer::Color,
            split: 0.25,
            ..Settings::default()
        };
        assert_eq!(parts(canvas, &settings).len(), 1);
        settings.compare = true;
        let [right, left] = parts(canvas, &settings)[..] else {
            panic!("two parts")
        };
        assert_eq!((left.layer, right.layer), (Layer::Color, Layer::Depth));
        assert_eq!((left.clip.left(), left.clip.right()), (100.0, 300.0));
        assert_eq!((right.clip.left(), right.clip.right()), (300.0, 900.0));
        settings.split = 1.0;
        assert!(parts(canvas, &settings)[0].clip.width() >= 15.0);
    }
}
