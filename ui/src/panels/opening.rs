//! While something is being opened.

use egui::Ui;

use crate::action::{Action, Actions};
use crate::english::opening as words;
use crate::state::Opening;

/// Draws how far opening has come.
pub fn show(ui: &mut Ui, opening: &Opening, actions: &mut Actions) {
    ui.add_space((ui.available_height() * 0.4).max(16.0));
    ui.vertical_centered(|ui| {
        ui.set_max_width(360.0);
        let heading = egui::RichText::new(words::opening(&opening.target.name())).heading();
        ui.add(egui::Label::new(heading).truncate());
        let (done, total) = opening.progress;
        let share = done as f32 / total.max(1) as f32;
        ui.add(egui::ProgressBar::new(share).desired_height(8.0));
        ui.weak(words::progress(done, total));
        ui.add_space(8.0);
        if ui.button("Cancel").clicked() {
            actions.push(Action::CloseScene);
        }
    });
}
