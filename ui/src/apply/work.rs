//! Work that takes a while: exporting, importing, summing up the maps.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use inplace_core::labels::{LabelImages, Trust, read_label_images};

use crate::app::App;
use crate::dialogs::ExportChoice;
use crate::english::work;
use crate::exporting::{Export, Progress};
use crate::jobs::Done;
use crate::overview::{Summarised, summarise};

impl App {
    /// Whether files are being written.
    pub(crate) fn is_exporting(&self) -> bool {
        matches!(self.state.export, Some(Progress::Writing(..)))
    }

    pub(super) fn export(&mut self, choice: ExportChoice) {
        self.state.dialog = None;
        if self.is_exporting() {
            self.state.toasts.info(work::EXPORT_RUNS);
            return;
        }
        let Some(workspace) = self.state.workspace() else {
            return;
        };
        let Some(maps) = workspace.session().maps().cloned() else {
            return;
        };
        let stop = Arc::new(AtomicBool::new(false));
        let export = Export {
            scene: Arc::clone(workspace.scene()),
            labels: workspace.document().labels().clone(),
            generation: workspace.document().generation(),
            format: choice.format,
            options: choice.options(),
            maps,
            stop: Arc::clone(&stop),
        };
        let folder = choice.folder();
        self.state.export = Some(Progress::Writing(0, workspace.scene().frames.len()));
        self.state.export_choice = choice;
        self.state.stopping_export = false;
        self.export_stop = stop;
        self.jobs.spawn("export", move |tell| {
            export.run(&folder, &|progress| tell(Done::Exported(progress)));
        });
    }

    pub(super) fn cancel_export(&mut self) {
        self.state.stopping_export = self.is_exporting();
        self.export_stop.store(true, Ordering::Relaxed);
    }

    /// The export has come further, or has ended.
    pub(crate) fn exported(&mut self, progress: Progress) {
        self.state.export = match progress {
            Progress::Failed(sentence) => {
                self.state.toasts.error(sentence);
                None
            }
            Progress::Cancelled(folder, written, frames) => {
                let folder = folder.display().to_string();
                let sentence = work::export_cancelled(&folder, written, frames);
                self.state.toasts.info(sentence);
                None
            }
            progress => Some(progress),
        };
        if !self.is_exporting() && self.closes_after_export {
            self.ctx.send_viewport_cmd(egui::ViewportCommand::Close);
        }
    }

    /// During an export the window is closed after its end; closed once more, it stops the export first.
    pub(crate) fn hold_open_while_exporting(&mut self) {
        let asked = self.ctx.input(|input| input.viewport().close_requested());
        // A discarded pass is run again with the same request.
        if !self.is_exporting() || !asked || self.ctx.current_pass_index() > 0 {
            return;
        }
        self.ctx.send_viewport_cmd(egui::ViewportCommand::CancelClose);
        if std::mem::replace(&mut self.closes_after_export, true) {
            self.cancel_export();
        } else {
            self.state.toasts.info(work::CLOSES_AFTER_EXPORT);
        }
    }

    pub(super) fn import_from(&mut self, folder: PathBuf, trust: Trust) {
        self.state.dialog = None;
        if self.state.importing.is_some() {
            self.state.toasts.info(work::IMPORT_RUNS);
            return;
        }
        let Some(workspace) = self.state.workspace() else {
            return;
        };
        let scene = Arc::clone(workspace.scene());
        let classes = workspace.document().classes().to_vec();
        self.last_ticket += 1;
        let ticket = self.last_ticket;
        self.state.importing = Some(ticket);
        self.jobs.spawn("import", move |tell| {
            let images =
                read_label_images(&folder, &scene, &classes, trust).map_err(|error| error.to_string());
            tell(Done::Imported(ticket, Box::new(images)));
        });
    }

    pub(super) fn cancel_import(&mut self) {
        if self.state.importing.take().is_some() {
            self.state.toasts.info(work::IMPORT_CANCELLED);
        }
    }

    /// Label images were read, or could not be; those of an import that was cancelled are dropped.
    pub(crate) fn imported(&mut self, ticket: u64, images: Result<LabelImages, String>) {
        if self.state.importing != Some(ticket) {
            return;
        }
        self.state.importing = None;
        let images = match images {
            Ok(images) => images,
            Err(sentence) => {
                self.state.toasts.error(sentence);
                return;
            }
        };
        let (count, unmatched) = (images.labels.maps.len(), images.unmatched);
        self.edit(|history| Some(history.import(images)));
        self.state.toasts.info(work::imported(count, unmatched));
    }

    /// Brings what is known of the scene as a whole up to date; new maps are summed up on a thread.
    pub(crate) fn look_over(&mut self) {
        let now = Instant::now();
        let Some(workspace) = self.state.workspace_mut() else {
            return;
        };
        let due = workspace.refresh_overview(now);
        if let Some(wait) = workspace.overview().wake_in(now) {
            self.ctx.request_repaint_after(wait);
        }
        let serial = workspace.serial();
        let imported = workspace.document().labels().imported.clone();
        let maps = workspace.session().maps().cloned();
        if let (Some(due), Some(maps)) = (due, maps) {
            self.jobs.spawn("summaries", move |tell| {
                let made = summarise(&maps, imported.as_ref(), due);
                tell(Done::Summarised(serial, made));
            });
        }
    }

    /// Maps were summed up.
    pub(crate) fn summarised(&mut self, serial: u64, made: Vec<Summarised>) {
        if let Some(workspace) = self.state.workspace_mut()
            && workspace.serial() == serial
        {
            workspace.overview_mut().take_summaries(made, Instant::now());
        }
    }
}
