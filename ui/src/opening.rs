//! From a path to an open workspace: what is kept about the scene, the session, the journal.
//!
//! Reading and writing files happens on job threads; the window only passes the pieces on.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use inplace_core::labels::History;
use inplace_core::project::{Contents, Journal, Project, ProjectError, SceneRecord};
use inplace_core::scene::{OpenOptions, Scene, SceneSource};
use inplace_core::session::MapSlots;

use crate::keeper::Keeper;

/// What is to be opened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Target {
    /// A capture; earlier work on it is taken up again.
    Scene(SceneSource),
    /// A project file.
    Project(PathBuf),
    /// A project file or the folder of a capture, found out by looking.
    Path(PathBuf),
}

impl Target {
    /// Name for people.
    pub fn name(&self) -> String {
        match self {
            Self::Scene(SceneSource::Demo) => "the demo scene".to_owned(),
            Self::Scene(SceneSource::Folder(path)) | Self::Project(path) | Self::Path(path) => {
                path.file_name().map_or_else(
                    || path.display().to_string(),
                    |name| name.to_string_lossy().into_owned(),
                )
            }
        }
    }
}

/// A scene to open with what is kept about it.
#[derive(Debug)]
pub struct Prepared {
    /// The capture.
    pub source: SceneSource,
    /// What to read of it.
    pub open: OpenOptions,
    file: PathBuf,
    named: bool,
    kept: Option<(Project, Contents)>,
    /// Why the work cannot be kept in `file`.
    problem: Option<String>,
}

impl Prepared {
    /// The model state to go on from.
    pub fn state(&self) -> Option<Arc<inplace_core::session::ModelState>> {
        self.kept.as_ref()?.1.model.clone()
    }
}

/// Finds what is kept about a target.
///
/// # Errors
/// A sentence about a project file that cannot be opened, or whose scene is gone.
pub fn prepare(
    target: Target,
    open: OpenOptions,
    autosave: &dyn Fn(&SceneSource) -> PathBuf,
) -> Result<Prepared, String> {
    match target {
        Target::Project(path) => prepare_project(path, open),
        Target::Path(path) if path.is_file() => prepare_project(path, open),
        Target::Path(path) => Ok(prepare_scene(SceneSource::from_argument(&path), open, autosave)),
        Target::Scene(source) => Ok(prepare_scene(source, open, autosave)),
    }
}

fn prepare_project(path: PathBuf, open: OpenOptions) -> Result<Prepared, String> {
    let (project, contents) = Project::open(&path).map_err(|error| error.to_string())?;
    if !contents.scene.is_there() {
        return Err(format!(
            "{}: its scene is no longer at {}; put the scene's folder back, or beside the project.",
            path.display(),
            contents.scene.source
        ));
    }
    Ok(Prepared {
        source: contents.scene.source.clone(),
        open: OpenOptions {
            depth: contents.scene.depth && open.depth,
        },
        file: path,
        named: true,
        kept: Some((project, contents)),
        problem: None,
    })
}

fn prepare_scene(
    source: SceneSource,
    open: OpenOptions,
    autosave: &dyn Fn(&SceneSource) -> PathBuf,
) -> Prepared {
    let file = autosave(&source);
    let (kept, problem) = match Project::open(&file) {
        Ok(kept) => (Some(kept), None),
        Err(ProjectError::Missing(_)) => (None, None),
        Err(error) => (None, Some(error.to_string())),
    };
    Prepared {
        source,
        open,
        file,
        named: false,
        kept,
        problem,
    }
}

/// What a workspace starts with.
#[derive(Debug)]
pub struct Attached {
    /// Labels and edits.
    pub history: History,
    /// Generation to count from.
    pub generation: u64,
    /// View settings, as the window wrote them.
    pub view: Option<String>,
    /// Where the work is kept.
    pub keeper: Keeper,
    /// What the person should know, a sentence each.
    pub notes: Vec<String>,
    /// What went wrong; the work goes on in memory.
    pub problem: Option<String>,
}

/// Fits what is kept to the opened scene, shows the kept maps, and starts the journal.
pub fn attach(
    prepared: Prepared,
    scene: &Scene,
    maps: Option<&Arc<MapSlots>>,
    wake: impl Fn() + Send + 'static,
) -> Attached {
    let Prepared {
        open,
        file,
        named,
        kept,
        mut problem,
        ..
    } = prepared;
    let mut notes = Vec::new();
    let matched = match kept {
        Some((project, contents)) => match contents.matched(scene, open) {
            Ok(contents) => Some((Ok(project), contents)),
            Err(error) => {
                problem = Some(error.to_string());
                None
            }
        },
        None => None,
    };
    let (project, contents) = matched.unwrap_or_else(|| {
        let contents = Contents::new(SceneRecord::of(scene, open), History::default());
        let project = match &problem {
            Some(problem) => Err(problem.clone()),
            None => create(&file, &contents),
        };
        (project, contents)
    });
    let journal = project
        .and_then(|project| Journal::start(project, &contents, wake).map_err(|error| error.to_string()));
    let labels = contents.history.labels();
    if !named && labels.says_anything() {
        let strokes = labels.strokes.len();
        notes.push(format!(
            "Your earlier work on this scene was recovered: {strokes} {}{}.",
            if strokes == 1 { "stroke" } else { "strokes" },
            if labels.imported.is_some() {
                " and imported labels"
            } else {
                ""
            },
        ));
    }
    notes.extend(contents.warnings.iter().cloned());
    if let Some(maps) = maps {
        for map in &contents.maps {
            maps.publish(Arc::clone(map));
        }
    }
    let (journal, problem) = match journal {
        Ok(journal) => (Some(journal), None),
        Err(error) => (
            None,
            Some(format!("{error} Until then your work is in memory only.")),
        ),
    };
    Attached {
        generation: contents.next_generation(),
        view: contents.view.clone(),
        history: contents.history,
        keeper: Keeper::new(journal, file, named),
        notes,
        problem,
    }
}

/// A project file with labels, and the keeper that goes on in it.
///
/// # Errors
/// A sentence about a file that cannot be written.
pub fn new_project(
    path: PathBuf,
    scene: &Scene,
    open: OpenOptions,
    history: History,
    wake: impl Fn() + Send + 'static,
) -> Result<Keeper, String> {
    let contents = Contents::new(SceneRecord::of(scene, open), history);
    let project = create(&path, &contents)?;
    let journal = Journal::start(project, &contents, wake).map_err(|error| error.to_string())?;
    Ok(Keeper::new(Some(journal), path, true))
}

fn create(file: &Path, contents: &Contents) -> Result<Project, String> {
    if let Some(folder) = file.parent() {
        // A folder that cannot be made is told by the file that cannot be made in it.
        let _ = std::fs::create_dir_all(folder);
    }
    Project::create(file, contents).map_err(|error| error.to_string())
}
