//! Work in the background that takes a while, and what came of it: opening, exporting, importing and reading a project to
//! compare with.

use egui::{Align2, Area, Id, Order, Ui, vec2};
use inplace_core::export::Format;
use inplace_model::exporting::ExportProgress;
use inplace_model::model::Opening;
use inplace_model::text::counted;
use inplace_model::{Command, Commands, Model};

use super::parts::frames_done;
use crate::widgets::long_work;

/// Draws what is under way, and where the last export went, over the upper right corner of `area`.
pub fn show(ctx: &egui::Context, model: &Model, area: egui::Rect, commands: &mut Commands) {
    let spreading = model
        .workspace()
        .is_some_and(|workspace| workspace.status.spreading_import);
    let importing = model.importing.is_some() || spreading;
    if model.export.is_none() && !importing && model.beginning_comparison.is_none() {
        return;
    }
    Area::new(Id::unique("work"))
        .order(Order::Foreground)
        .pivot(Align2::RIGHT_TOP)
        .fixed_pos(area.right_top() + vec2(-16.0, 16.0))
        .show(ctx, |ui| {
            let width = (area.width() - 64.0).clamp(160.0, 360.0);
            if let Some(progress) = &model.export {
                note(ui, width, |ui| export(ui, model, progress, commands));
            }
            if importing {
                note(ui, width, |ui| import(ui, model.importing.is_some(), commands));
            }
            if let Some(beginning) = &model.beginning_comparison {
                note(ui, width, |ui| {
                    let title = format!("Comparing with {}", beginning.name);
                    if long_work(ui, &title, (None, &beginning.words), Some("Cancel comparison")) {
                        commands.push(Command::CancelComparison);
                    }
                });
            }
        });
}

fn note(ui: &mut Ui, width: f32, content: impl FnOnce(&mut Ui)) {
    egui::Frame::popup(ui.style()).inner_margin(16).show(ui, |ui| {
        ui.set_width(width);
        content(ui);
    });
}

fn export(ui: &mut Ui, model: &Model, progress: &ExportProgress, commands: &mut Commands) {
    match progress {
        ExportProgress::Writing(done, total) => {
            let share = *done as f32 / (*total).max(1) as f32;
            let (share, words) = match done {
                _ if model.stopping_export => (Some(share), "Stopping".to_owned()),
                0 if model.export_choice.format.has_frames() => (None, "Getting the newest maps".to_owned()),
                0 => (None, "Making the surface from the newest maps".to_owned()),
                _ => (Some(share), frames_done(*done, *total)),
            };
            let cancel = (!model.stopping_export).then_some("Cancel export");
            if long_work(ui, "Exporting", (share, &words), cancel) {
                commands.push(Command::CancelExport);
            }
        }
        ExportProgress::Finished(folder, frames, format) => {
            ui.strong(match format.has_frames() {
                true => format!("Exported {}", counted(*frames, "frame", "frames")),
                false => "Exported the surface".to_owned(),
            });
            let path = folder.display().to_string();
            ui.add(egui::Label::new(egui::RichText::new(&path).monospace()).wrap());
            ui.weak(files(*format));
            ui.horizontal_wrapped(|ui| {
                if ui.button("Open folder").clicked() {
                    commands.push(Command::ShowFolder(folder.clone()));
                }
                if ui.button("Copy path").clicked() {
                    ui.ctx().copy_text(path);
                }
                if ui.button("Close").clicked() {
                    commands.push(Command::DismissExport);
                }
            });
        }
        // The messages say these.
        ExportProgress::Cancelled(..) | ExportProgress::Failed(_) => {}
    }
}

/// The images are being read, or else spread.
fn import(ui: &mut Ui, reading: bool, commands: &mut Commands) {
    let words = if reading {
        "Reading the label images"
    } else {
        "Spreading them over the scene"
    };
    let cancel = reading.then_some("Cancel import");
    if long_work(ui, "Importing labels", (None, words), cancel) {
        commands.push(Command::CancelImport);
    }
}

/// What is in the folder of an export, beside the strokes.
fn files(format: Format) -> &'static str {
    match format {
        Format::Png => "labels, entropy, color and objects as PNGs; classes.json; strokes.json",
        Format::Overlay => "overlay as JPEGs; strokes.json",
        Format::Voc => "the data set; cvat.zip; strokes.json",
        Format::Cityscapes
        | Format::CocoPanoptic
        | Format::CocoInstances
        | Format::Labelme
        | Format::Yolo
        | Format::HuggingFace => "the data set; strokes.json",
        Format::PointCloud => "cloud.ply, cloud_classes.ply; classes.json; strokes.json",
        Format::Mesh => "mesh.ply, mesh_classes.ply; classes.json; strokes.json",
        Format::Boxes => "boxes.json; pointclouds and labels; strokes.json",
    }
}

/// Draws how far opening has come.
pub fn opening(ui: &mut Ui, opening: &Opening, commands: &mut Commands) {
    ui.add_space((ui.available_height() * 0.4).max(16.0));
    ui.vertical_centered(|ui| {
        ui.set_max_width(360.0);
        let (done, total) = opening.progress;
        let (share, words) = match total {
            0 => (None, "Looking at the files".to_owned()),
            _ => (Some(done as f32 / total as f32), frames_done(done, total)),
        };
        let title = format!("Opening {}", opening.target.name());
        if long_work(ui, &title, (share, &words), Some("Cancel")) {
            commands.push(Command::CloseScene);
        }
    });
}
