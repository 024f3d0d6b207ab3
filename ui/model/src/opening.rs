//! From a path to an open workspace: what is kept about the scene, the session, the journal.
//!
//! Reading and writing files happens on job threads; the window only passes the pieces on.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use inplace_core::labels::{History, LabelSet};
use inplace_core::project::{Contents, Journal, Opened, Project, ProjectError, SceneRecord};
use inplace_core::scene::{OpenOptions, Scene, SceneSource};
use inplace_core::semantics::KnownPart;
use inplace_core::session::MapSlots;

use crate::jobs::JobTools;
use crate::project_session::ProjectSession;
use crate::text::counted;

/// How often it is tried to open a file that is in use, and the pause between two attempts.
const ATTEMPTS: usize = 10;
const PAUSE: Duration = Duration::from_millis(100);

/// What is to be opened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Target {
    /// A capture; earlier work on it is taken up again.
    Scene(SceneSource),
    /// A project file.
    Project(PathBuf),
    /// A project file or the folder of a capture, found out by looking.
    Path(PathBuf),
    /// A project file whose scene has moved into this folder.
    Moved {
        /// The project file.
        project: PathBuf,
        /// The scene's folder.
        folder: PathBuf,
    },
}

impl Target {
    /// Why it is certainly nothing to open, a sentence; touches the disk.
    pub(crate) fn problem(&self) -> Option<String> {
        let file = |path: &Path| Project::recognise(path).err().map(|error| error.to_string());
        let scene = |source: &SceneSource| match source {
            SceneSource::Demo => None,
            SceneSource::Folder(path) => Scene::recognise(path).err().map(|error| error.to_string()),
        };
        let problem = match self {
            Self::Project(path) => file(path),
            Self::Path(path) if path.is_file() => file(path),
            Self::Path(path) => scene(&SceneSource::from_argument(path)),
            Self::Scene(source) => scene(source),
            Self::Moved { folder, .. } => scene(&SceneSource::Folder(folder.clone())),
        };
        problem.map(|problem| format!("{problem}."))
    }

    /// Name for people.
    pub fn name(&self) -> String {
        match self {
            Self::Scene(SceneSource::Demo) => "the demo scene".to_owned(),
            Self::Scene(SceneSource::Folder(path))
            | Self::Project(path)
            | Self::Path(path)
            | Self::Moved { project: path, .. } => path.file_name().map_or_else(
                || path.display().to_string(),
                |name| name.to_string_lossy().into_owned(),
            ),
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
    kept: Option<Opened>,
    /// Whether all of the scene has to be read before it is shown.
    whole: bool,
    /// Why the work cannot be kept in `file`.
    problem: Option<ProjectError>,
}

impl Prepared {
    /// The model state to go on from.
    pub fn state(&self) -> Option<inplace_core::session::Saved> {
        let model = self.kept.as_ref()?.contents.model.clone();
        model.map(Into::into)
    }

    /// Whether a scene can be shown as it is listed: nothing is kept about it, or that is about the very frames listed.
    /// Another list may name frames that turn out to be unusable, as those that the project does not know may be.
    pub fn is_of(&self, listed: &Scene) -> bool {
        let same = |opened: &Opened| {
            let known = opened.contents.scene.frames.iter();
            known
                .map(|frame| &frame.stem)
                .eq(listed.frames.iter().map(|frame| &frame.stem))
        };
        !self.whole && self.kept.as_ref().is_none_or(same)
    }
}

/// Why something is not opened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// A sentence that says so.
    Sentence(String),
    /// The scene of a project is not where it was.
    SceneGone {
        /// The project file.
        project: PathBuf,
        /// Where its scene was.
        missing: PathBuf,
    },
}

impl From<ProjectError> for Refusal {
    fn from(error: ProjectError) -> Self {
        Self::Sentence(format!("{error}."))
    }
}

/// Finds what is kept about a target. Files that are still being written are waited for.
///
/// # Errors
/// About a project file that cannot be opened, whose scene is gone, or that another window has open.
pub fn prepare(target: Target, open: OpenOptions, tools: &JobTools) -> Result<Prepared, Refusal> {
    match target {
        Target::Project(path) => prepare_project(path, None, open, tools),
        Target::Path(path) if path.is_file() => prepare_project(path, None, open, tools),
        Target::Moved { project, folder } => prepare_project(project, Some(folder), open, tools),
        Target::Path(path) => prepare_scene(SceneSource::from_argument(&path), open, tools),
        Target::Scene(source) => prepare_scene(source, open, tools),
    }
}

/// Opens a project file. One that is in use may be so for a moment only, by an opening that was given up.
fn opened(path: &Path) -> Result<Opened, ProjectError> {
    for _ in 0..ATTEMPTS {
        match Opened::open(path) {
            Err(ProjectError::InUse(_)) => std::thread::sleep(PAUSE),
            opened => return opened,
        }
    }
    Opened::open(path)
}

/// `moved` is where the scene is now, if that is not where the project says.
fn prepare_project(
    path: PathBuf,
    moved: Option<PathBuf>,
    open: OpenOptions,
    tools: &JobTools,
) -> Result<Prepared, Refusal> {
    tools.wait_for(&path);
    let opened = opened(&path)?;
    let scene = &opened.contents.scene;
    let source = match (moved, &scene.source) {
        (Some(folder), _) => SceneSource::Folder(folder),
        (None, SceneSource::Folder(missing)) if !scene.is_there() => {
            return Err(match opened.damage {
                // The backup has the file's name now: opening it again asks for the scene.
                Some(account) => Refusal::Sentence(format!("{account}.")),
                None => Refusal::SceneGone {
                    project: path,
                    missing: missing.clone(),
                },
            });
        }
        (None, source) => source.clone(),
    };
    Ok(Prepared {
        source,
        open: OpenOptions {
            depth: scene.depth && open.depth,
            ..open
        },
        file: path,
        named: true,
        kept: Some(opened),
        whole: false,
        problem: None,
    })
}

fn prepare_scene(source: SceneSource, open: OpenOptions, tools: &JobTools) -> Result<Prepared, Refusal> {
    let file = (tools.autosave)(&source);
    tools.wait_for(&file);
    let (mut kept, mut problem) = (None, None);
    match opened(&file) {
        Ok(opened) => kept = Some(opened),
        Err(ProjectError::Missing(_)) => {}
        Err(ProjectError::InUse(_)) => {
            let scene = match &source {
                SceneSource::Demo => "The demo scene".to_owned(),
                SceneSource::Folder(folder) => folder.display().to_string(),
            };
            return Err(Refusal::Sentence(format!(
                "{scene}: is open in another window, which keeps the work on it; go on there, or close it there first."
            )));
        }
        Err(error) => problem = Some(error),
    }
    Ok(Prepared {
        source,
        open,
        file,
        named: false,
        kept,
        whole: false,
        problem,
    })
}

/// What was said about a scene as it was listed, to go on with when all of it is read; `said` is the history and the
/// view. Waits until the project file is written.
pub(crate) fn prepare_whole(
    project: ProjectSession,
    source: SceneSource,
    open: OpenOptions,
    said: (History, String),
) -> Prepared {
    let (file, named) = (project.path.clone(), project.named);
    let mut contents = Contents::new(project.scene.clone(), said.0);
    project.close();
    contents.view = Some(said.1);
    // What is in the file is in memory, too, and more than that where it could not be written.
    let kept = Opened {
        project: Project::open(&file).map(|(project, _)| project),
        contents,
        damage: None,
    };
    Prepared {
        source,
        open,
        file,
        named,
        kept: Some(kept),
        whole: true,
        problem: None,
    }
}

/// What a workspace starts with.
#[derive(Debug)]
pub struct Attached {
    /// Labels and edits.
    pub history: History,
    /// Generation to count from.
    pub generation: u64,
    /// The objects that no stroke names, as they were found last.
    pub parts: Vec<KnownPart>,
    /// View settings, as the window wrote them.
    pub view: Option<String>,
    /// Where the work is kept.
    pub project: ProjectSession,
    /// What the person should know, a sentence each.
    pub notes: Vec<String>,
    /// What went wrong, a sentence each: a backup was opened instead of a damaged file.
    pub problems: Vec<String>,
    /// Why the work goes on in memory, a sentence; `None` where it does not.
    pub unsaved: Option<String>,
}

/// Fits what is kept to the opened scene, shows the kept maps, and starts the journal.
///
/// # Errors
/// The scene is not the one of its project.
pub fn attach(
    prepared: Prepared,
    scene: &Scene,
    maps: &MapSlots,
    wake: impl Fn() + Send + 'static,
) -> Result<Attached, ProjectError> {
    let Prepared {
        open,
        file,
        named,
        kept,
        mut problem,
        ..
    } = prepared;
    let mut notes = Vec::new();
    let damage = kept.as_ref().and_then(|opened| opened.damage.as_ref());
    let mut unsaved = None;
    let problems: Vec<String> = damage.map(|account| format!("{account}.")).into_iter().collect();
    let matched = match kept {
        Some(Opened {
            project, contents, ..
        }) => match contents.matched(scene, open) {
            Ok(contents) => Some((project, contents)),
            Err(error) if named => return Err(error),
            Err(error) => {
                problem = Some(error);
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
    let journal = project.and_then(|project| Journal::start(project, &contents, wake));
    let labels = contents.history.labels();
    if !named && labels.says_anything() {
        notes.push(recovered(labels));
    }
    notes.extend(contents.warnings.iter().cloned());
    for map in &contents.maps {
        maps.publish(Arc::clone(map));
    }
    let journal = journal
        .map_err(|error| unsaved = Some(format!("{error}. Until then your work is in memory only.")))
        .ok();
    Ok(Attached {
        generation: contents.next_generation(),
        parts: contents.parts(),
        view: contents.view.clone(),
        history: contents.history,
        project: ProjectSession::new(journal, file, named, contents.scene),
        notes,
        problems,
        unsaved,
    })
}

/// A project file with labels of a scene, and the session that goes on in it.
///
/// # Errors
/// A file that cannot be written.
pub fn new_project(
    path: PathBuf,
    scene: SceneRecord,
    history: History,
    wake: impl Fn() + Send + 'static,
) -> Result<ProjectSession, ProjectError> {
    let contents = Contents::new(scene, history);
    let project = create(&path, &contents)?;
    let journal = Journal::start(project, &contents, wake)?;
    Ok(ProjectSession::new(Some(journal), path, true, contents.scene))
}

fn create(file: &Path, contents: &Contents) -> Result<Project, ProjectError> {
    if let Some(folder) = file.parent() {
        // A folder that cannot be made is told by the file that cannot be made in it.
        let _ = std::fs::create_dir_all(folder);
    }
    Project::create(file, contents)
}

/// Work without a name of its own is there again.
fn recovered(labels: &LabelSet) -> String {
    let strokes = labels.strokes.len();
    let frames: std::collections::BTreeSet<usize> =
        labels.strokes.values().map(|stroke| stroke.frame).collect();
    let on = match frames.len() {
        0 => String::new(),
        some => format!(" on {}", counted(some, "frame", "frames")),
    };
    let strokes = counted(strokes, "stroke", "strokes");
    let imported = if labels.imported.is_some() {
        " and imported labels"
    } else {
        ""
    };
    format!("Your earlier work on this scene was recovered: {strokes}{on}{imported}.")
}

#[cfg(test)]
mod tests {
    use inplace_core::scene::demo::Shot;

    use super::*;

    #[test]
    fn a_project_that_was_being_opened_before_is_waited_for() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("p.inplace");
        let scene = Shot::new(1, [16, 16]).scene(&|_, _| {});
        let record = SceneRecord::of(&scene, OpenOptions::default());
        let held = Project::create(&path, &Contents::new(record, History::default())).unwrap();
        let given_up = std::thread::spawn(move || {
            std::thread::sleep(3 * PAUSE);
            drop(held);
        });
        assert!(opened(&path).is_ok());
        given_up.join().unwrap();
    }
}
