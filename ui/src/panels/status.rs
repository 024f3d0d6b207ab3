//! How training goes.

use egui::Ui;
use inplace_core::session::Status;

use crate::action::{Action, Actions};
use crate::english::layout;
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
                    ui.add(
                        egui::Label::new(egui::RichText::new(summary(workspace.status())).weak()).truncate(),
                    );
                });
            });
        });
        return;
    }
    heading(ui, "Training", |ui| {
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
        (Icon::Play, "Resume training (P)")
    } else {
        (Icon::Pause, "Pause training (P)")
    };
    ui.add_enabled_ui(!workspace.has_ended(), |ui| {
        if icon_button(ui, icon, name).clicked() {
            actions.push(Action::TogglePause);
        }
    });
}

/// What matters most of the rows, as far as it is known.
fn summary(status: &Status) -> String {
    let quality = status.held_out_psnr.map(decibels);
    let uncertainty = status.mean_entropy.map(nats);
    quality
        .into_iter()
        .chain(uncertainty)
        .collect::<Vec<_>>()
        .join(", ")
}

fn decibels(db: f32) -> String {
    format!("{db:.1} dB")
}

fn nats(nats: f32) -> String {
    format!("{nats:.2} nats")
}

fn rows(status: &Status) -> [(&'static str, String, &'static str); 7] {
    let unknown = || "not known yet".to_owned();
    [
        (
            "Steps",
            grouped(status.steps),
            "Training steps of the field that learns the scene's shape and colour",
        ),
        (
            "Time",
            duration(status.geometry_seconds as f32),
            "Time spent training",
        ),
        (
            "Image quality",
            status.held_out_psnr.map_or_else(unknown, decibels),
            "How well the field predicts frames that it was not trained on (PSNR); more is better",
        ),
        (
            "Depth error",
            status
                .depth_error
                .map_or_else(unknown, |m| format!("{:.1} cm", 100.0 * m)),
            "Median error of the field's depth where the capture has measured depth",
        ),
        (
            "Uncertainty",
            status.mean_entropy.map_or_else(unknown, nats),
            "Mean entropy of all pixels of all frames; less is surer",
        ),
        (
            "Model",
            if status.capacity.is_empty() {
                unknown()
            } else {
                status.capacity.clone()
            },
            "The size that was chosen for this scene",
        ),
        (
            "Mishaps",
            mishaps(status.skipped_steps, status.undone),
            "Steps that were left out because a number in them was not finite, and returns to an earlier state of the model, at half the learning rate",
        ),
    ]
}

fn mishaps(skipped: u64, undone: u64) -> String {
    match (skipped, undone) {
        (0, 0) => "none".to_owned(),
        _ => format!("{} steps left out, {undone} returns", grouped(skipped)),
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

fn duration(seconds: f32) -> String {
    let seconds = seconds.max(0.0) as u64;
    if seconds < 60 {
        format!("{seconds} s")
    } else {
        format!("{} min {:02} s", seconds / 60, seconds % 60)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_times_are_readable() {
        assert_eq!(grouped(7), "7");
        assert_eq!(grouped(1_234_567), "1 234 567");
        assert_eq!(duration(59.9), "59 s");
        assert_eq!(duration(61.0), "1 min 01 s");
    }
}
