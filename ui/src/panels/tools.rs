//! The tool bar over the canvas, and the hint about what to do next.

use egui::{Align, Layout, Rect, Slider, Ui};
use inplace_core::session::Phase;

use crate::action::{Action, Actions};
use crate::canvas::{Layer, Tool, View};
use crate::english::hint;
use crate::state::{AppState, LARGEST_BRUSH, Settings};
use crate::widgets::{Icon, icon_button, icon_button_with};
use crate::workspace::Workspace;

/// Below this width words give way to tooltips.
const ROOMY: f32 = 640.0;

/// Draws the tool bar.
pub fn show(ui: &mut Ui, state: &AppState, workspace: &Workspace, actions: &mut Actions) {
    let settings = &state.settings;
    let roomy = ui.available_width() >= ROOMY;
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        if !roomy {
            ui.spacing_mut().slider_width = 56.0;
        }
        for (tool, icon, name) in [
            (Tool::Label, Icon::Brush, "Label"),
            (Tool::Erase, Icon::Eraser, "Erase (E)"),
        ] {
            if icon_button_with(ui, icon, name, settings.tool == tool).clicked() {
                actions.push(Action::ChooseTool(tool));
            }
        }
        brush(ui, settings.brush, roomy, actions);
        ui.separator();
        layers(ui, settings, roomy, actions);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            if icon_button(ui, Icon::Fit, "Fit image (F)").clicked() {
                actions.push(Action::SetView(View::FITTED));
            }
            history(ui, workspace, actions);
        });
    });
}

fn brush(ui: &mut Ui, mut radius: u32, roomy: bool, actions: &mut Actions) {
    ui.add_space(4.0);
    if roomy {
        ui.label("Brush");
    }
    let slider = Slider::new(&mut radius, 0..=LARGEST_BRUSH)
        .logarithmic(true)
        .show_value(false);
    let response = small_slider(ui, slider).accessible_name("Brush size");
    let response = response.on_hover_text("Brush radius in image pixels: [ and ], or Ctrl+wheel");
    if response.changed() {
        actions.push(Action::SetBrush(radius));
    }
    ui.add_sized([40.0, 20.0], egui::Label::new(format!("{radius} px")));
}

fn layers(ui: &mut Ui, settings: &Settings, roomy: bool, actions: &mut Actions) {
    let choices = |ui: &mut Ui, actions: &mut Actions| {
        for layer in Layer::ALL {
            let chosen = settings.layer == layer;
            let choice = ui.selectable_label(chosen, layer.name());
            if choice.on_hover_text("Q shows the next layer").clicked() {
                actions.push(Action::ChooseLayer(layer));
            }
        }
    };
    if roomy {
        choices(ui, actions);
    } else {
        egui::ComboBox::from_id_salt("layer")
            .selected_text(settings.layer.name())
            .width(88.0)
            .show_ui(ui, |ui| choices(ui, actions))
            .response
            .accessible_name("Layer");
    }
    ui.add_space(4.0);
    if roomy {
        ui.label("Opacity");
    }
    let mut percent = settings.opacity * 100.0;
    ui.add_enabled_ui(settings.layer != Layer::Color, |ui| {
        let slider = Slider::new(&mut percent, 0.0..=100.0).integer().show_value(false);
        let response = small_slider(ui, slider).accessible_name("Opacity");
        if response.on_hover_text("Opacity of the layer").changed() {
            actions.push(Action::SetOpacity(percent / 100.0));
        }
    });
}

fn history(ui: &mut Ui, workspace: &Workspace, actions: &mut Actions) {
    let history = workspace.document().history();
    for (name, verb, keys, icon, action) in [
        (
            history.redo_name(),
            "Redo",
            "Ctrl+Shift+Z",
            Icon::Redo,
            Action::Redo,
        ),
        (history.undo_name(), "Undo", "Ctrl+Z", Icon::Undo, Action::Undo),
    ] {
        let text = name.map_or_else(|| verb.to_owned(), |name| format!("{verb} {name} ({keys})"));
        ui.add_enabled_ui(name.is_some(), |ui| {
            if icon_button(ui, icon, &text).clicked() {
                actions.push(action);
            }
        });
    }
}

/// A slider whose handle is not larger than the buttons' icons.
fn small_slider(ui: &mut Ui, slider: Slider<'_>) -> egui::Response {
    ui.scope(|ui| {
        ui.spacing_mut().interact_size.y = 20.0;
        ui.add(slider)
    })
    .inner
}

/// Says over the canvas what to do next, while there is something to say.
pub fn hint(ui: &Ui, workspace: &Workspace, canvas: Rect) {
    let Some(text) = hint_text(workspace) else {
        return;
    };
    let visuals = ui.visuals();
    let painter = ui.painter_at(canvas);
    let font = egui::FontId::proportional(14.0);
    let galley = painter.layout(
        text.to_owned(),
        font,
        visuals.strong_text_color(),
        canvas.width() - 64.0,
    );
    let top = canvas.center_top() + egui::vec2(0.0, 12.0);
    let size = galley.size() + egui::vec2(24.0, 12.0);
    let rect = Rect::from_min_size(top - egui::vec2(0.5 * size.x, 0.0), size);
    let line = egui::Stroke::new(1.0, crate::theme::line(visuals));
    painter.rect(rect, 8, visuals.window_fill, line, egui::StrokeKind::Inside);
    let response = ui.interact(rect, ui.scope_id().with("hint"), egui::Sense::hover());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Label, true, text));
    painter.galley(rect.min + egui::vec2(12.0, 6.0), galley, visuals.text_color());
}

fn hint_text(workspace: &Workspace) -> Option<&'static str> {
    let document = workspace.document();
    if document.classes().is_empty() {
        Some(hint::NO_CLASS)
    } else if !document.labels().says_anything() {
        Some(hint::NO_STROKES)
    } else if workspace.status().phase == Phase::FindingSurface && workspace.shown_map().is_none() {
        Some(hint::NO_SURFACE)
    } else {
        None
    }
}
