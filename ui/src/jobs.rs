//! Work that would make the window wait, each on its own thread.

use std::path::PathBuf;
use std::sync::Arc;

use crossbeam_channel::{Receiver, Sender, unbounded};
use inplace_core::TOLD;
use inplace_core::labels::{Class, LabelImages};
use inplace_core::scene::Scene;

use crate::dialogs::Purpose;
use crate::english::{dialogs, work};
use crate::exporting::Progress;
use crate::keeper::Keeper;
use crate::opening::{Attached, Prepared, Refusal};
use crate::overview::Summarised;
use crate::pictures::Seen;

/// What a job led to.
#[derive(Debug)]
pub enum Done {
    /// The system's dialog was answered; `None` = cancelled, or there is no such dialog here.
    Picked(Purpose, Option<PathBuf>),
    /// What is kept about a scene was found; the number tells attempts apart.
    Prepared(u64, Box<Result<Prepared, Refusal>>),
    /// A scene was fitted to what is kept about it; or a sentence about why it is not the scene of its
    /// project.
    Attached(u64, Arc<Scene>, Box<Result<Attached, String>>),
    /// A project file was made for the scene with this serial number.
    Kept(u64, Box<Keeper>),
    /// How an export goes.
    Exported(Progress),
    /// What was opened lately was looked at.
    Seen(Vec<Seen>),
    /// The label images of the import with this number were read, or a sentence says what failed.
    Imported(u64, Box<Result<LabelImages, String>>),
    /// Maps of the scene with this serial number were summed up.
    Summarised(u64, Vec<Summarised>),
    /// A class list was read, or a sentence says why not.
    ClassesRead(Result<Vec<Class>, String>),
    /// So many classes were written to this file.
    ClassesSaved(usize, PathBuf),
    /// A sentence about what failed.
    Failed(String),
}

/// Runs jobs and collects their results.
#[derive(Debug)]
pub struct Jobs {
    sender: Sender<Done>,
    receiver: Receiver<Done>,
    ctx: egui::Context,
}

impl Jobs {
    /// Wakes this window when a job is done.
    pub fn new(ctx: egui::Context) -> Self {
        let (sender, receiver) = unbounded();
        Self {
            sender,
            receiver,
            ctx,
        }
    }

    /// Runs a job on its own thread.
    pub fn spawn(&self, name: &str, job: impl FnOnce(&(dyn Fn(Done) + Sync)) + Send + 'static) {
        let (sender, ctx) = (self.sender.clone(), self.ctx.clone());
        let tell = move |done| {
            // Nobody listens any more when the window is closing.
            let _ = sender.send(done);
            ctx.request_repaint();
        };
        let thread = std::thread::Builder::new().name(format!("inplace-{name}"));
        if let Err(error) = thread.spawn(move || job(&tell)) {
            let _ = self.sender.send(Done::Failed(work::no_thread(&error)));
        }
    }

    /// The next result, if any.
    pub fn next(&self) -> Option<Done> {
        let done = self.receiver.try_recv().ok()?;
        if let Done::Failed(sentence) = &done {
            tracing::warn!(target: TOLD, "{sentence}");
        }
        Some(done)
    }

    /// Asks for a path with the system's dialog.
    pub fn browse(&self, purpose: Purpose) {
        self.spawn("dialog", move |tell| {
            let dialog = rfd::FileDialog::new().set_title(purpose.title());
            let project = |dialog: rfd::FileDialog| dialog.add_filter(dialogs::PROJECT_FILES, &["inplace"]);
            let classes = |dialog: rfd::FileDialog| dialog.add_filter(dialogs::CLASS_LISTS, &["json"]);
            let path = match purpose {
                Purpose::Scene | Purpose::Moved | Purpose::Export | Purpose::Import => dialog.pick_folder(),
                Purpose::Project => project(dialog).pick_file(),
                Purpose::SaveAs => project(dialog).save_file(),
                Purpose::Classes => classes(dialog).pick_file(),
                Purpose::SaveClasses => classes(dialog).save_file(),
            };
            tell(Done::Picked(purpose, path));
        });
    }

    /// Shows a folder in the system's file manager.
    pub fn show_folder(&self, folder: PathBuf) {
        self.spawn("folder", move |tell| {
            let program = if cfg!(target_os = "macos") {
                "open"
            } else if cfg!(windows) {
                "explorer"
            } else {
                "xdg-open"
            };
            if let Err(error) = std::process::Command::new(program).arg(&folder).spawn() {
                tell(Done::Failed(work::no_file_manager(&folder, program, &error)));
            }
        });
    }
}
