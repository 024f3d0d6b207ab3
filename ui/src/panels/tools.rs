//! The tool bar over the canvas, and the hint about what to do next.

use egui::{Align, Layout, Rect, Slider, Ui};
use inplace_core::session::Phase;

use crate::action::{Action, Actions};
use crate::canvas::{Layer, Tool, View};
use crate::state::{AppState, LARGEST_BRUSH};
use crate::widgets::{Icon, icon_button, icon_button_with};
use crate::workspace::Workspace;

/// Draws the tool bar.
pub fn show(ui: &mut Ui, state: &AppState, workspace: &Workspace, actions: &mut Actions) {
    let settings = &state.settings;
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        for (tool, icon, name) in [
            (Tool::Label, Icon::Brush, "Label"),
            (Tool::Erase, Icon::Eraser, "Erase (E)"),
        ] {
            if icon_button_with(ui, icon, name, settings.tool == tool).clicked() {
                actions.push(Action::ChooseTool(tool));
            }
        }
        ui.add_space(4.0);
        let mut brush = settings.brush;
        let slider = Slider::new(&mut brush, 0..=LARGEST_BRUSH)
            .logarithmic(true)
            .suffix(" px")
            .show_value(true);
        ui.label("Brush");
        let response = ui.add(slider).accessible_name("Brush size");
        if response
            .on_hover_text("Radius in image pixels: [ and ], or Ctrl+wheel")
            .changed()
        {
            actions.push(Action::SetBrush(brush));
        }
        ui.separator();
        for layer in Layer::ALL {
            let chosen = settings.layer == layer;
            if ui
                .selectable_label(chosen, layer.name())
                .on_hover_text("Q")
                .clicked()
            {
                actions.push(Action::ChooseLayer(layer));
            }
        }
        ui.add_space(4.0);
        let mut percent = settings.opacity * 100.0;
        ui.label("Opacity");
        ui.add_enabled_ui(settings.layer != Layer::Color, |ui| {
            let slider = Slider::new(&mut percent, 0.0..=100.0).integer().show_value(false);
            if ui.add(slider).accessible_name("Opacity").changed() {
                actions.push(Action::SetOpacity(percent / 100.0));
            }
        });
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            if icon_button(ui, Icon::Fit, "Fit image (F)").clicked() {
                actions.push(Action::SetView(View::FITTED));
            }
            let history = workspace.document().history();
            let undo = history.undo_name();
            let redo = history.redo_name();
            for (name, verb, keys, icon, action) in [
                (redo, "Redo", "Ctrl+Shift+Z", Icon::Redo, Action::Redo),
                (undo, "Undo", "Ctrl+Z", Icon::Undo, Action::Undo),
            ] {
                let text = name.map_or_else(|| verb.to_owned(), |name| format!("{verb} {name} ({keys})"));
                ui.add_enabled_ui(name.is_some(), |ui| {
                    if icon_button(ui, icon, &text).clicked() {
                        actions.push(action);
                    }
                });
            }
        });
    });
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
    let strokes = document.labels().strokes.len();
    if document.classes().is_empty() {
        Some("Click on something in the image and name its class")
    } else if strokes == 0 {
        Some("No strokes yet: choose a class, then click or scribble on the image")
    } else if workspace.status().phase == Phase::FindingSurface && workspace.shown_map().is_none() {
        Some("Finding the surface of the scene; your labels spread as soon as it is there")
    } else {
        None
    }
}
