//! Work in the background that takes a while, and what came of it: exporting and importing.

use egui::{Align2, Area, Id, Order, Ui, vec2};

use crate::action::{Action, Actions};
use crate::english::{dialogs, work};
use crate::exporting::Progress;
use crate::state::AppState;
use crate::widgets::long_work;

/// Draws what is under way, and where the last export went, over the upper right corner of `area`.
pub fn show(ctx: &egui::Context, state: &AppState, area: egui::Rect, actions: &mut Actions) {
    let spreading = state
        .workspace()
        .is_some_and(|workspace| workspace.status().spreading_import);
    let importing = state.importing.is_some() || spreading;
    if state.export.is_none() && !importing {
        return;
    }
    Area::new(Id::unique("work"))
        .order(Order::Foreground)
        .pivot(Align2::RIGHT_TOP)
        .fixed_pos(area.right_top() + vec2(-16.0, 16.0))
        .show(ctx, |ui| {
            let width = (area.width() - 64.0).clamp(160.0, 360.0);
            if let Some(progress) = &state.export {
                note(ui, width, |ui| export(ui, state, progress, actions));
            }
            if importing {
                note(ui, width, |ui| import(ui, state.importing.is_some(), actions));
            }
        });
}

fn note(ui: &mut Ui, width: f32, content: impl FnOnce(&mut Ui)) {
    egui::Frame::popup(ui.style()).inner_margin(16).show(ui, |ui| {
        ui.set_width(width);
        content(ui);
    });
}

fn export(ui: &mut Ui, state: &AppState, progress: &Progress, actions: &mut Actions) {
    match progress {
        Progress::Writing(done, total) => {
            let share = *done as f32 / (*total).max(1) as f32;
            let (share, words) = match done {
                _ if state.stopping_export => (Some(share), work::STOPPING.to_owned()),
                0 if state.export_choice.format.has_frames() => (None, work::WAITING_FOR_MAPS.to_owned()),
                0 => (None, work::MAKING_SURFACE.to_owned()),
                _ => (Some(share), work::frames(*done, *total)),
            };
            let cancel = (!state.stopping_export).then_some(work::CANCEL_EXPORT);
            if long_work(ui, work::EXPORTING, (share, &words), cancel) {
                actions.push(Action::CancelExport);
            }
        }
        Progress::Finished(folder, frames, format) => {
            ui.strong(work::exported(*frames, *format));
            let path = folder.display().to_string();
            ui.add(egui::Label::new(egui::RichText::new(&path).monospace()).wrap());
            ui.weak(crate::english::export::files(*format));
            ui.horizontal_wrapped(|ui| {
                if ui.button(work::OPEN_FOLDER).clicked() {
                    actions.push(Action::ShowFolder(folder.clone()));
                }
                if ui.button(work::COPY_PATH).clicked() {
                    actions.push(Action::Copy(path));
                }
                if ui.button(dialogs::CLOSE).clicked() {
                    actions.push(Action::DismissExport);
                }
            });
        }
        // The messages say these.
        Progress::Cancelled(..) | Progress::Failed(_) => {}
    }
}

/// The images are being read, or else spread.
fn import(ui: &mut Ui, reading: bool, actions: &mut Actions) {
    let words = if reading { work::READING } else { work::SPREADING };
    let cancel = reading.then_some(work::CANCEL_IMPORT);
    if long_work(ui, work::IMPORTING, (None, words), cancel) {
        actions.push(Action::CancelImport);
    }
}
