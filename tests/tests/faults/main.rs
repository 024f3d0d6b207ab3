//! Damaged files, read-only media and full disks: what is there is used, and nothing is said to be saved that is not.
#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a test ends where it fails")]

mod damaged;
mod full_disk;
mod read_only;

use std::fs::{self, Permissions};
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use inplace_core::labels::{History, Stroke};
use inplace_core::project::{Contents, Journal, JournalEvent, Project, Step};
use inplace_tests::{Outcome, contents};

/// Tells a child process which folder it works in.
const FOLDER: &str = "INPLACE_TEST_FOLDER";
/// Width and height of the frames of projects.
const SIZE: [u32; 2] = [640, 480];
/// A user who owns nothing.
const NOBODY: u32 = 65534;

/// A scribble that takes about five kilobytes in a file.
fn scribble(number: u32) -> Stroke {
    Stroke {
        lines: vec![(0..240).map(|x| [x, number % 480]).collect()],
        ..Stroke::click(number as usize % 4, 1, [0, 0])
    }
}

/// Makes a project with some scribbles, and a backup of it.
fn write_project(path: &Path) {
    let mut contents = contents(SIZE);
    let project = Project::create(path, &contents).unwrap();
    let journal = Journal::start(project, &contents, || ()).unwrap();
    for number in 0..20 {
        journal.record(Step::Do(contents.history.add_stroke(scribble(number))));
    }
    journal.close().unwrap();
}

/// The ignored test of that name in a process of its own.
fn child(test: &str, folder: &Path) -> Command {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--ignored", "--exact", "--nocapture", test]);
    command.env(FOLDER, folder);
    command
}

/// The folder that this child process works in; `None` in the process that runs all tests.
fn folder_of_child() -> Option<PathBuf> {
    std::env::var_os(FOLDER).map(PathBuf::from)
}

fn assert_done(outcome: &Outcome) {
    assert_eq!(outcome.code, Some(0), "{}{}", outcome.stdout, outcome.stderr);
    assert!(outcome.stdout.contains("all of it holds"), "{}", outcome.stdout);
}

/// Takes the right to write a folder and its files away from everybody, until this is dropped.
struct WriteProtected(PathBuf);

impl WriteProtected {
    fn new(folder: &Path) -> Self {
        for file in fs::read_dir(folder).unwrap() {
            let path = file.unwrap().path();
            if path.is_file() {
                fs::set_permissions(path, Permissions::from_mode(0o444)).unwrap();
            }
        }
        fs::set_permissions(folder, Permissions::from_mode(0o555)).unwrap();
        Self(folder.to_path_buf())
    }
}

impl Drop for WriteProtected {
    fn drop(&mut self) {
        // The temporary folder cannot be removed otherwise.
        let _ = fs::set_permissions(&self.0, Permissions::from_mode(0o755));
    }
}

/// A command whose executable anybody can read, run by a user whom permissions bind.
fn bound(command: &Command, root: &Path) -> Command {
    // Permissions do not bind root.
    let mut other = if fs::metadata(root).unwrap().uid() == 0 {
        let executable = root.join("executable");
        fs::copy(command.get_program(), &executable).unwrap();
        fs::set_permissions(&executable, Permissions::from_mode(0o755)).unwrap();
        let mut other = Command::new(executable);
        other.uid(NOBODY).gid(NOBODY);
        other
    } else {
        Command::new(command.get_program())
    };
    other.args(command.get_args());
    copy_environment(command, &mut other);
    other
}

fn copy_environment(from: &Command, to: &mut Command) {
    for (name, value) in from.get_envs() {
        match value {
            Some(value) => to.env(name, value),
            None => to.env_remove(name),
        };
    }
}

/// A temporary folder that anybody can look into.
fn open_folder() -> tempfile::TempDir {
    let root = tempfile::tempdir().unwrap();
    fs::set_permissions(root.path(), Permissions::from_mode(0o755)).unwrap();
    root
}

/// Waits until something could not be written; returns the sentence about it.
fn failure(journal: &Journal) -> String {
    match journal.events().recv_timeout(Duration::from_secs(60)).unwrap() {
        JournalEvent::Failed(sentence) => sentence,
        other => panic!("{other:?}"),
    }
}

/// Saves under a name in another folder and makes sure that everything is there.
fn save_elsewhere(journal: &Journal, folder: &Path, history: &History) {
    let path = folder.join("rescued.inplace");
    journal.save_as(path.clone());
    loop {
        match journal.events().recv_timeout(Duration::from_secs(60)).unwrap() {
            JournalEvent::Saved { path: saved } => {
                assert_eq!(saved, path);
                break;
            }
            JournalEvent::Failed(_) => {}
            other => panic!("{other:?}"),
        }
    }
    assert_eq!(journal.committed(), journal.recorded());
    // It is open: the copy of a file alone is the whole project.
    let copy = folder.join("copy.inplace");
    fs::copy(&path, &copy).unwrap();
    let copied = Contents::read(&copy).unwrap();
    assert_eq!(copied.history.labels(), history.labels());
    assert_eq!(copied.warnings, Vec::<String>::new());
}
