//! Damaged files, read-only media and full disks: what can be read is used, and nothing is said to be saved that is not.
#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a test ends where it fails")]

use std::fs::{self, Permissions};
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use inplace_core::labels::{Class, History, LabelSet, Stroke, read_strokes};
use inplace_core::project::{
    Contents, FrameRecord, Journal, JournalEvent, Opened, Owner, Project, ProjectError, SceneRecord, Step,
};
use inplace_core::scene::{OpenOptions, Scene, SceneSource};
use inplace_tests::{Outcome, Running, Small, class_ids, inplace, program};

/// Tells a child process which folder it works in.
const FOLDER: &str = "INPLACE_TEST_FOLDER";
/// Tells a child process on a full disk of a folder on another one.
const ELSEWHERE: &str = "INPLACE_TEST_ELSEWHERE";
/// Where set, tests that mount a small disk must not be skipped.
const REQUIRE_MOUNT: &str = "INPLACE_REQUIRE_MOUNT_TEST";
/// A user who owns nothing.
const NOBODY: u32 = 65534;

fn contents() -> Contents {
    let frame = |number: usize| FrameRecord {
        stem: format!("rgb_{number}"),
        width: 640,
        height: 480,
        bytes: 0,
    };
    let scene = SceneRecord {
        source: SceneSource::Demo,
        depth: true,
        frames: (0..4).map(frame).collect(),
    };
    let labels = LabelSet {
        classes: vec![Class::new(1, "wall"), Class::new(2, "floor")],
        ..LabelSet::default()
    };
    Contents::new(scene, History::new(labels))
}

/// A scribble that takes about five kilobytes in a file.
fn scribble(number: u32) -> Stroke {
    Stroke {
        lines: vec![(0..240).map(|x| [x, number % 480]).collect()],
        ..Stroke::click(number as usize % 4, 1, [0, 0])
    }
}

/// Makes a project with some scribbles.
fn write_project(path: &Path) -> Contents {
    let mut contents = contents();
    for number in 0..20 {
        contents.history.add_stroke(scribble(number));
    }
    drop(Project::create(path, &contents).unwrap());
    contents
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

/// Whether this process may write everything whatever the permissions say.
fn is_root(folder: &Path) -> bool {
    fs::metadata(folder).unwrap().uid() == 0
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
    if !is_root(root) {
        let mut same = Command::new(command.get_program());
        same.args(command.get_args());
        copy_environment(command, &mut same);
        return same;
    }
    let executable = root.join("executable");
    fs::copy(command.get_program(), &executable).unwrap();
    fs::set_permissions(&executable, Permissions::from_mode(0o755)).unwrap();
    let mut other = Command::new(executable);
    other.args(command.get_args()).uid(NOBODY).gid(NOBODY);
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

/// The state of a killed program in the middle of a commit: the file half written, and the journal beside it.
fn leave_hot_journal(path: &Path, to: &Path) {
    let database = rusqlite::Connection::open(path).unwrap();
    database.pragma_update(None, "cache_size", 2).unwrap();
    database
        .execute_batch("BEGIN; UPDATE stroke SET class = 2, lines = replace(lines, '[', ' [')")
        .unwrap();
    for suffix in ["", "-journal"] {
        let name = |path: &Path| PathBuf::from(format!("{}{suffix}", path.display()));
        fs::copy(name(path), name(to)).unwrap();
    }
}

/// The same with a write-ahead log, as another program may leave it.
fn leave_log(path: &Path, to: &Path) {
    let database = rusqlite::Connection::open(path).unwrap();
    database
        .query_row("PRAGMA journal_mode = WAL", [], |_| Ok(()))
        .unwrap();
    database
        .execute_batch("UPDATE project SET view = 'in the log'")
        .unwrap();
    for suffix in ["", "-wal"] {
        let name = |path: &Path| PathBuf::from(format!("{}{suffix}", path.display()));
        fs::copy(name(path), name(to)).unwrap();
    }
}

#[test]
fn a_project_on_a_read_only_medium_opens_and_the_work_is_saved_elsewhere() {
    let root = open_folder();
    let (medium, draft) = (root.path().join("medium"), root.path().join("draft"));
    for folder in [&medium, &draft] {
        fs::create_dir(folder).unwrap();
    }
    write_project(&medium.join("whole.inplace"));
    write_project(&draft.join("hot.inplace"));
    leave_hot_journal(&draft.join("hot.inplace"), &medium.join("hot.inplace"));
    write_project(&draft.join("log.inplace"));
    leave_log(&draft.join("log.inplace"), &medium.join("log.inplace"));
    write_project(&medium.join("damaged.inplace"));
    let mut bytes = fs::read(medium.join("damaged.inplace")).unwrap();
    bytes[..4096].fill(0);
    fs::write(medium.join("damaged.inplace"), bytes).unwrap();
    let old = rusqlite::Connection::open(medium.join("old.inplace")).unwrap();
    old.execute_batch(include_str!("../../core/src/project/fixtures/v1.sql"))
        .unwrap();
    drop(old);
    let _protected = WriteProtected::new(&medium);
    let outcome = Running::to_the_end(&mut bound(
        &child("read_a_read_only_medium", &medium),
        root.path(),
    ));
    assert_done(&outcome);
}

#[test]
#[ignore = "a process of its own, which the test above starts"]
fn read_a_read_only_medium() {
    let Some(medium) = folder_of_child() else {
        return;
    };
    assert!(
        fs::write(medium.join("other"), "").is_err(),
        "the medium can be written"
    );
    let state = || -> Vec<(PathBuf, Vec<u8>)> {
        let mut files: Vec<PathBuf> = fs::read_dir(&medium)
            .unwrap()
            .map(|file| file.unwrap().path())
            .collect();
        files.sort();
        let bytes = files.iter().map(|file| fs::read(file).unwrap());
        files.iter().cloned().zip(bytes).collect()
    };
    let before = state();
    let mut expected = contents();
    for number in 0..20 {
        expected.history.add_stroke(scribble(number));
    }
    for name in ["whole", "hot", "log", "damaged", "old"] {
        let path = medium.join(format!("{name}.inplace"));
        let held = Opened::open(&path, Owner::Person).unwrap();
        let refusal = held.project.as_ref().unwrap_err();
        assert!(
            matches!(refusal, ProjectError::Unwritable { .. }),
            "{name}: {refusal}"
        );
        assert_eq!(
            held.damage.is_some(),
            name == "damaged",
            "{name}: {:?}",
            held.damage
        );
        if name != "old" {
            assert_eq!(
                held.contents.history.labels(),
                expected.history.labels(),
                "{name}"
            );
        }
        // Others can read it meanwhile.
        let again = Contents::read(&path).unwrap();
        assert_eq!(again.history.labels(), held.contents.history.labels(), "{name}");
        assert_eq!(
            again.view.as_deref() == Some("in the log"),
            name == "log",
            "{name}"
        );

        let elsewhere = tempfile::tempdir().unwrap();
        let saved = elsewhere.path().join("saved.inplace");
        let mut history = held.contents.history.clone();
        let project = Project::create(&saved, &held.contents).unwrap();
        let journal = Journal::start(project, &held.contents, || ()).unwrap();
        journal.record(Step::Do(history.add_stroke(scribble(99))));
        journal.close().unwrap();
        let (_project, reopened) = Project::open(&saved).unwrap();
        assert_eq!(reopened.history.labels(), history.labels(), "{name}");
    }
    assert_eq!(state(), before);
    println!("all of it holds");
}

#[test]
fn a_folder_that_cannot_be_written_is_told_with_the_first_edit_which_stays_in_memory() {
    let root = open_folder();
    let folder = root.path().join("folder");
    fs::create_dir(&folder).unwrap();
    write_project(&folder.join("work.inplace"));
    let _protected = WriteProtected::new(&folder);
    fs::set_permissions(folder.join("work.inplace"), Permissions::from_mode(0o666)).unwrap();
    let outcome = Running::to_the_end(&mut bound(
        &child("work_in_a_read_only_folder", &folder),
        root.path(),
    ));
    assert_done(&outcome);
}

#[test]
#[ignore = "a process of its own, which the test above starts"]
fn work_in_a_read_only_folder() {
    let Some(folder) = folder_of_child() else {
        return;
    };
    let path = folder.join("work.inplace");
    let before = fs::read(&path).unwrap();
    let opened = Opened::open(&path, Owner::Person).unwrap();
    let mut history = opened.contents.history.clone();
    let journal = Journal::start(opened.project.unwrap(), &opened.contents, || ()).unwrap();
    journal.record(Step::Do(history.add_stroke(scribble(99))));
    let sentence = failure(&journal);
    assert!(sentence.contains("its folder cannot be written"), "{sentence}");
    assert_eq!((journal.committed(), journal.recorded()), (0, 1));
    let elsewhere = tempfile::tempdir().unwrap();
    save_elsewhere(&journal, elsewhere.path(), &history);
    drop(journal);
    assert_eq!(fs::read(&path).unwrap(), before);
    println!("all of it holds");
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

#[test]
fn on_a_full_disk_nothing_is_said_to_be_saved_that_is_not() {
    let folder = tempfile::tempdir().unwrap();
    // 256 KiB a file; without the signal, writing more is an error.
    let inner = child("work_until_the_disk_is_full", folder.path());
    let mut limited = Command::new("sh");
    limited
        .args(["-c", "trap '' XFSZ; ulimit -f 512; exec \"$0\" \"$@\""])
        .arg(inner.get_program())
        .args(inner.get_args());
    copy_environment(&inner, &mut limited);
    assert_done(&Running::to_the_end(&mut limited));
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
    let inner = child("work_until_the_disk_is_full", folder.path());
    let mut mounted = Command::new("unshare");
    mounted
        .args(["-rm", "sh", "-c"])
        .arg(format!(
            "mount -t tmpfs -o size=512k none \"${FOLDER}\" && exec \"$0\" \"$@\""
        ))
        .arg(inner.get_program())
        .args(inner.get_args());
    copy_environment(&inner, &mut mounted);
    mounted.env(ELSEWHERE, elsewhere.path());
    let outcome = Running::to_the_end(&mut mounted);
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
    let contents = contents();
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

    let opened = Opened::open(&path, Owner::Person).unwrap();
    assert_eq!(
        (opened.damage, opened.contents.warnings),
        (None, Vec::<String>::new())
    );
    let strokes = opened.contents.history.labels().strokes.values();
    let strokes: Vec<Stroke> = strokes.map(|stroke| stroke.as_ref().clone()).collect();
    let expected: Vec<Stroke> = (0..kept as u32).map(scribble).collect();
    assert_eq!(strokes, expected);
    println!("all of it holds");
}

#[test]
fn a_damaged_project_on_a_read_only_medium_is_labelled_with_what_is_readable() {
    let root = open_folder();
    let medium = root.path().join("medium");
    let scene_folder = medium.join("room");
    fs::create_dir(&medium).unwrap();
    Small::get().write(&scene_folder);
    let options = OpenOptions::default();
    let scene = Scene::open(&SceneSource::Folder(scene_folder), options, &|_, _| {}).unwrap();
    let strokes = root.path().join("strokes.json");
    fs::write(&strokes, Small::get().strokes().to_string()).unwrap();
    let mut history = History::default();
    let labels = read_strokes(&strokes, &scene).unwrap();
    for class in &labels.classes {
        history.add_class(&class.name);
    }
    for stroke in labels.strokes.values() {
        let position = labels.classes.iter().position(|class| class.id == stroke.class);
        let class = history.labels().classes[position.unwrap()].id;
        let stroke = Stroke::clone(stroke);
        history.add_stroke(Stroke { class, ..stroke });
    }
    let path = medium.join("room.inplace");
    let contents = Contents::new(SceneRecord::of(&scene, options), history);
    drop(Project::create(&path, &contents).unwrap());
    // All rows of strokes are lost, and the edits have them.
    let database = rusqlite::Connection::open(&path).unwrap();
    let page: usize = database
        .query_row(
            "SELECT rootpage FROM sqlite_schema WHERE name = 'stroke'",
            [],
            |row| row.get::<_, i64>(0),
        )
        .unwrap() as usize;
    drop(database);
    let mut bytes = fs::read(&path).unwrap();
    bytes[(page - 1) * 4096..page * 4096].fill(0xff);
    fs::write(&path, &bytes).unwrap();

    let out = root.path().join("out");
    fs::create_dir(&out).unwrap();
    fs::set_permissions(&out, Permissions::from_mode(0o777)).unwrap();
    let _protected = WriteProtected::new(&medium);
    let mut command = inplace();
    command
        .arg("label")
        .arg(&path)
        .arg("--out")
        .arg(out.join("labels-of-room"));
    command.args(["--budget", "8"]);
    assert_eq!(command.get_program(), program());
    let outcome = Running::to_the_end(&mut bound(&command, root.path()));
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    let told = format!("inplace: {}: is damaged", path.display());
    assert!(outcome.stderr.contains(&told), "{outcome:?}");
    assert!(outcome.stderr.contains("from the edit history"), "{outcome:?}");
    let (width, height, _) = class_ids(&out.join("labels-of-room/labels/rgb_0.png"));
    assert_eq!((width, height), (64, 48));
    assert_eq!(fs::read(&path).unwrap(), bytes);
}
