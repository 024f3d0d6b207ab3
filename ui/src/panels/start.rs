//! The start page: nothing is open.

use std::path::PathBuf;

use egui::{Key, Ui};
use inplace_core::scene::SceneSource;

use crate::action::{Action, Actions};
use crate::dialogs::Purpose;
use crate::widgets::{main_button, main_button_enabled};

/// The start page with the path typed so far.
#[derive(Debug, Default)]
pub struct StartPage {
    path: String,
}

impl StartPage {
    /// Draws the page in the middle of the window.
    pub fn show(&mut self, ui: &mut Ui, actions: &mut Actions) {
        let height = 400.0;
        ui.add_space(((ui.available_height() - height) * 0.45).max(16.0));
        ui.vertical_centered(|ui| {
            ui.set_max_width(480.0);
            ui.label(egui::RichText::new("Inplace").size(36.0).strong());
            ui.label(
                egui::RichText::new("Label a whole scene from a few clicks")
                    .size(16.0)
                    .weak(),
            );
            ui.add_space(24.0);
            super::card(ui).inner_margin(24).show(ui, |ui| {
                ui.with_layout(egui::Layout::top_down(egui::Align::Min), |ui| {
                    self.choices(ui, actions);
                });
            });
            ui.add_space(16.0);
            ui.weak("Or drop a folder or a project file onto this window.");
        });
    }

    fn choices(&mut self, ui: &mut Ui, actions: &mut Actions) {
        ui.horizontal(|ui| {
            if main_button(ui, "Open a folder...").clicked() {
                actions.push(Action::Browse(Purpose::Scene));
            }
            if ui.button("Open a project...").clicked() {
                actions.push(Action::Browse(Purpose::Project));
            }
            if ui.button("Try the demo").clicked() {
                actions.push(Action::OpenScene(SceneSource::Demo));
            }
        });
        ui.add_space(4.0);
        let mut open = false;
        ui.horizontal(|ui| {
            let field = egui::TextEdit::singleline(&mut self.path)
                .hint_text("or type a path: /data/room, /work/room.inplace")
                .margin(egui::vec2(8.0, 6.0))
                .desired_width(ui.available_width() - 72.0);
            let response = ui.add(field).accessible_name("Path to open");
            open = response.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
            let typed = !self.path.trim().is_empty();
            open |= main_button_enabled(ui, typed, "Open").clicked();
        });
        if open && !self.path.trim().is_empty() {
            actions.push(Action::OpenPath(PathBuf::from(self.path.trim())));
        }
        ui.add_space(8.0);
        ui.label("What can be opened");
        ui.add(
            egui::Label::new(
                egui::RichText::new(
                    "A folder with posed colour images of one scene, with or without depth, in the \
                     Replica / Semantic-NeRF layout: rgb/, depth/, and traj_w_c.txt. Or one with a \
                     COLMAP model: images/ and sparse/. Or a project file (.inplace) that was saved \
                     here.",
                )
                .weak(),
            )
            .wrap(),
        );
    }
}
