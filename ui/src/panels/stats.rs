//! The measurements, where they were asked for.

use egui::{Align2, Area, Id, Rect, TextStyle, Ui, vec2};

use crate::stats::Stats;

/// Heads of the table's columns.
const HEADS: [&str; 5] = ["milliseconds", "p50", "p95", "max", "n"];

/// Draws the measurements over the lower right corner of the canvas.
pub fn show(ctx: &egui::Context, stats: &Stats, canvas: Rect) {
    Area::new(Id::unique("measurements"))
        .pivot(Align2::RIGHT_BOTTOM)
        .fixed_pos(canvas.right_bottom() + vec2(-12.0, -12.0))
        .interactable(false)
        .show(ctx, |ui| {
            egui::Frame::popup(ui.style()).show(ui, |ui| table(ui, stats));
        });
}

fn table(ui: &mut Ui, stats: &Stats) {
    ui.style_mut().override_text_style = Some(TextStyle::Small);
    egui::Grid::new("stats")
        .num_columns(5)
        .spacing([12.0, 2.0])
        .min_row_height(16.0)
        .show(ui, |ui| {
            for head in HEADS {
                ui.weak(head);
            }
            ui.end_row();
            for (name, samples) in [
                ("presented frames", &stats.presented),
                ("click to presented", &stats.click_to_presented),
                ("hover to outline", &stats.hover_to_presented),
                ("window's thread", &stats.thread),
            ] {
                let summary = samples.summary();
                ui.label(name);
                for value in [summary.p50, summary.p95, summary.max] {
                    ui.label(format!("{value:.1}"));
                }
                ui.label(summary.count.to_string());
                ui.end_row();
            }
        });
}
