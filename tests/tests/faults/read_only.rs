//! Projects on media and in folders that cannot be written.

use std::fs::{self, Permissions};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use inplace_core::project::{Contents, Journal, Opened, Project, ProjectError, Step};
use inplace_tests::{Running, contents};

use crate::{
    SIZE, WriteProtected, assert_done, bound, child, failure, folder_of_child, open_folder, save_elsewhere,
    scribble, write_project,
};

/// The state of a killed program in the middle of a commit: the file half written, and the journal beside it.
fn leave_hot_journal(path: &Path, to: &Path) {
    let database = rusqlite::Connection::open(path).unwrap();
    database.pragma_update(None, "cache_size", 2).unwrap();
    database
        .execute_batch("BEGIN; UPDATE stroke SET class = 2, lines = replace(lines, '[', ' [')")
        .unwrap();
    copy_with(path, to, "-journal");
}

/// Copies a file and the one beside it whose name is longer by this.
fn copy_with(path: &Path, to: &Path, beside: &str) {
    for suffix in ["", beside] {
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
    copy_with(path, to, "-wal");
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
    old.execute_batch(include_str!("../../../core/src/project/fixtures/v1.sql"))
        .unwrap();
    drop(old);
    let _protected = WriteProtected::new(&medium);
    let child = child("read_only::read_a_read_only_medium", &medium);
    assert_done(&Running::to_the_end(&mut bound(&child, root.path())));
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
            .filter(|path| path.is_file())
            .collect();
        files.sort();
        let bytes = files.iter().map(|file| fs::read(file).unwrap());
        files.iter().cloned().zip(bytes).collect()
    };
    let before = state();
    let mut expected = contents(SIZE);
    for number in 0..20 {
        expected.history.add_stroke(scribble(number));
    }
    for name in ["whole", "hot", "log", "damaged", "old"] {
        let path = medium.join(format!("{name}.inplace"));
        let held = Opened::open(&path).unwrap();
        let refusal = held.project.as_ref().unwrap_err();
        assert!(
            matches!(refusal, ProjectError::Unwritable { .. }),
            "{name}: {refusal}"
        );
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

        let elsewhere = tempfile::tempdir().unwrap();
        let saved = elsewhere.path().join("saved.inplace");
        let mut history = held.contents.history.clone();
        let project = Project::create(&saved, &held.contents).unwrap();
        let journal = Journal::start(project, &held.contents, || ()).unwrap();
        journal.record(Step::Do(history.add_stroke(scribble(96))));
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
    let child = child("read_only::work_in_a_read_only_folder", &folder);
    assert_done(&Running::to_the_end(&mut bound(&child, root.path())));
}

#[test]
#[ignore = "a process of its own, which the test above starts"]
fn work_in_a_read_only_folder() {
    let Some(folder) = folder_of_child() else {
        return;
    };
    let path = folder.join("work.inplace");
    let before = fs::read(&path).unwrap();
    let opened = Opened::open(&path).unwrap();
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
