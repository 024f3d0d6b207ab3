//! The measurements, where they were asked for.

use egui::Ui;

use crate::state::AppState;

/// Draws the measurements in a small window.
pub fn show(ui: &Ui, state: &AppState) {
    let Some(stats) = &state.stats else {
        return;
    };
    egui::Window::new("Measurements")
        .anchor(egui::Align2::LEFT_BOTTOM, [248.0, -144.0])
        .resizable(false)
        .collapsible(true)
        .show(ui.ctx(), |ui| {
            egui::Grid::new("stats")
                .num_columns(5)
                .spacing([12.0, 4.0])
                .show(ui, |ui| {
                    for head in ["ms", "p50", "p95", "max", "n"] {
                        ui.weak(head);
                    }
                    ui.end_row();
                    for (name, samples) in [
                        ("own frame", &stats.frame),
                        ("eframe", &stats.reported),
                        ("click to overlay", &stats.click_to_overlay),
                    ] {
                        let summary = samples.summary();
                        ui.label(name);
                        for value in [summary.p50, summary.p95, summary.max] {
                            ui.monospace(format!("{value:.2}"));
                        }
                        ui.monospace(summary.count.to_string());
                        ui.end_row();
                    }
                });
        });
}
