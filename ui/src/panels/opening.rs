//! While something is being opened.

use egui::Ui;
use inplace_model::model::Opening;
use inplace_model::{Command, Commands};

use super::parts::frames_done;
use crate::widgets::long_work;

/// Draws how far opening has come.
pub fn show(ui: &mut Ui, opening: &Opening, commands: &mut Commands) {
    ui.add_space((ui.available_height() * 0.4).max(16.0));
    ui.vertical_centered(|ui| {
        ui.set_max_width(360.0);
        let (done, total) = opening.progress;
        let (share, words) = match total {
            0 => (None, "Looking at the files".to_owned()),
            _ => (Some(done as f32 / total as f32), frames_done(done, total)),
        };
        let title = format!("Opening {}", opening.target.name());
        if long_work(ui, &title, (share, &words), Some("Cancel")) {
            commands.push(Command::CloseScene);
        }
    });
}
