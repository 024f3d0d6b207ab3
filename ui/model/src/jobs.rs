//! Work that would make the window wait: each job runs on a thread of its own, and tells what it led to.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use inplace_core::guide::audit::Audit;
use inplace_core::labels::{Class, ImportError, LabelImages};
use inplace_core::project::ProjectError;
use inplace_core::scene::{Scene, SceneSource};

use crate::comparison::{Counted, OtherLabels};
use crate::dialogs::Purpose;
use crate::exporting::ExportProgress;
use crate::opening::{Attached, Prepared, Refusal, Target};
use crate::overview::Summarised;
use crate::project_session::{Ending, ProjectSession};
use crate::versioned::Version;

/// Where the work on a scene that has no project file yet is kept.
pub type AutosavePath = Arc<dyn Fn(&SceneSource) -> PathBuf + Send + Sync>;

/// Work for another thread.
pub struct Job {
    /// Name of its thread.
    pub name: &'static str,
    /// What it led to where it breaks off or cannot begin, for this reason, a sentence.
    pub broken: Arc<dyn Fn(String) -> Done + Send + Sync>,
    pub(crate) work: Box<Work>,
}

/// Does the work; what it tells along the way, and what it led to in the end.
pub(crate) type Work = dyn FnOnce(&JobTools, &(dyn Fn(Done) + Sync)) -> Done + Send;

/// What a job led to.
#[derive(Debug)]
pub enum Done {
    /// The system's dialog was answered; `None` = cancelled, or there is no such dialog here.
    Picked(Purpose, Option<PathBuf>),
    /// This is something to open, as far as can be told at once; or else a sentence.
    LookedAt(Result<Target, String>),
    /// What is kept about a scene was found; the number tells attempts apart.
    Prepared(u64, Box<Result<Prepared, Refusal>>),
    /// A scene was fitted to what is kept about it; or it is not the scene of its project.
    Attached(u64, Arc<Scene>, Box<Result<Attached, ProjectError>>),
    /// This attempt made a project file for work that was in memory only.
    Kept(u64, Box<ProjectSession>),
    /// This attempt made none, for this reason.
    NotKept(u64, String),
    /// This attempt made none, as this file is there already.
    IsThere(u64, PathBuf),
    /// How an export goes.
    Exported(ExportProgress),
    /// How the reading of the project with this number goes that is to be compared with, in words.
    ComparisonGoesOn(u64, String),
    /// The project with this number was read, or could not be.
    OtherRead(u64, Box<Result<OtherLabels, String>>),
    /// Maps of the scene with this serial number were compared by the classes of this version.
    DifferencesCounted(u64, Version, Counted),
    /// The label images of the import with this number were read, or could not be.
    Imported(u64, Box<Result<LabelImages, String>>),
    /// Maps of the scene with this serial number were summed up.
    Summarised(u64, Vec<Summarised>),
    /// Places of the scene with this serial number were drawn, where anything is labelled, or could not be.
    AuditDrawn(u64, Result<Option<Box<Audit>>, String>),
    /// What is probably wrong with the poses or cameras of the scene with this serial number, a sentence each.
    PosesChecked(u64, Vec<String>),
    /// A class list was read, or could not be.
    ClassesRead(Result<Vec<Class>, ImportError>),
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

impl JobTools {
    /// Tools that keep nothing and wake nobody.
    #[cfg(test)]
    pub(crate) fn of_test() -> Self {
        Self {
            autosave: Arc::new(|_| PathBuf::new()),
            wake: Arc::new(|| ()),
            endings: Vec::new(),
        }
    }

    /// Waits until a file is written that was closed before.
    pub(crate) fn wait_for(&self, file: &Path) {
        self.endings.iter().for_each(|ending| ending.wait_for(file));
    }

    /// Wakes the window.
    pub(crate) fn waker(&self) -> impl Fn() + Send + 'static {
        let wake = Arc::clone(&self.wake);
        move || wake()
    }
}

impl Job {
    /// Does the work, and tells what came of it, also where it panics. Touches the disk.
    pub fn run(self, tools: &JobTools, tell: &(dyn Fn(Done) + Sync)) {
        let Self { name, broken, work } = self;
        let done = catch_unwind(AssertUnwindSafe(|| work(tools, tell)));
        // The panic has been printed.
        tell(done.unwrap_or_else(|_| {
            let sentence = format!("An internal error ended work in the background ({name}).");
            broken(sentence + " Your labels are safe; open the scene again to go on.")
        }));
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use inplace_core::labels::Trust;
    use inplace_core::scene::demo::Shot;

    use super::*;
    use crate::effect::Effect;
    use crate::model::{Model, Stage, Start};
    use crate::opening::Target;
    use crate::preferences::Preferences;
    use crate::workspace::Workspace;
    use crate::{Command, Input};

    #[test]
    fn of_a_job_that_panics_one_is_told_and_nothing_waits_for_it_any_more() {
        let mut model = Model::new(Start::default(), Preferences::default());
        let mut workspace = Workspace::of_test(Shot::new(1, [16, 16]).scene(&|_, _| {}));
        workspace.reading = None;
        model.state.stage = Stage::Open(Box::new(workspace));
        let is_busy = |model: &Model| {
            let workspace = model.workspace();
            model.importing.is_some()
                || model.beginning_comparison.is_some()
                || workspace.is_some_and(|workspace| workspace.auditing.is_drawing)
                || matches!(model.stage, Stage::Opening(_))
        };
        for (name, command) in [
            ("import", Command::ImportFrom(PathBuf::new(), Trust::VOTES)),
            ("comparison", Command::CompareWith(PathBuf::new())),
            ("audit", Command::DrawAudit(100)),
            ("open", Command::Open(Target::Scene(SceneSource::Demo))),
        ] {
            let told = Mutex::new(Vec::new());
            for effect in model.update(command) {
                if let Effect::Start(mut job) = effect {
                    job.work = Box::new(|_, _| panic!("a bug"));
                    job.run(&JobTools::of_test(), &|done| told.lock().unwrap().push(done));
                }
            }
            assert!(is_busy(&model), "{name}");
            for done in told.into_inner().unwrap() {
                model.update(Input::Done(done));
            }
            assert!(!is_busy(&model), "{name}");
            let last = model.messages.shown.last().map(|message| &message.text);
            assert!(last.unwrap().contains(&format!("({name})")), "{last:?}");
        }
    }
}
