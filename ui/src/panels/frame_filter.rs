//! The row above the filmstrip: which frames, in which order, and going to one by its number or name.

use egui::{Align, Color32, Key, Layout, TextEdit, TextStyle, Ui};
use inplace_model::frames::{FrameFilter, FrameOrder};
use inplace_model::workspace::Workspace;
use inplace_model::{Command, Commands};

use crate::widgets::choice_box;

/// Width of what stands beside the filters; where they do not fit, they are a list to choose from.
const BESIDE: f32 = ORDER + SEEK + 2.0 * crate::theme::GAP;
const ORDER: f32 = 124.0;
const SEEK: f32 = 108.0;
/// Space between two filters.
const SPACE: f32 = 4.0;

/// The row with what is being typed.
#[derive(Debug, Default)]
pub struct FrameFilterRow {
    sought: String,
}

impl FrameFilterRow {
    pub fn show(&mut self, ui: &mut Ui, workspace: &Workspace, commands: &mut Commands) {
        // Where there is little room, each of the three has a third of it.
        let third = (ui.available_width() - 2.0 * crate::theme::GAP) / 3.0;
        let frames = &workspace.overview.frames;
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = SPACE;
            // Rarely does anything disagree.
            let is_shown = |filter: &FrameFilter| {
                let is_rare = *filter == FrameFilter::Disagreeing;
                !is_rare || frames.filter == *filter || frames.count(*filter) > 0
            };
            let shown = FrameFilter::ALL.into_iter().filter(is_shown);
            let counted = |filter| format!("{} {}", named(filter).0, frames.count(filter));
            let width = |filter| {
                let font = TextStyle::Button.resolve(ui.style());
                let text = ui.painter().layout_no_wrap(counted(filter), font, Color32::WHITE);
                text.size().x + 2.0 * ui.spacing().button_padding.x + SPACE
            };
            let is_roomy = ui.available_width() >= BESIDE + shown.clone().map(width).sum::<f32>();
            let filters = |ui: &mut Ui, commands: &mut Commands| {
                for filter in shown {
                    let choice = ui.selectable_label(frames.filter == filter, counted(filter));
                    if choice.on_hover_text(named(filter).1).clicked() {
                        commands.push(Command::FilterFrames(filter));
                    }
                }
            };
            if is_roomy {
                filters(ui, commands);
            } else {
                let (width, chosen) = (third.min(132.0), counted(frames.filter));
                choice_box(ui, "Frames shown", width, chosen, |ui| filters(ui, commands));
            }
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                ui.spacing_mut().item_spacing.x = crate::theme::GAP;
                self.seek(ui, third, commands);
                let compared = workspace.comparison.is_some();
                order(ui, third, (frames.order, compared), commands);
            });
        });
    }

    fn seek(&mut self, ui: &mut Ui, most: f32, commands: &mut Commands) {
        let field = TextEdit::singleline(&mut self.sought)
            .hint_text("Go to frame")
            .align(egui::Align2::LEFT_CENTER)
            .min_size(egui::vec2(0.0, ui.spacing().interact_size.y))
            .desired_width(most.min(SEEK));
        let response = ui.add(field).accessible_name("Go to frame");
        let entered = response.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
        response.on_hover_text("A frame's number or name, or a part of the name; Enter goes there");
        if entered {
            commands.push(Command::FindFrame(std::mem::take(&mut self.sought)));
        }
    }
}

fn order(ui: &mut Ui, most: f32, (chosen, compared): (FrameOrder, bool), commands: &mut Commands) {
    let (width, text) = (most.min(ORDER), order_text(chosen));
    choice_box(ui, "Order of the frames", width, text, |ui| {
        for order in FrameOrder::present(compared) {
            // The one in force, too: by what is known of the frames, that sorts anew.
            if ui.selectable_label(order == chosen, order_text(order)).clicked() {
                commands.push(Command::OrderFrames(order));
            }
        }
    });
}

/// A filter's name, and what it lets through.
fn named(filter: FrameFilter) -> (&'static str, &'static str) {
    match filter {
        FrameFilter::All => ("All", "All frames"),
        FrameFilter::Unlabelled => ("Unlabelled", "Frames without strokes"),
        FrameFilter::Uncertain => ("Uncertain", "Frames with more than 5% of unclear pixels"),
        FrameFilter::Disagreeing => (
            "Disagreeing",
            "Frames with strokes that the others contradict, or whose imported labels differ from the map on more than 10% of the pixels",
        ),
        FrameFilter::Unchecked => ("Unchecked", "Frames that are not marked as checked"),
    }
}

/// An order's name.
fn order_text(order: FrameOrder) -> &'static str {
    match order {
        FrameOrder::Capture => "In order",
        FrameOrder::Uncertainty => "Uncertain first",
        FrameOrder::Difference => "Different first",
    }
}
