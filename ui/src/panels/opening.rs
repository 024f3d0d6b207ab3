//! While something is being opened.

use egui::Ui;

use crate::action::{Action, Actions};
use crate::state::Opening;

/// Draws how far opening has come.
pub fn show(ui: &mut Ui, opening: &Opening, actions: &mut Actions) {
    ui.add_space((ui.available_height() * 0.4).max(16.0));
    ui.vertical_centered(|ui| {
        ui.set_max_width(360.0);
        ui.heading(format!("Opening {}", opening.target.name()));
        let (done, total) = opening.progress;
        let bar = if total > 0 {
            egui::ProgressBar::new(done as f32 / total as f32).text(format!("{done} of {total} frames"))
        } else {
            egui::ProgressBar::new(0.0).text("Looking at the files")
        };
        ui.add(bar.desired_height(20.0));
        ui.add_space(8.0);
        if ui.button("Cancel").clicked() {
            actions.push(Action::CloseScene);
        }
    });
}
