//! Work that would make the window wait: each job runs on a thread of its own, and tells what it led to.

use std::path::PathBuf;
use std::sync::Arc;

use inplace_core::export::write_json;
use inplace_core::labels::{
    Class, History, ImportedLabels, LabelImages, Trust, read_class_list, read_label_images,
};
use inplace_core::scene::reprojection::Agreement;
use inplace_core::scene::{OpenOptions, Scene, SceneSource};
use inplace_core::session::MapSlots;

use crate::dialogs::Purpose;
use crate::exporting::{Export, ExportProgress};
use crate::opening::{self, Attached, Prepared, Refusal, Target};
use crate::overview::{Summarised, summarise};
use crate::project_session::{Ending, ProjectSession};

/// Where the work on a scene that has no project file yet is kept.
pub type AutosavePath = Arc<dyn Fn(&SceneSource) -> PathBuf + Send + Sync>;

/// Work for another thread.
#[derive(Debug)]
pub enum Job {
    /// Finds what is kept about a target; the number tells attempts apart.
    Prepare(u64, Target, OpenOptions),
    /// Fits what is kept about a scene to it.
    Attach {
        /// The attempt that it belongs to.
        ticket: u64,
        /// What is kept.
        prepared: Box<Prepared>,
        /// The scene.
        scene: Arc<Scene>,
        /// Where kept maps are shown.
        maps: Option<Arc<MapSlots>>,
    },
    /// Makes a project file for the work on the scene with this serial number.
    MakeProject {
        /// Serial number of the scene.
        serial: u64,
        /// The file.
        path: PathBuf,
        /// The scene.
        scene: Arc<Scene>,
        /// What was read of it.
        open: OpenOptions,
        /// The labels with their edits.
        history: Box<History>,
    },
    /// Writes a data set into a folder.
    Export(Box<Export>, PathBuf),
    /// Reads label images.
    Import {
        /// Number of the import.
        ticket: u64,
        /// Where they are.
        folder: PathBuf,
        /// The scene that they are of.
        scene: Arc<Scene>,
        /// The project's classes.
        classes: Vec<Class>,
        /// How far their pixels can be believed.
        trust: Trust,
    },
    /// Sums up maps.
    Summarise {
        /// Serial number of the scene.
        serial: u64,
        /// The newest maps.
        maps: Arc<MapSlots>,
        /// What they are compared with.
        imported: Option<Arc<ImportedLabels>>,
        /// Frames with the versions of their maps.
        due: Vec<(usize, u64)>,
    },
    /// Checks whether the poses and cameras of the scene with this serial number fit its images.
    CheckPoses(u64, Arc<Scene>),
    /// Reads a class list.
    ReadClasses(PathBuf),
    /// Writes a class list.
    SaveClasses(PathBuf, Vec<Class>),
}

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
    Kept(u64, Box<ProjectSession>),
    /// How an export goes.
    Exported(ExportProgress),
    /// The label images of the import with this number were read, or a sentence says what failed.
    Imported(u64, Box<Result<LabelImages, String>>),
    /// Maps of the scene with this serial number were summed up.
    Summarised(u64, Vec<Summarised>),
    /// What is probably wrong with the poses or cameras of the scene with this serial number, a sentence each.
    PosesChecked(u64, Vec<String>),
    /// A class list was read, or a sentence says why not.
    ClassesRead(Result<Vec<Class>, String>),
    /// So many classes were written to this file.
    ClassesSaved(usize, PathBuf),
    /// A sentence about what failed.
    Failed(String),
}

/// What jobs need from outside.
#[derive(Clone)]
pub struct JobTools {
    /// Where unnamed work is kept.
    pub autosave: AutosavePath,
    /// Wakes the window.
    pub wake: Arc<dyn Fn() + Send + Sync>,
    /// Files that were closed and may still be being written.
    pub endings: Vec<Ending>,
}

impl Job {
    /// Name of its thread.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Prepare(..) => "open",
            Self::Attach { .. } => "attach",
            Self::MakeProject { .. } => "save",
            Self::Export(..) => "export",
            Self::Import { .. } => "import",
            Self::Summarise { .. } => "summaries",
            Self::CheckPoses(..) => "poses",
            Self::ReadClasses(_) | Self::SaveClasses(..) => "classes",
        }
    }

    /// Does the work, and tells what came of it. Touches the disk.
    pub fn run(self, tools: &JobTools, tell: &(dyn Fn(Done) + Sync)) {
        let wake = Arc::clone(&tools.wake);
        let wake = move || wake();
        let done = match self {
            Self::Prepare(ticket, target, open) => {
                let prepared = opening::prepare(target, open, tools.autosave.as_ref(), &tools.endings);
                Done::Prepared(ticket, Box::new(prepared))
            }
            Self::Attach {
                ticket,
                prepared,
                scene,
                maps,
            } => {
                let attached = opening::attach(*prepared, &scene, maps.as_ref(), wake);
                Done::Attached(ticket, scene, Box::new(attached))
            }
            Self::MakeProject {
                serial,
                path,
                scene,
                open,
                history,
            } => match opening::new_project(path, &scene, open, *history, wake) {
                Ok(project) => Done::Kept(serial, Box::new(project)),
                Err(sentence) => Done::Failed(sentence),
            },
            Self::Export(export, folder) => {
                export.run(&folder, &|progress| tell(Done::Exported(progress)));
                return;
            }
            Self::Import {
                ticket,
                folder,
                scene,
                classes,
                trust,
            } => {
                let images = read_label_images(&folder, &scene, &classes, trust);
                Done::Imported(ticket, Box::new(images.map_err(|error| error.to_string())))
            }
            Self::Summarise {
                serial,
                maps,
                imported,
                due,
            } => Done::Summarised(serial, summarise(&maps, imported.as_ref(), due)),
            Self::CheckPoses(serial, scene) => Done::PosesChecked(serial, Agreement::of(&scene).warnings),
            Self::ReadClasses(path) => {
                Done::ClassesRead(read_class_list(&path).map_err(|error| error.to_string()))
            }
            Self::SaveClasses(path, classes) => match write_json(&path, &classes) {
                Ok(()) => Done::ClassesSaved(classes.len(), path),
                Err(error) => Done::Failed(error.to_string()),
            },
        };
        tell(done);
    }
}
