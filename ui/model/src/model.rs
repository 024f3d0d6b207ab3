//! The whole state of the window, without the window.

use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use inplace_core::field::Preset;
use inplace_core::scene::{OpenOptions, Scene, SceneSource};
use inplace_core::session::Session;

use crate::dialogs::{Dialog, ExportChoice};
use crate::effect::Effect;
use crate::exporting::ExportProgress;
use crate::messages::Messages;
use crate::opening::{Prepared, Target};
use crate::preferences::{Preferences, RecentPlace};
use crate::project_session::ProjectSession;
use crate::settings::Settings;
use crate::workspace::Workspace;

/// What the window is at.
#[derive(Debug, Default)]
pub enum Stage {
    /// Nothing is open.
    #[default]
    Start,
    /// Something is being opened.
    Opening(Box<Opening>),
    /// A scene is open.
    Open(Box<Workspace>),
}

/// Something being opened.
#[derive(Debug)]
pub struct Opening {
    /// Tells this attempt from earlier ones, whose results are then dropped.
    pub ticket: u64,
    /// What is opened.
    pub target: Target,
    /// Frames decoded so far, and in all.
    pub progress: (usize, usize),
    /// The session that reads the scene, once it runs.
    pub session: Option<Session>,
    /// What is kept about the scene, until the journal takes it.
    pub prepared: Option<Prepared>,
    /// The scene, once all of it is read.
    pub opened: Option<Arc<Scene>>,
}

/// Another project that is being read, to compare with it.
#[derive(Debug)]
pub struct BeginningComparison {
    /// Tells it from earlier ones, whose results are then dropped.
    pub(crate) ticket: u64,
    /// Name of the project.
    pub name: String,
    /// How it goes, in words.
    pub words: String,
    /// Set to stop it.
    pub(crate) stop: Arc<AtomicBool>,
}

/// What the right side shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Side {
    /// Where to label next.
    #[default]
    LabelNext,
    /// How far the labelling has come.
    Progress,
}

impl Side {
    /// The other one.
    pub fn other(self) -> Self {
        match self {
            Self::LabelNext => Self::Progress,
            Self::Progress => Self::LabelNext,
        }
    }
}

/// What a window starts with.
#[derive(Clone, Debug, Default)]
pub struct Start {
    /// What is read of captures.
    pub read: OpenOptions,
    /// How much the field may model.
    pub preset: Preset,
    /// Threads of the worker's pool; `None` = as the person prefers.
    pub threads: Option<usize>,
    /// File of a pretrained network; `None` = as the person prefers.
    pub features: Option<PathBuf>,
    /// Seed of everything random.
    pub seed: u64,
}

/// Everything that the views read.
#[derive(Debug, Default)]
pub struct State {
    /// What the window is at.
    pub stage: Stage,
    /// Where the open scene's work is kept.
    pub project: Option<ProjectSession>,
    /// How the frame is shown and drawn on.
    pub settings: Settings,
    /// What the person prefers in every scene.
    pub preferences: Preferences,
    /// What was exported last, and where to, in this scene.
    pub export_choice: ExportChoice,
    /// The dialog shown.
    pub dialog: Option<Dialog>,
    /// How the last export goes or went, until it is dismissed.
    pub export: Option<ExportProgress>,
    /// Whether it is being stopped.
    pub stopping_export: bool,
    /// The import whose label images are being read.
    pub importing: Option<u64>,
    /// The project that is being read, to compare with it.
    pub beginning_comparison: Option<BeginningComparison>,
    /// What the right side shows.
    pub side: Side,
    /// The messages shown.
    pub messages: Messages,
    /// Whether the key that hides the overlay is held.
    pub overlay_hidden: bool,
}

/// The whole state of the window. Views read it (it is a [`State`]); [`Model::update`] alone changes it, and returns what
/// is to be done outside of it.
pub struct Model {
    pub(crate) state: State,
    /// What has to be done outside, in order; handed over at the end of an update.
    pub(crate) effects: Vec<Effect>,
    /// What the window started with.
    pub(crate) start: Start,
    /// What is read of the open capture.
    pub(crate) read: OpenOptions,
    pub(crate) last_ticket: u64,
    /// The export that is under way, as long as it waits for maps that follow the labels.
    pub(crate) waiting_export: Option<ExportChoice>,
    /// Set to stop the export that is under way.
    pub(crate) export_stop: Arc<AtomicBool>,
    /// The window was to be closed during an export.
    pub(crate) closes_after_export: bool,
}

impl Deref for Model {
    type Target = State;

    fn deref(&self) -> &State {
        &self.state
    }
}

impl Model {
    /// A window with nothing open.
    pub fn new(start: Start, preferences: Preferences) -> Self {
        Self {
            state: State {
                settings: preferences.settings(),
                preferences,
                ..State::default()
            },
            effects: Vec::new(),
            read: start.read,
            start,
            last_ticket: 0,
            waiting_export: None,
            export_stop: Arc::default(),
            closes_after_export: false,
        }
    }
}

impl State {
    /// The open scene.
    pub fn workspace(&self) -> Option<&Workspace> {
        match &self.stage {
            Stage::Open(workspace) => Some(workspace),
            Stage::Start | Stage::Opening(_) => None,
        }
    }

    /// The open scene.
    pub(crate) fn workspace_mut(&mut self) -> Option<&mut Workspace> {
        match &mut self.stage {
            Stage::Open(workspace) => Some(workspace),
            Stage::Start | Stage::Opening(_) => None,
        }
    }

    /// The open scene, if it has this serial number.
    pub(crate) fn workspace_numbered(&mut self, serial: u64) -> Option<&mut Workspace> {
        self.workspace_mut()
            .filter(|workspace| workspace.serial == serial)
    }

    /// Whether the open scene is compared with another project.
    pub fn is_compared(&self) -> bool {
        self.workspace()
            .is_some_and(|workspace| workspace.comparison.is_some())
    }

    /// Name of what is open: the project's file stem, or the scene's name.
    pub fn document_name(&self) -> Option<String> {
        let workspace = self.workspace()?;
        let named = self.project.as_ref().filter(|project| project.named);
        let stem = named.and_then(|project| project.path.file_stem());
        Some(stem.map_or_else(
            || workspace.scene.name(),
            |stem| stem.to_string_lossy().into_owned(),
        ))
    }

    /// Where what is open can be opened again; `None` for the demo scene, which is always there.
    pub fn place(&self) -> Option<RecentPlace> {
        let workspace = self.workspace()?;
        let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
        match (&self.project, &workspace.scene.source) {
            (Some(project), _) if project.named => Some(RecentPlace::Project(absolute(&project.path))),
            (_, SceneSource::Folder(folder)) => Some(RecentPlace::Scene(absolute(folder))),
            (_, SceneSource::Demo) => None,
        }
    }

    /// Where a dialog suggests to put a file or folder with this ending.
    pub fn suggested_path(&self, ending: &str) -> String {
        let name = format!("{}{ending}", self.document_name().unwrap_or_default());
        let kept = self.project.as_ref().filter(|project| project.named);
        let folder = kept.and_then(|project| project.path.parent().map(Path::to_path_buf));
        let folder = folder
            .or_else(|| std::env::current_dir().ok())
            .unwrap_or_default();
        folder.join(name).display().to_string()
    }
}
