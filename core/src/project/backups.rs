//! Backups of a project: its last few states, each a project file of its own in a hidden folder beside it.
//!
//! A backup holds what was said: labels, imported images, the edit history and the view. Maps and model can be made
//! again and would make it many times larger. It is written from the history in memory, so that neither damage to
//! the project file reaches it nor does an edit wait for it.

use std::fs;
use std::path::{Path, PathBuf};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant, UNIX_EPOCH};

use super::columns::integer;
use super::location::backups_folder;
use super::{Contents, Project, ProjectError};

/// So many backups are kept.
const KEPT: usize = 3;

/// Least time between the starts of two backups; one more is written at the end.
const INTERVAL: Duration = Duration::from_millis(if cfg!(test) { 20 } else { 300_000 });

/// Time between looks at whether a backup is written.
const POLL: Duration = Duration::from_millis(50);

/// Decides when the backups of an open project are written, and has a thread write them.
#[derive(Debug, Default)]
pub(super) struct Backups {
    /// There are edits that no backup has.
    pending: bool,
    last_start: Option<Instant>,
    running: Option<JoinHandle<Result<(), ProjectError>>>,
    /// The last one could not be written.
    failing: bool,
}

impl Backups {
    /// An edit is in the project file.
    pub(super) fn note_edit(&mut self) {
        self.pending = true;
    }

    /// The work goes on in another file, which has no backup yet.
    pub(super) fn restart(&mut self) {
        // One of the old file is of no concern any more.
        let _ = self.running.take().map(JoinHandle::join);
        self.pending = true;
        self.last_start = None;
    }

    /// Time until [`Backups::work`] has something to do; `None`: until the next edit.
    pub(super) fn pause(&self) -> Option<Duration> {
        if self.running.is_some() {
            return Some(POLL);
        }
        let since = |start: Instant| INTERVAL.saturating_sub(start.elapsed());
        self.pending
            .then(|| self.last_start.map_or(Duration::ZERO, since))
    }

    /// Starts a backup of the project at `path` where one is due. Returns a sentence about one that failed, where
    /// the one before did not.
    pub(super) fn work(&mut self, path: &Path, contents: impl FnOnce() -> Contents) -> Option<String> {
        if self.running.as_ref().is_some_and(|thread| !thread.is_finished()) {
            return None;
        }
        let failure = self.join(path);
        if self.pause() != Some(Duration::ZERO) {
            return failure;
        }
        self.pending = false;
        self.last_start = Some(Instant::now());
        let (project, contents) = (path.to_path_buf(), contents());
        let thread = Builder::new().name("inplace-backup".to_owned());
        match thread.spawn(move || write(&project, &contents)) {
            Ok(thread) => {
                self.running = Some(thread);
                failure
            }
            Err(error) => self.judge(path, Err(ProjectError::writing_file(path, &error))),
        }
    }

    /// Waits for a backup that is being written, and writes another one if that lacks something.
    pub(super) fn finish(&mut self, path: &Path, contents: impl FnOnce() -> Contents) -> Option<String> {
        let failure = self.join(path);
        if !std::mem::take(&mut self.pending) {
            return failure;
        }
        self.judge(path, write(path, &contents()))
    }

    fn join(&mut self, path: &Path) -> Option<String> {
        let outcome = self.running.take()?.join();
        let ended = |_| Err(ProjectError::unwritable(path, "the thread that wrote it ended"));
        self.judge(path, outcome.unwrap_or_else(ended))
    }

    /// A sentence about the first failure after a success.
    fn judge(&mut self, path: &Path, outcome: Result<(), ProjectError>) -> Option<String> {
        let was_failing = std::mem::replace(&mut self.failing, outcome.is_err());
        let reason = outcome.err()?.reason();
        self.pending = true;
        (!was_failing).then(|| format!("{}: no backup of it could be written: {reason}", path.display()))
    }
}

/// Writes a backup of the project at `path`, and removes those that are too many.
pub(super) fn write(path: &Path, contents: &Contents) -> Result<(), ProjectError> {
    let folder = backups_folder(path);
    let writing = |error| ProjectError::writing_file(path, &error);
    fs::create_dir_all(&folder).map_err(writing)?;
    // A killed process may have left half a backup. Whoever has the project open is alone here.
    for entry in fs::read_dir(&folder).map_err(writing)?.flatten() {
        if entry.file_name().to_string_lossy().starts_with('.') {
            fs::remove_file(entry.path()).map_err(writing)?;
        }
    }
    let older = numbered(&folder);
    let number = older.first().map_or(1, |(newest, _)| newest.saturating_add(1));
    drop(Project::create(
        &folder.join(format!("{number}.inplace")),
        contents,
    )?);
    for (_, surplus) in older.into_iter().skip(KEPT - 1) {
        fs::remove_file(surplus).map_err(writing)?;
    }
    Ok(())
}

/// A backup as it was read.
pub(super) struct Backup {
    pub(super) contents: Contents,
    /// Local date and time at which it was written.
    pub(super) time: String,
}

/// The newest backup of the project at `path` that opens; `None` where there is none.
pub(super) fn newest(path: &Path) -> Option<Backup> {
    let backups = numbered(&backups_folder(path));
    backups.into_iter().find_map(|(_, file)| read(&file))
}

fn read(file: &Path) -> Option<Backup> {
    let written = fs::metadata(file).and_then(|metadata| metadata.modified()).ok()?;
    let seconds = integer(written.duration_since(UNIX_EPOCH).ok()?.as_secs());
    let (project, contents) = Project::open(file).ok()?;
    let local = "SELECT strftime('%Y-%m-%d %H:%M', ?1, 'unixepoch', 'localtime')";
    let time = project.connection.query_row(local, [seconds], |row| row.get(0));
    Some(Backup {
        contents,
        time: time.ok()?,
    })
}

/// The backups in a folder, newest first. Their numbers, unlike times, survive a copy and a clock that is put back.
fn numbered(folder: &Path) -> Vec<(u64, PathBuf)> {
    let Ok(entries) = fs::read_dir(folder) else {
        // Most often there is no such folder.
        return Vec::new();
    };
    let number = |entry: &fs::DirEntry| -> Option<u64> {
        let name = entry.file_name();
        name.to_str()?.strip_suffix(".inplace")?.parse().ok()
    };
    let mut numbered: Vec<_> = entries
        .flatten()
        .filter_map(|entry| Some((number(&entry)?, entry.path())))
        .collect();
    numbered.sort_by(|a, b| b.cmp(a));
    numbered
}
