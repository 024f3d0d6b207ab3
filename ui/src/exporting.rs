//! Exporting: the writing off the UI thread, and saying where the files went.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use egui::{Align2, Area, Id, Order, vec2};
use inplace_core::export::{write_maps, write_strokes};
use inplace_core::labels::LabelSet;
use inplace_core::scene::Scene;
use inplace_core::session::MapSlots;

use crate::action::{Action, Actions};
use crate::state::AppState;

/// What is exported.
#[derive(Debug)]
pub struct Export {
    /// The scene.
    pub scene: Arc<Scene>,
    /// Classes and strokes.
    pub labels: LabelSet,
    /// The newest maps.
    pub maps: Arc<MapSlots>,
}

/// How an export goes.
#[derive(Clone, Debug, PartialEq)]
pub enum Progress {
    /// Frames written, frames in all.
    Writing(usize, usize),
    /// Everything is in this folder: so many frames.
    Finished(PathBuf, usize),
    /// A sentence about what failed.
    Failed(String),
}

impl Export {
    /// Writes the maps of every frame, the classes and the strokes; `tell` is called along the way and at
    /// the end.
    pub fn run(&self, folder: &Path, tell: &(dyn Fn(Progress) + Sync)) {
        let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_path_buf());
        let maps: Vec<_> = (0..self.scene.frames.len())
            .filter_map(|frame| self.maps.get(frame))
            .collect();
        let progress = |done, total| tell(Progress::Writing(done, total));
        let stems: Vec<String> = self.scene.frames.iter().map(|frame| frame.stem.clone()).collect();
        let written = write_maps(&folder, &self.scene, &self.labels.classes, &maps, &progress)
            .and_then(|()| write_strokes(&folder.join("strokes.json"), &self.labels, &stems));
        tell(match written {
            Ok(()) => Progress::Finished(folder, maps.len()),
            Err(error) => Progress::Failed(format!("{error}.")),
        });
    }
}

/// Says where the last export went, over the upper right corner of `area`.
pub fn show(ctx: &egui::Context, state: &AppState, area: egui::Rect, actions: &mut Actions) {
    let Some(Progress::Finished(folder, frames)) = &state.export else {
        return;
    };
    Area::new(Id::unique("exported"))
        .order(Order::Foreground)
        .pivot(Align2::RIGHT_TOP)
        .fixed_pos(area.right_top() + vec2(-16.0, 16.0))
        .show(ctx, |ui| {
            egui::Frame::popup(ui.style()).inner_margin(16).show(ui, |ui| {
                ui.set_width(360.0);
                ui.strong(format!("Exported {frames} frames"));
                let path = folder.display().to_string();
                ui.add(egui::Label::new(egui::RichText::new(&path).monospace()).wrap());
                ui.weak("labels, entropy and color as PNGs; classes.json; strokes.json");
                ui.horizontal(|ui| {
                    if ui.button("Open folder").clicked() {
                        actions.push(Action::ShowFolder(folder.clone()));
                    }
                    if ui.button("Copy path").clicked() {
                        actions.push(Action::Copy(path));
                    }
                    if ui.button("Close").clicked() {
                        actions.push(Action::DismissExport);
                    }
                });
            });
        });
}
