//! Work that would make the window wait, each on its own thread: the model's jobs, the system's dialogs, pictures.

use std::path::PathBuf;
use std::sync::Arc;

use crossbeam_channel::{Receiver, Sender, unbounded};
use inplace_core::TOLD;
use inplace_model::dialogs::Purpose;
use inplace_model::jobs::{Done, Job, JobTools};
use inplace_model::preferences::RecentPlace;
use inplace_model::workspace::source::FrameSource;

use crate::background::wake;
use crate::pictures::{self, Seen};

/// What came of work on a thread.
#[derive(Debug)]
pub enum Outcome {
    /// Something for the model.
    Done(Done),
    /// What was opened lately was looked at.
    Seen(Vec<Seen>),
}

/// Runs jobs and collects their results.
#[derive(Debug)]
pub struct Jobs {
    sender: Sender<Outcome>,
    receiver: Receiver<Outcome>,
    ctx: egui::Context,
    /// Folder of the pictures of what was opened lately.
    pictures: PathBuf,
}

impl Jobs {
    /// Wakes this window when a job is done; `pictures` is the folder of the pictures of what was opened lately.
    pub fn new(ctx: egui::Context, pictures: PathBuf) -> Self {
        let (sender, receiver) = unbounded();
        Self {
            sender,
            receiver,
            ctx,
            pictures,
        }
    }

    /// The next result, if any.
    pub fn next(&self) -> Option<Outcome> {
        let outcome = self.receiver.try_recv().ok()?;
        if let Outcome::Done(Done::Failed(sentence)) = &outcome {
            tracing::warn!(target: TOLD, "{sentence}");
        }
        Some(outcome)
    }

    /// Does work on a thread; `broken` makes of a sentence what it led to where there is no thread.
    fn spawn(
        &self,
        name: &str,
        broken: &dyn Fn(String) -> Done,
        job: impl FnOnce(&(dyn Fn(Outcome) + Sync)) + Send + 'static,
    ) {
        let (sender, ctx) = (self.sender.clone(), self.ctx.clone());
        let tell = move |outcome| {
            // Nobody listens any more when the window is closing.
            let _ = sender.send(outcome);
            wake(&ctx);
        };
        let thread = std::thread::Builder::new().name(format!("inplace-{name}"));
        if let Err(error) = thread.spawn(move || job(&tell)) {
            let sentence = format!("No thread could be started ({error}): close other programs first.");
            let _ = self.sender.send(Outcome::Done(broken(sentence)));
        }
    }

    /// Runs a job of the model.
    pub fn start(&self, job: Job, tools: JobTools) {
        let broken = Arc::clone(&job.broken);
        self.spawn(job.name, &*broken, move |tell| {
            job.run(&tools, &|done| tell(Outcome::Done(done)));
        });
    }

    /// Asks for a path with the system's dialog.
    pub fn browse(&self, purpose: Purpose) {
        self.spawn("dialog", &Done::Failed, move |tell| {
            let dialog = rfd::FileDialog::new().set_title(title(purpose));
            let project = |dialog: rfd::FileDialog| dialog.add_filter("Inplace project", &["inplace"]);
            let classes = |dialog: rfd::FileDialog| dialog.add_filter("Class list", &["json"]);
            let path = match purpose {
                Purpose::Scene | Purpose::Moved | Purpose::Export | Purpose::Import => dialog.pick_folder(),
                Purpose::Project | Purpose::Compare => project(dialog).pick_file(),
                Purpose::SaveAs => project(dialog).save_file(),
                Purpose::Classes => classes(dialog).pick_file(),
                Purpose::SaveClasses => classes(dialog).save_file(),
                Purpose::Features => dialog.pick_file(),
            };
            tell(Outcome::Done(Done::Picked(purpose, path)));
        });
    }

    /// Shows a folder in the system's file manager.
    pub fn show_folder(&self, folder: PathBuf) {
        self.spawn("folder", &Done::Failed, move |tell| {
            let program = if cfg!(target_os = "macos") {
                "open"
            } else if cfg!(windows) {
                "explorer"
            } else {
                "xdg-open"
            };
            let reason = match std::process::Command::new(program).arg(&folder).status() {
                // Explorer has shown the folder and says otherwise.
                Ok(status) if status.success() || cfg!(windows) => return,
                Ok(status) => format!("ended with {status}"),
                Err(error) => format!("did not start ({error})"),
            };
            let folder = folder.display();
            tell(Outcome::Done(Done::Failed(format!(
                "{folder} cannot be shown: {program} {reason}; copy the path instead."
            ))));
        });
    }

    /// Looks at what was opened lately.
    pub fn look_at(&self, places: Vec<RecentPlace>) {
        let folder = self.pictures.clone();
        self.spawn("recent", &Done::Failed, move |tell| {
            let places = places.into_iter();
            tell(Outcome::Seen(
                places.map(|place| pictures::look_at(place, &folder)).collect(),
            ));
        });
    }

    /// Takes a picture of what is open.
    pub fn take_picture(&self, place: RecentPlace, source: FrameSource) {
        let folder = self.pictures.clone();
        self.spawn("picture", &Done::Failed, move |tell| {
            // A picture that cannot be kept is only missing from the start page.
            let _ = pictures::write(&place, &source, &folder);
            tell(Outcome::Seen(vec![pictures::look_at(place, &folder)]));
        });
    }

    /// Takes a picture like [`Jobs::take_picture`] at the end of the program: on this thread.
    pub fn take_last_picture(&self, place: &RecentPlace, source: &FrameSource) {
        // As above.
        let _ = pictures::write(place, source, &self.pictures);
    }

    /// Removes the picture of something that was opened lately.
    pub fn forget_picture(&self, place: RecentPlace) {
        let folder = self.pictures.clone();
        self.spawn("forget", &Done::Failed, move |_| {
            pictures::remove(&place, &folder);
        });
    }
}

/// Title of the system's dialog.
fn title(purpose: Purpose) -> &'static str {
    match purpose {
        Purpose::Scene => "Open the folder of a scene",
        Purpose::Project => "Open a project",
        Purpose::SaveAs => "Save the project as",
        Purpose::Export => "Export into a folder",
        Purpose::Import => "Import the label images of a folder",
        Purpose::Compare => "Compare with another project",
        Purpose::Moved => "The folder of the scene",
        Purpose::Classes => "Read a class list",
        Purpose::SaveClasses => "Save the classes as a file",
        Purpose::Features => "Choose a pretrained network",
    }
}
