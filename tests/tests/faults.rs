//! Read-only media and full disks: what is there is used, and nothing is said to be saved that is not.
#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a test ends where it fails")]

use std::collections::BTreeMap;
use std::fs::{self, Permissions};
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use inplace_core::labels::{History, Stroke};
use inplace_core::project::{Contents, Journal, JournalEvent, Opened, Project, ProjectError, SaveAs, Step};
use inplace_tests::{
    FOLDER, Outcome, Running, behind, child, contents, files_below, folder_of_child, strokes_of, succeed,
};
use rusqlite::Connection;

/// Tells a child process on a full disk of a folder on another one.
const ELSEWHERE: &str = "INPLACE_TEST_ELSEWHERE";
/// Where set, tests that mount a small disk must not be skipped.
const REQUIRE_MOUNT: &str = "INPLACE_REQUIRE_MOUNT_TEST";
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

/// Makes a project with some scribbles, and a backup of it; returns what it holds.
fn write_project(path: &Path) -> Contents {
    let mut contents = contents(SIZE);
    let project = Project::create(path, &contents).unwrap();
    let journal = Journal::start(project, &contents, || ()).unwrap();
    for number in 0..20 {
        journal.record(Step::Do(contents.history.add_stroke(scribble(number))));
    }
    journal.close().unwrap();
    contents
}

fn assert_done(outcome: &Outcome) {
    assert_eq!(outcome.code, Some(0), "{}{}", outcome.stdout, outcome.stderr);
    assert!(outcome.stdout.contains("all of it holds"), "{}", outcome.stdout);
}

fn set_mode(path: &Path, mode: u32) {
    fs::set_permissions(path, Permissions::from_mode(mode)).unwrap();
}

/// Takes the right to write a folder and its files away from everybody, until this is dropped.
struct WriteProtected(PathBuf);

impl WriteProtected {
    fn new(folder: &Path) -> Self {
        for file in files_below(folder) {
            set_mode(&file, 0o444);
        }
        set_mode(folder, 0o555);
        Self(folder.to_path_buf())
    }
}

impl Drop for WriteProtected {
    fn drop(&mut self) {
        // The temporary folder cannot be removed otherwise.
        let _ = fs::set_permissions(&self.0, Permissions::from_mode(0o755));
    }
}

/// Saves under a name in another folder and makes sure that everything is there.
fn save_elsewhere(journal: &Journal, folder: &Path, history: &History) {
    let path = folder.join("rescued.inplace");
    journal.save_as(SaveAs {
        path: path.clone(),
        replace: false,
        remove_old: false,
    });
    let mut events = std::iter::from_fn(|| journal.events().recv_timeout(Duration::from_secs(60)).ok());
    let other = events.find(|event| !matches!(event, JournalEvent::Failed(_)));
    assert_eq!(other, Some(JournalEvent::Saved { path: path.clone() }));
    assert_eq!(journal.committed(), journal.recorded());
    // It is open: the copy of a file alone is the whole project.
    let copy = folder.join("copy.inplace");
    fs::copy(&path, &copy).unwrap();
    let copied = Contents::read(&copy).unwrap();
    assert_eq!(copied.history.labels(), history.labels());
    assert_eq!(copied.warnings, Vec::<String>::new());
}

#[test]
fn on_a_full_disk_nothing_is_said_to_be_saved_that_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let inner = child("work_until_the_disk_is_full", folder.path());
    // 256 KiB a file; without the signal, writing more is an error.
    let script = "trap '' XFSZ; ulimit -f 512";
    assert_done(&Running::to_the_end(&mut behind(&["sh", "-c"], script, &inner)));
}

#[test]
fn work_on_a_full_disk_is_rescued_to_another_one() {
    let folder = tempfile::tempdir().unwrap();
    let elsewhere = tempfile::tempdir().unwrap();
    let can_mount = Command::new("unshare")
        .args(["-rm", "mount", "-t", "tmpfs", "-o", "size=64k", "none"])
        .arg(folder.path())
        .output()
        .is_ok_and(|output| output.status.success());
    if !can_mount {
        assert!(
            std::env::var_os(REQUIRE_MOUNT).is_none(),
            "a small disk cannot be mounted with `unshare -rm`"
        );
        println!("skipped: a small disk cannot be mounted here");
        return;
    }
    let mut inner = child("work_until_the_disk_is_full", folder.path());
    inner.env(ELSEWHERE, elsewhere.path());
    let script = format!("mount -t tmpfs -o size=512k none \"${FOLDER}\"");
    let outcome = Running::to_the_end(&mut behind(&["unshare", "-rm", "sh", "-ec"], &script, &inner));
    assert_done(&outcome);
    assert!(outcome.stdout.contains("the disk is full"), "{}", outcome.stdout);
}

#[test]
#[ignore = "a process of its own, which the tests above start"]
fn work_until_the_disk_is_full() {
    let Some(folder) = folder_of_child() else {
        return;
    };
    let path = folder.join("work.inplace");
    let contents = contents(SIZE);
    let project = Project::create(&path, &contents).unwrap();
    let journal = Journal::start(project, &contents, || ()).unwrap();
    let mut history = contents.history;
    let mut sentence = None;
    for number in 0..1000 {
        let last = journal.record(Step::Do(history.add_stroke(scribble(number))));
        while journal.committed() < last && sentence.is_none() {
            sentence = journal.events().recv_timeout(Duration::from_millis(1)).ok();
        }
        if sentence.is_some() {
            break;
        }
    }
    let Some(JournalEvent::Failed(sentence)) = sentence else {
        panic!("{sentence:?}");
    };
    println!("{sentence}");
    assert!(sentence.contains("work.inplace: cannot be saved"), "{sentence}");
    let kept = journal.committed();
    assert_eq!(kept + 1, journal.recorded());
    assert!(kept > 5, "{kept}");
    if let Some(elsewhere) = std::env::var_os(ELSEWHERE) {
        save_elsewhere(&journal, Path::new(&elsewhere), &history);
        journal.close().unwrap();
    } else {
        assert!(journal.close().is_err());
    }

    let opened = Opened::open(&path).unwrap();
    assert_eq!(opened.damage, None);
    assert_eq!(opened.contents.warnings, Vec::<String>::new());
    let expected: Vec<Stroke> = (0..kept as u32).map(scribble).collect();
    assert_eq!(strokes_of(&opened.contents), expected);
    println!("all of it holds");
}

/// A child whose executable anybody can read, run by a user whom permissions bind.
fn bound(command: Command, root: &Path) -> Command {
    // Permissions do not bind root.
    if fs::metadata(root).unwrap().uid() > 0 {
        return command;
    }
    let executable = root.join("executable");
    // By a process of its own: one that another test starts meanwhile would hold a copy being made here open, and what is
    // open for writing cannot be run.
    succeed(Command::new("cp").arg(command.get_program()).arg(&executable));
    set_mode(&executable, 0o755);
    let mut other = Command::new(executable);
    other.args(command.get_args()).uid(NOBODY).gid(NOBODY);
    let variables = command.get_envs();
    other.envs(variables.filter_map(|(name, value)| Some((name, value?))));
    other
}

#[test]
fn a_project_that_cannot_be_written_opens_and_the_work_is_saved_elsewhere() {
    let root = tempfile::tempdir().unwrap();
    set_mode(root.path(), 0o755);
    let [medium, draft, folder] = ["medium", "draft", "folder"].map(|name| root.path().join(name));
    for folder in [&medium, &draft, &folder] {
        fs::create_dir(folder).unwrap();
    }
    write_project(&medium.join("whole.inplace"));
    // A killed program left the file half written and a journal beside it, or another program a write-ahead log.
    for (name, beside, statements) in [
        (
            "hot",
            "-journal",
            "PRAGMA cache_size = 2; BEGIN; UPDATE stroke SET class = 2, lines = replace(lines, '[', ' [')",
        ),
        (
            "log",
            "-wal",
            "PRAGMA journal_mode = WAL; UPDATE project SET view = 'in the log'",
        ),
    ] {
        let path = draft.join(format!("{name}.inplace"));
        write_project(&path);
        let database = Connection::open(&path).unwrap();
        database.execute_batch(statements).unwrap();
        for suffix in ["", beside] {
            let file = format!("{name}.inplace{suffix}");
            fs::copy(draft.join(&file), medium.join(&file)).unwrap();
        }
    }
    write_project(&medium.join("damaged.inplace"));
    let mut bytes = fs::read(medium.join("damaged.inplace")).unwrap();
    bytes[..4096].fill(0);
    fs::write(medium.join("damaged.inplace"), bytes).unwrap();
    let old = Connection::open(medium.join("old.inplace")).unwrap();
    old.execute_batch(include_str!("../../core/src/project/fixtures/v1.sql"))
        .unwrap();
    drop(old);
    write_project(&folder.join("work.inplace"));
    let _protected = [&medium, &folder].map(|folder| WriteProtected::new(folder));
    set_mode(&folder.join("work.inplace"), 0o666);
    let child = child("open_what_cannot_be_written", root.path());
    assert_done(&Running::to_the_end(&mut bound(child, root.path())));
}

#[test]
#[ignore = "a process of its own, which the test above starts"]
fn open_what_cannot_be_written() {
    let Some(root) = folder_of_child() else {
        return;
    };
    read_a_read_only_medium(&root.join("medium"));
    work_in_a_read_only_folder(&root.join("folder/work.inplace"));
    println!("all of it holds");
}

fn read_a_read_only_medium(medium: &Path) {
    let other = fs::write(medium.join("other"), "");
    assert!(other.is_err(), "the medium can be written");
    let state = || -> BTreeMap<PathBuf, Vec<u8>> {
        let bytes = |file: PathBuf| (file.clone(), fs::read(file).unwrap());
        files_below(medium).into_iter().map(bytes).collect()
    };
    let before = state();
    let elsewhere = tempfile::tempdir().unwrap();
    let expected = write_project(&elsewhere.path().join("expected.inplace"));
    for name in ["whole", "hot", "log", "damaged", "old"] {
        let path = medium.join(format!("{name}.inplace"));
        let held = Opened::open(&path).unwrap();
        let refusal = held.project.as_ref().unwrap_err();
        let is_told = matches!(refusal, ProjectError::Unwritable { .. });
        assert!(is_told, "{name}: {refusal}");
        let (damage, labels) = (&held.damage, held.contents.history.labels());
        assert_eq!(damage.is_some(), name == "damaged", "{name}: {damage:?}");
        if name != "old" {
            assert_eq!(labels, expected.history.labels(), "{name}");
        }
        // Others can read it meanwhile.
        let again = Contents::read(&path).unwrap();
        assert_eq!(again.history.labels(), labels, "{name}");
        let is_of_log = again.view.as_deref() == Some("in the log");
        assert_eq!(is_of_log, name == "log", "{name}");

        let saved = elsewhere.path().join(format!("{name}.inplace"));
        let mut history = held.contents.history.clone();
        let project = Project::create(&saved, &held.contents).unwrap();
        let journal = Journal::start(project, &held.contents, || ()).unwrap();
        journal.record(Step::Do(history.add_stroke(scribble(96))));
        journal.close().unwrap();
        let (_project, reopened) = Project::open(&saved).unwrap();
        assert_eq!(reopened.history.labels(), history.labels(), "{name}");
    }
    assert_eq!(state(), before);
}

/// The first edit tells that the folder cannot be written, and stays in memory.
fn work_in_a_read_only_folder(path: &Path) {
    let before = fs::read(path).unwrap();
    let opened = Opened::open(path).unwrap();
    let mut history = opened.contents.history.clone();
    let journal = Journal::start(opened.project.unwrap(), &opened.contents, || ()).unwrap();
    journal.record(Step::Do(history.add_stroke(scribble(99))));
    let told = journal.events().recv_timeout(Duration::from_secs(60)).unwrap();
    let JournalEvent::Failed(sentence) = told else {
        panic!("{told:?}");
    };
    assert!(sentence.contains("its folder cannot be written"), "{sentence}");
    assert_eq!((journal.committed(), journal.recorded()), (0, 1));
    let elsewhere = tempfile::tempdir().unwrap();
    save_elsewhere(&journal, elsewhere.path(), &history);
    drop(journal);
    assert_eq!(fs::read(path).unwrap(), before);
}
