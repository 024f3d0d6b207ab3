//! The file of the preferences: read at start, written by a thread a moment after a change.

use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;
use std::time::Duration;

use crossbeam_channel::{Receiver, Sender, unbounded};
use inplace_core::export::write_whole;
use serde_json::{Map, Value};

use super::Preferences;

/// The file's version; a file of a later one is not read.
const VERSION: u64 = 1;

/// How long writing waits for the next change.
const A_MOMENT: Duration = Duration::from_millis(400);

/// Why the preferences are not read or kept: a sentence.
#[derive(Debug, thiserror::Error)]
enum StoreError {
    #[error("Your preferences are not kept: a background thread could not be started ({0}).")]
    NoThread(io::Error),
    #[error("{}: your preferences cannot be read ({}); the window starts as it comes.", .0.display(), .1)]
    Unreadable(PathBuf, io::Error),
    #[error(
        "{}: your preferences {} and were set aside as {}; the window starts as it comes.",
        .0.display(), .1, .2.display()
    )]
    SetAside(PathBuf, String, PathBuf),
    #[error("{}: your preferences cannot be written ({}); they hold until the window is closed.", .0.display(), .1)]
    Unwritable(PathBuf, io::Error),
}

/// Keeps the preferences in a file. Dropping it writes what is not written yet and waits for that.
///
/// The file is written whole: of two windows, the one that writes last wins. Entries that this program does not know are
/// kept as they were read.
#[derive(Debug)]
pub struct Store {
    changes: Option<Sender<Map<String, Value>>>,
    problems: Receiver<StoreError>,
    writer: Option<JoinHandle<()>>,
    last: Preferences,
}

impl Store {
    /// Reads the file and starts the thread that writes it. It waits for the disk: call it before the
    /// window is there.
    ///
    /// A file that cannot be read or understood is set aside, a missing one means the preferences as they
    /// come; what went wrong is told by [`Store::problem`].
    pub fn open(path: PathBuf) -> Self {
        let (problem_sender, problems) = unbounded();
        let json = read(&path).unwrap_or_else(|problem| {
            // The receiver is held here.
            let _ = problem_sender.send(problem);
            Map::new()
        });
        let last = Preferences::from_json(&json);
        let (changes, inbox) = unbounded();
        let thread = std::thread::Builder::new().name("inplace-preferences".to_owned());
        let failures = problem_sender.clone();
        let writer = match thread.spawn(move || write_changes(&path, json, &inbox, &failures)) {
            Ok(writer) => Some(writer),
            Err(error) => {
                let _ = problem_sender.send(StoreError::NoThread(error));
                None
            }
        };
        Self {
            changes: Some(changes),
            problems,
            writer,
            last,
        }
    }

    /// What was read.
    pub fn preferences(&self) -> &Preferences {
        &self.last
    }

    /// Has these preferences written if they are others than before; never waits.
    pub fn keep(&mut self, preferences: &Preferences) {
        if *preferences == self.last {
            return;
        }
        self.last.clone_from(preferences);
        if let Some(changes) = &self.changes {
            // Without its thread nothing is kept, as was said.
            let _ = changes.send(preferences.to_json());
        }
    }

    /// A sentence about what went wrong since the last call.
    pub fn problem(&self) -> Option<String> {
        self.problems.try_recv().ok().map(|problem| problem.to_string())
    }

    /// Writes what is not written yet, and waits for that.
    pub fn finish(&mut self) {
        self.changes = None;
        if let Some(writer) = self.writer.take() {
            // A panic has been printed; there is nothing to add.
            let _ = writer.join();
        }
    }
}

impl Drop for Store {
    fn drop(&mut self) {
        self.finish();
    }
}

/// What the file says; empty where there is none.
fn read(path: &Path) -> Result<Map<String, Value>, StoreError> {
    let bytes = match fs::read(path) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Map::new()),
        Err(error) => return Err(set_aside(path, format!("cannot be read ({error})"))),
    };
    let Ok(Value::Object(json)) = serde_json::from_slice(&bytes) else {
        return Err(set_aside(path, "are damaged".to_owned()));
    };
    if json
        .get("version")
        .and_then(Value::as_u64)
        .is_some_and(|version| version > VERSION)
    {
        return Err(set_aside(path, "need a newer Inplace".to_owned()));
    }
    Ok(json)
}

/// Puts a file of which this has to be said out of the way of the next change; returns the sentence.
fn set_aside(path: &Path, what: String) -> StoreError {
    let aside = path.with_extension("set-aside.json");
    match fs::rename(path, &aside) {
        Ok(()) => StoreError::SetAside(path.to_path_buf(), what, aside),
        Err(error) => StoreError::Unreadable(path.to_path_buf(), error),
    }
}

/// The writer's work, until nobody is left to change anything.
fn write_changes(
    path: &Path,
    mut json: Map<String, Value>,
    changes: &Receiver<Map<String, Value>>,
    problems: &Sender<StoreError>,
) {
    json.insert("version".to_owned(), VERSION.into());
    let mut failing = false;
    while let Ok(mut now) = changes.recv() {
        while let Ok(newer) = changes.recv_timeout(A_MOMENT) {
            now = newer;
        }
        json.extend(now);
        match write(path, &json) {
            Ok(()) => failing = false,
            Err(error) => {
                if !failing {
                    // Told once; the owner may have gone.
                    let _ = problems.send(StoreError::Unwritable(path.to_path_buf(), error));
                }
                failing = true;
            }
        }
    }
}

/// Writes the file whole or not at all.
fn write(path: &Path, json: &Map<String, Value>) -> io::Result<()> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)?;
    }
    write_whole(path, &serde_json::to_vec_pretty(json)?).map(drop)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::preferences::PreferenceChange;

    fn changed(store: &Store, change: PreferenceChange) -> Preferences {
        let mut preferences = store.preferences().clone();
        preferences.change(change);
        preferences
    }

    #[test]
    fn preferences_and_keys_that_nobody_knows_survive() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new/preferences.json");
        let mut store = Store::open(path.clone());
        assert_eq!(*store.preferences(), Preferences::default());
        store.keep(&changed(&store, PreferenceChange::Scale(150)));
        drop(store);
        let mut json: Map<String, Value> = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
        json.insert("of_tomorrow".to_owned(), 7.into());
        fs::write(&path, serde_json::to_vec(&json).unwrap()).unwrap();
        let mut store = Store::open(path.clone());
        assert_eq!((store.preferences().scale, store.problem()), (150, None));
        store.keep(&changed(&store, PreferenceChange::Threads(Some(3))));
        drop(store);
        let json: Map<String, Value> = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
        assert_eq!(
            ["of_tomorrow", "threads", "scale"].map(|key| &json[key]),
            [7, 3, 150]
        );
        let files = fs::read_dir(path.parent().unwrap()).unwrap().count();
        assert_eq!(files, 1, "a temporary file was left");
    }

    #[test]
    fn a_damaged_or_newer_file_is_set_aside_with_one_sentence() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("preferences.json");
        for text in ["{ not json", "[1]", r#"{"version": 99, "scale": 200}"#] {
            fs::write(&path, text).unwrap();
            let store = Store::open(path.clone());
            assert_eq!(*store.preferences(), Preferences::default());
            let problem = store.problem().unwrap();
            for part in ["preferences.json", "set-aside"] {
                assert!(problem.contains(part), "{problem}");
            }
            assert_eq!(store.problem(), None);
            assert!(!path.exists());
            let aside = path.with_extension("set-aside.json");
            assert_eq!(fs::read_to_string(aside).unwrap(), text);
        }
    }

    #[test]
    fn what_cannot_be_read_is_kept_beside_what_is_written_next() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("preferences.json");
        fs::create_dir(&path).unwrap();
        let mut store = Store::open(path.clone());
        let problem = store.problem().unwrap();
        assert!(problem.contains("cannot be read"), "{problem}");
        store.keep(&changed(&store, PreferenceChange::Scale(150)));
        store.finish();
        assert!(path.is_file() && path.with_extension("set-aside.json").is_dir());
    }

    #[test]
    fn a_file_that_cannot_be_written_is_told_once() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file/preferences.json");
        fs::write(folder.path().join("file"), "in the way").unwrap();
        let mut store = Store::open(path);
        // What cannot be read for want of a folder is told too.
        let read = store.problem();
        store.keep(&changed(&store, PreferenceChange::Scale(150)));
        store.finish();
        let written = store.problem().unwrap();
        assert!(written.contains("preferences.json"), "{read:?} {written}");
        assert_eq!(store.problem(), None);
    }
}
