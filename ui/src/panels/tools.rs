//! The tool bar over the canvas.

use egui::{Align, Layout, Slider, Ui};
use inplace_model::settings::Settings;
use inplace_model::tool::{LARGEST_BRUSH, Tool};
use inplace_model::workspace::Workspace;
use inplace_model::{Command, Commands, Model};

use crate::canvas::layer_menu;
use crate::keys::table::{
    BRUSH, COMPARE, ERASE, FIT, LARGER_BRUSH, POLYGON, POLYLINE, REDO, SELECT, SMALLER_BRUSH, UNDO,
};
use crate::widgets::{Icon, icon_button, icon_button_with};

/// Below this width words give way to tooltips, and below the other there are two lines.
const WORDY: f32 = 760.0;
const ROOMY: f32 = 640.0;
/// Below this width sliders are short.
const SPACIOUS: f32 = 784.0;

pub fn show(ui: &mut Ui, model: &Model, workspace: &Workspace, commands: &mut Commands) {
    let width = ui.available_width();
    let wordy = width >= WORDY;
    if width < SPACIOUS {
        ui.spacing_mut().slider_width = 56.0;
    }
    ui.spacing_mut().item_spacing.x = 4.0;
    if width >= ROOMY {
        ui.horizontal(|ui| {
            tools(ui, &model.settings, workspace, wordy, commands);
            ui.separator();
            answer(ui, model, workspace, wordy, commands);
        });
    } else {
        ui.horizontal(|ui| tools(ui, &model.settings, workspace, wordy, commands));
        ui.horizontal(|ui| answer(ui, model, workspace, wordy, commands));
    }
}

/// What labels are drawn with, and where.
fn tools(ui: &mut Ui, settings: &Settings, workspace: &Workspace, wordy: bool, commands: &mut Commands) {
    crate::view3d::switch(ui, workspace, commands);
    ui.separator();
    for tool in Tool::ALL {
        let chosen = settings.tool == tool;
        let (icon, command) = match tool {
            Tool::Brush => (Icon::Brush, &BRUSH),
            Tool::Polyline => (Icon::Polyline, &POLYLINE),
            Tool::Polygon => (Icon::Polygon, &POLYGON),
            Tool::Erase => (Icon::Eraser, &ERASE),
            Tool::Select => (Icon::Select, &SELECT),
        };
        if icon_button_with(ui, icon, &command.named(ui.ctx()), chosen).clicked() {
            commands.push(Command::ChooseTool(tool));
        }
    }
    brush(ui, settings.brush, wordy, commands);
}

/// What is shown over the image, and on the right what takes labels back and fits the image.
fn answer(ui: &mut Ui, model: &Model, workspace: &Workspace, wordy: bool, commands: &mut Commands) {
    layers(ui, (&model.settings, model.is_compared()), wordy, commands);
    ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
        if icon_button(ui, Icon::Fit, &FIT.named(ui.ctx())).clicked() {
            commands.push(Command::Fit);
        }
        history(ui, workspace, commands);
    });
}

fn brush(ui: &mut Ui, mut radius: u32, wordy: bool, commands: &mut Commands) {
    ui.add_space(4.0);
    if wordy {
        ui.label("Brush");
    }
    let slider = Slider::new(&mut radius, 0..=LARGEST_BRUSH)
        .logarithmic(true)
        .show_value(false);
    let response = small_slider(ui, slider).accessible_name("Brush size");
    // A key may have been taken away.
    let mut keys = [&SMALLER_BRUSH, &LARGER_BRUSH]
        .map(|command| command.key(ui.ctx()))
        .to_vec();
    keys.retain(|key| !key.is_empty());
    keys.push("Ctrl+wheel".to_owned());
    let response = response.on_hover_text(format!("Brush radius in image pixels: {}", keys.join(", ")));
    if response.changed() {
        commands.push(Command::SetBrush(radius));
    }
    ui.add_sized([40.0, 20.0], egui::Label::new(format!("{radius} px")));
}

fn layers(ui: &mut Ui, (settings, compared): (&Settings, bool), wordy: bool, commands: &mut Commands) {
    if let Some(layer) = layer_menu(ui, "Layer", (settings.layer, compared), 152.0) {
        commands.push(Command::ChooseLayer(layer));
    }
    if icon_button_with(ui, Icon::Compare, &COMPARE.named(ui.ctx()), settings.compare).clicked() {
        commands.push(Command::ToggleCompare);
    }
    ui.add_space(4.0);
    if wordy {
        ui.label("Opacity");
    }
    let mut percent = settings.opacity * 100.0;
    let other = settings.compare && settings.other_layer.covers();
    ui.add_enabled_ui(settings.layer.covers() || other, |ui| {
        let slider = Slider::new(&mut percent, 0.0..=100.0).integer().show_value(false);
        let response = small_slider(ui, slider).accessible_name("Opacity");
        let response = response.on_disabled_hover_text("This layer does not lie over the image");
        if response.on_hover_text("Opacity of the layer").changed() {
            commands.push(Command::SetOpacity(percent / 100.0));
        }
    });
}

fn history(ui: &mut Ui, workspace: &Workspace, commands: &mut Commands) {
    let history = workspace.document.history();
    for (edit, command, icon) in [
        (history.redo_name(), &REDO, Icon::Redo),
        (history.undo_name(), &UNDO, Icon::Undo),
    ] {
        let text = match edit {
            Some(edit) => command.named_as(ui.ctx(), &format!("{} {edit}", command.name)),
            None => command.name.to_owned(),
        };
        ui.add_enabled_ui(edit.is_some(), |ui| {
            if icon_button(ui, icon, &text).clicked() {
                commands.push(command.command.clone());
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
