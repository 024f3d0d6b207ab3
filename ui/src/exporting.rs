//! Exporting: the writing off the UI thread, and saying where the files went.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use egui::{Align2, Area, Id, Order, vec2};
use inplace_core::export::{write_maps, write_strokes};
use inplace_core::labels::LabelSet;
use inplace_core::scene::Scene;
use inplace_core::session::{FrameMap, MapSlots};

use crate::action::{Action, Actions};
use crate::state::AppState;

/// What is exported.
#[derive(Debug)]
pub struct Export {
    /// The scene.
    pub scene: Arc<Scene>,
    /// Classes and strokes.
    pub labels: LabelSet,
    /// Generation of the labels: older maps are waited out.
    pub generation: u64,
    /// The newest maps.
    pub maps: Arc<MapSlots>,
}

/// How long an export waits for maps that follow the last stroke.
const PATIENCE: Duration = Duration::from_secs(30);

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
        let Some(maps) = self.newest_maps() else {
            tell(Progress::Failed(format!(
                "{}: nothing was exported, because the maps do not follow the last stroke yet; try again in a \
                 moment.",
                folder.display()
            )));
            return;
        };
        let progress = |done, total| tell(Progress::Writing(done, total));
        let written = write_maps(&folder, &self.scene, &self.labels.classes, &maps, &progress)
            .and_then(|()| write_strokes(&folder.join("strokes.json"), &self.labels, &self.scene.frames));
        tell(match written {
            Ok(()) => Progress::Finished(folder, maps.len()),
            Err(error) => Progress::Failed(format!("{error}.")),
        });
    }
}

impl Export {
    /// A map of every frame that was made from these labels; waits for them a while.
    fn newest_maps(&self) -> Option<Vec<Arc<FrameMap>>> {
        let end = Instant::now() + PATIENCE;
        loop {
            let maps: Option<Vec<_>> = (0..self.scene.frames.len())
                .map(|frame| {
                    self.maps
                        .get(frame)
                        .filter(|map| map.generation >= self.generation)
                })
                .collect();
            if maps.is_some() || Instant::now() >= end {
                return maps;
            }
            std::thread::sleep(Duration::from_millis(50));
        }
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
