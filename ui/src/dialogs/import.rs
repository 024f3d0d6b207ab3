//! The dialog that imports label images.

use std::path::PathBuf;

use egui::{Slider, Ui};
use inplace_core::labels::Trust;

use super::{Purpose, confirm, path_field};
use crate::action::{Action, Actions};
use crate::english::{dialogs as words, progress};

/// From one trust to the next, in per cent.
const STEP: f64 = 5.0;

/// Asks for the folder, and how far its pixels can be believed.
pub(super) fn show(ui: &mut Ui, path: &mut String, trust: &mut Trust, actions: &mut Actions) {
    ui.label(words::IMPORT_EXPLAINED);
    let entered = path_field(ui, path, words::IMPORT_FOLDER);
    if ui.button(words::BROWSE).clicked() {
        actions.push(Action::Browse(Purpose::Import));
    }
    ui.add_space(4.0);
    ui.horizontal(|ui| {
        ui.label(words::TRUST);
        let mut percent = 100.0 * trust.value();
        let slider = Slider::new(&mut percent, 0.0..=100.0)
            .step_by(STEP)
            .show_value(false);
        let response = ui.add(slider).accessible_name(words::TRUST_NAME);
        if response.changed()
            && let Some(chosen) = Trust::new(percent / 100.0)
        {
            *trust = chosen;
        }
        ui.label(progress::percent(trust.value()));
    });
    ui.label(words::trust(*trust));
    let path = path.trim();
    confirm(ui, words::IMPORT_NOW, !path.is_empty(), entered, actions, || {
        Action::ImportFrom(PathBuf::from(path), *trust)
    });
}
