//! How training goes.

use egui::Ui;
use inplace_core::session::Status;

use crate::action::{Action, Actions};
use crate::english::{layers, layout, progress, status as words};
use crate::preferences::Pane;
use crate::theme;
use crate::widgets::{Icon, heading, icon_button};
use crate::workspace::Workspace;

/// Draws the status: in full, or in one line.
pub fn show(ui: &mut Ui, workspace: &Workspace, full: bool, actions: &mut Actions) {
    let running = !workspace.is_paused() && !workspace.has_ended();
    let accent = theme::accent(ui.visuals());
    let phase = egui::RichText::new(workspace.phase_in_words());
    let phase = if running {
        phase.color(accent)
    } else {
        phase.weak()
    };
    if !full {
        ui.horizontal(|ui| {
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                controls(ui, workspace, full, actions);
                ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
                    ui.label(phase);
                    let summary = summary(workspace.status());
                    if !summary.is_empty() {
                        ui.add(egui::Label::new(egui::RichText::new(summary).weak()).truncate());
                    }
                });
            });
        });
        return;
    }
    heading(ui, words::HEADING, |ui| {
        controls(ui, workspace, full, actions);
        ui.label(phase);
    });
    egui::Grid::new("status")
        .num_columns(2)
        .spacing([16.0, 4.0])
        .min_col_width(112.0)
        .min_row_height(20.0)
        .show(ui, |ui| {
            for (name, value, explanation) in rows(workspace.status()) {
                ui.weak(name).on_hover_text(explanation);
                ui.add(egui::Label::new(value).truncate());
                ui.end_row();
            }
        });
}

/// The buttons at the right end of the first line.
fn controls(ui: &mut Ui, workspace: &Workspace, full: bool, actions: &mut Actions) {
    let name = if full {
        layout::FOLD_TRAINING
    } else {
        layout::UNFOLD_TRAINING
    };
    super::fold_button(ui, Pane::Training, full, name, actions);
    let (icon, name) = if workspace.is_paused() {
        (Icon::Play, words::RESUME)
    } else {
        (Icon::Pause, words::PAUSE)
    };
    ui.add_enabled_ui(!workspace.has_ended(), |ui| {
        if icon_button(ui, icon, name).clicked() {
            actions.push(Action::TogglePause);
        }
    });
}

/// What matters most of the rows, as far as it is known.
fn summary(status: &Status) -> String {
    let quality = status.held_out_psnr.map(|db| progress::decibels(db.into()));
    let uncertainty = status.mean_entropy.map(layers::nats);
    quality
        .into_iter()
        .chain(uncertainty)
        .collect::<Vec<_>>()
        .join(", ")
}

fn rows(status: &Status) -> [(&'static str, String, &'static str); 7] {
    let unknown = || progress::UNKNOWN.to_owned();
    [
        (words::STEPS, grouped(status.steps), words::STEPS_MEAN),
        (
            words::TIME,
            progress::duration(status.geometry_seconds),
            words::TIME_MEANS,
        ),
        (
            progress::QUALITY,
            status
                .held_out_psnr
                .map_or_else(unknown, |db| progress::decibels(db.into())),
            progress::QUALITY_MEANS,
        ),
        (
            words::DEPTH_ERROR,
            status.depth_error.map_or_else(unknown, words::centimetres),
            words::DEPTH_ERROR_MEANS,
        ),
        (
            progress::UNCERTAINTY,
            status.mean_entropy.map_or_else(unknown, layers::nats),
            progress::UNCERTAINTY_MEANS,
        ),
        (
            words::MODEL,
            if status.capacity.is_empty() {
                unknown()
            } else {
                status.capacity.clone()
            },
            words::MODEL_MEANS,
        ),
        (
            words::MISHAPS,
            mishaps(status.skipped_steps, status.undone),
            words::MISHAPS_MEAN,
        ),
    ]
}

fn mishaps(skipped: u64, undone: u64) -> String {
    match (skipped, undone) {
        (0, 0) => words::NO_MISHAPS.to_owned(),
        _ => words::mishaps(&grouped(skipped), undone),
    }
}

/// A number with its thousands apart.
fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_numbers_are_readable() {
        assert_eq!(grouped(7), "7");
        assert_eq!(grouped(1_234_567), "1 234 567");
    }
}
