//! The row above the filmstrip: which frames, in which order, and going to one by its number or name.

use egui::{Align, ComboBox, Key, Layout, TextEdit, Ui};

use crate::action::{Action, Actions};
use crate::english::frames as words;
use crate::frames::{FrameFilter, FrameOrder};
use crate::workspace::Workspace;

/// Below this width the filters are a list to choose from.
const ROOMY: f32 = 620.0;

/// The row with what is being typed.
#[derive(Debug, Default)]
pub struct FrameFilterRow {
    sought: String,
}

impl FrameFilterRow {
    /// Draws the row.
    pub fn show(&mut self, ui: &mut Ui, workspace: &Workspace, actions: &mut Actions) {
        // Where there is little room, each of the three has a third of it.
        let third = (ui.available_width() - 2.0 * crate::theme::GAP) / 3.0;
        let frames = workspace.overview().frames();
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            let filters = |ui: &mut Ui, actions: &mut Actions| {
                for filter in FrameFilter::ALL {
                    let name = named(filter, frames.count(filter));
                    let choice = ui.selectable_label(frames.filter() == filter, name);
                    if choice.on_hover_text(words::filter_means(filter)).clicked() {
                        actions.push(Action::FilterFrames(filter));
                    }
                }
            };
            if ui.available_width() >= ROOMY {
                filters(ui, actions);
            } else {
                let chosen = frames.filter();
                ComboBox::from_id_salt("filter")
                    .selected_text(named(chosen, frames.count(chosen)))
                    .width(third.min(132.0))
                    .truncate()
                    .show_ui(ui, |ui| filters(ui, actions))
                    .response
                    .accessible_name(words::FILTER);
            }
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                ui.spacing_mut().item_spacing.x = crate::theme::GAP;
                self.seek(ui, third, actions);
                order(ui, third, frames.order(), actions);
            });
        });
    }

    fn seek(&mut self, ui: &mut Ui, most: f32, actions: &mut Actions) {
        let field = TextEdit::singleline(&mut self.sought)
            .hint_text(words::GO_TO)
            .align(egui::Align2::LEFT_CENTER)
            .min_size(egui::vec2(0.0, ui.spacing().interact_size.y))
            .desired_width(most.min(136.0));
        let response = ui.add(field).accessible_name(words::GO_TO);
        let entered = response.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
        response.on_hover_text(words::GO_TO_MEANS);
        if entered {
            actions.push(Action::FindFrame(std::mem::take(&mut self.sought)));
        }
    }
}

fn order(ui: &mut Ui, most: f32, chosen: FrameOrder, actions: &mut Actions) {
    ComboBox::from_id_salt("order")
        .selected_text(words::order(chosen))
        .width(most.min(148.0))
        .truncate()
        .show_ui(ui, |ui| {
            for order in FrameOrder::ALL {
                // The one in force, too: by uncertainty, that sorts anew.
                if ui
                    .selectable_label(order == chosen, words::order(order))
                    .clicked()
                {
                    actions.push(Action::OrderFrames(order));
                }
            }
        })
        .response
        .accessible_name(words::ORDER);
}

fn named(filter: FrameFilter, count: usize) -> String {
    format!("{} {count}", words::filter(filter))
}
