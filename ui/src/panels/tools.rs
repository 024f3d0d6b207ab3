//! The tool bar over the canvas, and the hint about what to do next.

use egui::{Align, Layout, Slider, Ui};

use crate::action::{Action, Actions};
use crate::canvas::{Tool, layer_menu};
use crate::english::{layers, menu, tools as english};
use crate::keymap::KeyMap;
use crate::keys;
use crate::state::{AppState, LARGEST_BRUSH, Settings};
use crate::widgets::{Icon, icon_button, icon_button_with};
use crate::workspace::Workspace;

/// Below this width words give way to tooltips, and below the other the layers' names to a list.
const WORDY: f32 = 760.0;
const ROOMY: f32 = 640.0;
/// Below this width sliders are short.
const SPACIOUS: f32 = 784.0;

/// Narrowest that the tool bar can be.
pub const LEAST_WIDTH: f32 = 440.0;

/// Draws the tool bar.
pub fn show(ui: &mut Ui, state: &AppState, workspace: &Workspace, actions: &mut Actions) {
    let settings = &state.settings;
    let width = ui.available_width();
    let (wordy, roomy) = (width >= WORDY, width >= ROOMY);
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        if width < SPACIOUS {
            ui.spacing_mut().slider_width = 56.0;
        }
        crate::view3d::switch(ui, workspace, actions);
        ui.separator();
        for tool in Tool::ALL {
            let chosen = settings.tool == tool;
            if icon_button_with(ui, icon_of(tool), english::tool(tool), chosen).clicked() {
                actions.push(Action::ChooseTool(tool));
            }
        }
        brush(ui, settings.brush, wordy, actions);
        ui.separator();
        layers(ui, settings, (wordy, roomy), actions);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            if icon_button(ui, Icon::Fit, english::FIT).clicked() {
                actions.push(Action::Fit);
            }
            history(ui, workspace, actions);
        });
    });
}

fn icon_of(tool: Tool) -> Icon {
    match tool {
        Tool::Brush => Icon::Brush,
        Tool::Polyline => Icon::Polyline,
        Tool::Polygon => Icon::Polygon,
        Tool::Erase => Icon::Eraser,
        Tool::Select => Icon::Select,
    }
}

fn brush(ui: &mut Ui, mut radius: u32, wordy: bool, actions: &mut Actions) {
    ui.add_space(4.0);
    if wordy {
        ui.label(english::BRUSH);
    }
    let slider = Slider::new(&mut radius, 0..=LARGEST_BRUSH)
        .logarithmic(true)
        .show_value(false);
    let response = small_slider(ui, slider).accessible_name(english::BRUSH_NAME);
    let [smaller, larger] = ["[", "]"].map(|key| keys::text(&KeyMap::of(ui.ctx()), key));
    let response = response.on_hover_text(english::brush_hint(&smaller, &larger));
    if response.changed() {
        actions.push(Action::SetBrush(radius));
    }
    ui.add_sized([40.0, 20.0], egui::Label::new(english::pixels(radius)));
}

fn layers(ui: &mut Ui, settings: &Settings, (wordy, roomy): (bool, bool), actions: &mut Actions) {
    let width = if roomy { 152.0 } else { 88.0 };
    if let Some(layer) = layer_menu(ui, layers::LAYER, settings.layer, width) {
        actions.push(Action::ChooseLayer(layer));
    }
    if icon_button_with(ui, Icon::Compare, layers::COMPARE, settings.compare).clicked() {
        actions.push(Action::ToggleCompare);
    }
    ui.add_space(4.0);
    if wordy {
        ui.label(layers::OPACITY);
    }
    let mut percent = settings.opacity * 100.0;
    let other = settings.compare && settings.other_layer.covers();
    ui.add_enabled_ui(settings.layer.covers() || other, |ui| {
        let slider = Slider::new(&mut percent, 0.0..=100.0).integer().show_value(false);
        let response = small_slider(ui, slider).accessible_name(layers::OPACITY);
        let response = response.on_disabled_hover_text(layers::NO_OPACITY);
        if response.on_hover_text(layers::OPACITY_EXPLAINED).changed() {
            actions.push(Action::SetOpacity(percent / 100.0));
        }
    });
}

fn history(ui: &mut Ui, workspace: &Workspace, actions: &mut Actions) {
    let history = workspace.document().history();
    for (name, verb, keys, icon, action) in [
        (
            history.redo_name(),
            menu::REDO,
            "Ctrl+Shift+Z",
            Icon::Redo,
            Action::Redo,
        ),
        (
            history.undo_name(),
            menu::UNDO,
            "Ctrl+Z",
            Icon::Undo,
            Action::Undo,
        ),
    ] {
        let text = english::history(verb, name, keys);
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
