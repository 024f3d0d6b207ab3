//! The dialog that imports label images.

use std::path::PathBuf;

use egui::{Slider, Ui};
use inplace_core::labels::Trust;
use inplace_model::dialogs::Purpose;
use inplace_model::{Command, Commands};

use super::form::{confirm, path_field};
use crate::numbers;

/// From one trust to the next, in per cent.
const STEP: f64 = 5.0;

/// Asks for the folder, and how far its pixels can be believed.
pub(super) fn show(ui: &mut Ui, path: &mut String, trust: &mut Trust, commands: &mut Commands) {
    ui.label("A folder of files named like the frames, such as a network's predictions or an earlier export: PNGs with class ids or colours, or NPYs or NPZs with probabilities. Pixels that may be wrong are outvoted where many disagree.");
    let entered = path_field(ui, path, "Folder of label images");
    if ui.button("Browse...").clicked() {
        commands.push(Command::Browse(Purpose::Import));
    }
    ui.add_space(4.0);
    ui.horizontal(|ui| {
        ui.label("Trust");
        let mut percent = 100.0 * trust.value();
        let slider = Slider::new(&mut percent, 0.0..=100.0)
            .step_by(STEP)
            .show_value(false);
        let response = ui.add(slider).accessible_name("Trust in the imported pixels");
        if response.changed()
            && let Some(chosen) = Trust::new(percent / 100.0)
        {
            *trust = chosen;
        }
        ui.label(numbers::share(trust.value()));
    });
    ui.label(meaning(*trust));
    let path = path.trim();
    confirm(ui, "Import", !path.is_empty(), entered, commands, || {
        Command::ImportFrom(PathBuf::from(path), *trust)
    });
}

/// What a trust means.
fn meaning(trust: Trust) -> &'static str {
    match trust.value() {
        1.0 => "Every labelled pixel is right, as your strokes are.",
        above if above > 0.6 => "Mostly right: your strokes correct them close by.",
        about if about >= 0.4 => {
            "They may be wrong: your strokes correct them on what they are connected with."
        }
        below if below > 0.0 => "Often wrong: your strokes correct them from afar, too.",
        _ => "They only fill in what none of your strokes leads to.",
    }
}
