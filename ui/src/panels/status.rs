//! How training goes.

use egui::Ui;
use inplace_core::session::{Phase, Status};
use inplace_model::preferences::Pane;
use inplace_model::text::counted;
use inplace_model::workspace::{Reading, Workspace};
use inplace_model::{Command, Commands};

use super::parts::{Fact, UNCERTAINTY_MEANS, facts, fold_button, frames_done};
use crate::keys::table::PAUSE;
use crate::numbers;
use crate::theme;
use crate::widgets::{Icon, heading, icon_button};

/// Draws the status: in full, or in one line.
pub fn show(ui: &mut Ui, workspace: &Workspace, full: bool, commands: &mut Commands) {
    let running = !workspace.paused && !workspace.ended;
    let accent = theme::of(ui.visuals()).accent;
    let phase = egui::RichText::new(match workspace.reading {
        Some(Reading::Depth(share)) => format!("Estimating depth: {:.0}%", 100.0 * share),
        Some(Reading::Frames(0, _)) => "Reading the frames".to_owned(),
        Some(Reading::Frames(done, total)) => format!("Reading: {}", frames_done(done, total)),
        None => match (workspace.phase_in_words(), workspace.status.phase) {
            (words, Phase::Estimating { percent }) if running => format!("{words}: {percent}%"),
            (words, _) => words.to_owned(),
        },
    });
    let phase = if running {
        phase.color(accent)
    } else {
        phase.weak()
    };
    let phase = egui::Label::new(phase).truncate();
    let most = workspace.document.palette().most_entropy();
    if !full {
        ui.horizontal(|ui| {
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                controls(ui, workspace, full, commands);
                ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
                    ui.add(phase);
                    let summary = summary(&workspace.status, most);
                    if !summary.is_empty() {
                        ui.add(egui::Label::new(egui::RichText::new(summary).weak()).truncate());
                    }
                });
            });
        });
        return;
    }
    heading(ui, "Training", |ui| {
        controls(ui, workspace, full, commands);
        ui.add(phase);
    });
    facts(ui, "status", 112.0, rows(&workspace.status, most));
}

/// The buttons at the right end of the first line.
fn controls(ui: &mut Ui, workspace: &Workspace, full: bool, commands: &mut Commands) {
    let name = if full {
        "Fold the training"
    } else {
        "Show the training in full"
    };
    fold_button(ui, Pane::Training, full, name, commands);
    let (icon, name) = if workspace.paused {
        (Icon::Play, "Resume training")
    } else {
        (Icon::Pause, "Pause training")
    };
    ui.add_enabled_ui(!workspace.ended, |ui| {
        if icon_button(ui, icon, &PAUSE.named_as(ui.ctx(), name)).clicked() {
            commands.push(Command::TogglePause);
        }
    });
}

/// What matters most of the rows, as far as it is known, first what must not be cut off; nothing while depth is estimated,
/// which fills the line.
fn summary(status: &Status, most: f32) -> String {
    if matches!(status.phase, Phase::Estimating { .. }) {
        return String::new();
    }
    // Without any labels nothing is unsure.
    let uncertainty = status.mean_entropy.filter(|&entropy| entropy > 0.0);
    let uncertainty = uncertainty.map(|entropy| numbers::unsure(entropy, most));
    let quality = status.held_out_psnr.map(|db| numbers::decibels(db.into()));
    let known: Vec<String> = uncertainty.into_iter().chain(quality).collect();
    known.join(", ")
}

fn rows(status: &Status, most: f32) -> [Fact; 7] {
    [
        (
            "Steps",
            Some(grouped(status.steps)),
            "Training steps of the field that learns the scene's shape and colour",
        ),
        (
            "Time",
            Some(numbers::duration(status.geometry_seconds)),
            "Time spent training",
        ),
        (
            "Image quality",
            status.held_out_psnr.map(|db| numbers::decibels(db.into())),
            "How well the field predicts frames that it was not trained on (PSNR); more is better",
        ),
        (
            "Depth error",
            status
                .depth_error
                .map(|metres| format!("{:.1} cm", 100.0 * metres)),
            "Median error of the field's depth where the capture has measured depth",
        ),
        (
            "Uncertainty",
            status.mean_entropy.map(|entropy| numbers::unsure(entropy, most)),
            UNCERTAINTY_MEANS,
        ),
        (
            "Model",
            (!status.capacity.is_empty()).then(|| status.capacity.clone()),
            "The size that was chosen for this scene",
        ),
        (
            "Mishaps",
            Some(match (status.skipped_steps, status.undone) {
                (0, 0) => "none".to_owned(),
                (skipped, undone) => format!(
                    "{} left out, {}",
                    counted(skipped as usize, "step", "steps"),
                    counted(undone as usize, "return", "returns")
                ),
            }),
            "Steps that were left out because a number in them was not finite, and returns to an earlier state of the model, at half the learning rate",
        ),
    ]
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
