//! What the model does with commands and answers, without a window.
#![allow(clippy::unwrap_used, reason = "a test ends where it fails")]

#[path = "../../src/tests.rs"]
mod images;

use std::sync::{Arc, Mutex};

use inplace_core::scene::{ColorImage, Scene, SceneSource};
use inplace_core::session::{self, Event, MapSlots};
use inplace_model::jobs::{Done, JobTools};
use inplace_model::model::Start;
use inplace_model::opening::Target;
use inplace_model::session_link::{Running, SessionLink};
use inplace_model::workspace::Workspace;
use inplace_model::{Command, Effect, Input, Model};
use tempfile::TempDir;

const SIDE: u32 = 32;

/// A worker that never answers.
struct Silent(Arc<MapSlots>);

impl SessionLink for Silent {
    fn send(&self, _: session::Command) {}

    fn next_event(&self) -> Option<Event> {
        None
    }

    fn maps(&self) -> &Arc<MapSlots> {
        &self.0
    }
}

fn scene() -> Arc<Scene> {
    let image = || ColorImage::new(SIDE, SIDE, vec![90; (3 * SIDE * SIDE) as usize]).unwrap();
    Arc::new(images::scene((0..4).map(|_| image())))
}

/// The model of a window.
struct Stand {
    model: Model,
    tools: JobTools,
    folder: TempDir,
}

impl Stand {
    /// The demo is open.
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let autosave = folder.path().join("autosave.inplace");
        let mut stand = Self {
            model: Model::new(Start::default()),
            tools: JobTools {
                autosave: Arc::new(move |_| autosave.clone()),
                wake: Arc::new(|| ()),
                endings: Vec::new(),
            },
            folder,
        };
        stand.act(Command::Open(Target::Scene(SceneSource::Demo)));
        stand.tell(Input::Session(Event::Opened(scene())));
        stand
    }

    fn act(&mut self, command: Command) {
        self.tell(Input::Command(command));
    }

    /// Tells the model something; jobs but imports are done at once.
    fn tell(&mut self, input: Input) {
        for effect in self.model.update(input) {
            match effect {
                Effect::StartSession(_) => {
                    let maps = Arc::new(MapSlots::default());
                    maps.reset(4);
                    let session = Running::new(Box::new(Silent(maps)));
                    self.tell(Input::SessionStarted(session));
                }
                Effect::Start(job) if job.name != "import" => {
                    let done = Mutex::new(Vec::new());
                    job.run(&self.tools, &|each: Done| done.lock().unwrap().push(each));
                    for done in done.into_inner().unwrap() {
                        self.tell(Input::Done(done));
                    }
                }
                _ => {}
            }
        }
    }

    fn workspace(&self) -> &Workspace {
        self.model.workspace().unwrap()
    }

    /// Whether a message that is shown has these words.
    fn says(&self, words: &str) -> bool {
        self.model.messages.texts().any(|text| text.contains(words))
    }
}

#[test]
fn what_an_import_that_was_cancelled_read_and_what_is_wrong_with_another_scene_is_dropped() {
    let mut stand = Stand::new();
    let trust = inplace_core::labels::Trust::VOTES;
    stand.act(Command::ImportFrom(stand.folder.path().to_path_buf(), trust));
    let ticket = stand.model.importing.unwrap();
    stand.act(Command::CancelImport);
    assert!(stand.says("Nothing was imported."));
    let late = Done::Imported(ticket, Box::new(Err("It came too late.".to_owned())));
    stand.tell(Input::Done(late));
    assert!(!stand.says("too late"));
    let serial = stand.workspace().serial;
    for (of, problem) in [
        (serial, "These poses are inverted."),
        (serial + 1, "Another scene's are."),
    ] {
        stand.tell(Input::Done(Done::PosesChecked(of, vec![problem.to_owned()])));
    }
    assert!(stand.says("These poses are inverted.") && !stand.says("Another scene's"));
}
