//! While something is being opened.

use egui::Ui;

use crate::action::{Action, Actions};
use crate::english::{dialogs, work};
use crate::state::Opening;
use crate::widgets::long_work;

/// Draws how far opening has come.
pub fn show(ui: &mut Ui, opening: &Opening, actions: &mut Actions) {
    ui.add_space((ui.available_height() * 0.4).max(16.0));
    ui.vertical_centered(|ui| {
        ui.set_max_width(360.0);
        let (done, total) = opening.progress;
        let (share, words) = match total {
            0 => (None, work::LOOKING.to_owned()),
            _ => (Some(done as f32 / total as f32), work::frames(done, total)),
        };
        let title = work::opening(&opening.target.name());
        if long_work(ui, &title, (share, &words), Some(dialogs::CANCEL)) {
            actions.push(Action::CloseScene);
        }
    });
}
