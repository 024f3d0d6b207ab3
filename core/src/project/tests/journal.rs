//! What the journal was given is in the file, or it says so.

use super::*;

/// A name that no file has yet.
fn under(path: PathBuf, remove_old: bool) -> SaveAs {
    SaveAs {
        path,
        replace: false,
        remove_old,
    }
}

#[test]
fn what_is_committed_is_in_the_file_and_dropping_writes_the_rest() {
    let (_folder, path) = place();
    let (journal, mut history) = start(&path);
    let mut last = 0;
    for x in 0..40 {
        last = journal.record(click(&mut history, x));
    }
    history.undo();
    history.undo();
    history.redo();
    for step in [Step::Undo, Step::Undo, Step::Redo] {
        last = journal.record(step);
    }
    wait_for(|| journal.committed() == last);
    journal.record(click(&mut history, 99));
    journal.save_maps(vec![map(0, 3, 1)]);
    journal.save_view("{}".to_owned());
    drop(journal);
    let (_project, reopened) = Project::open(&path).unwrap();
    assert_eq!(reopened.history.labels(), history.labels());
    assert_eq!(reopened.history.edits(), history.edits());
    assert_eq!((reopened.maps.len(), reopened.view.as_deref()), (1, Some("{}")));
}

#[test]
fn a_failure_is_told_once_and_everything_is_written_when_the_folder_is_back() {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("folder");
    fs::create_dir(&folder).unwrap();
    let (journal, mut history) = start(&folder.join("p.inplace"));
    fs::remove_dir_all(&folder).unwrap();
    journal.record(click(&mut history, 1));
    let JournalEvent::Failed(sentence) = event(&journal) else {
        panic!("a failure is told");
    };
    assert!(sentence.contains("p.inplace"), "{sentence}");
    let last = journal.record(click(&mut history, 2));
    fs::create_dir(&folder).unwrap();
    wait_for(|| journal.committed() == last);
    let told: Vec<_> = std::iter::from_fn(|| Some(event(&journal)))
        .take_while(|event| !matches!(event, JournalEvent::Recovered { .. }))
        .collect();
    assert!(told.len() <= 1, "{told:?}");
    journal.close().unwrap();
    assert_saved(&folder.join("p.inplace"), &history);
}

#[test]
fn after_a_failure_the_steps_that_wait_are_added_unless_the_file_has_them_already() {
    for has_them in [false, true] {
        let (folder, path) = place();
        let contents = contents(folder.path());
        let mut project = Project::create(&path, &contents).unwrap();
        // Gone when everything is written anew.
        let mark = "UPDATE frame SET bytes = 77";
        project.connection.execute(mark, []).unwrap();
        let mut history = contents.history.clone();
        let step = click(&mut history, 1);
        if has_them {
            project.record(std::slice::from_ref(&step)).unwrap();
        }
        let journal = Journal::start(project, &contents, || ()).unwrap();
        let moved = folder.path().join("moved.inplace");
        fs::rename(&path, &moved).unwrap();
        fs::write(&path, "another file").unwrap();
        let last = journal.record(step);
        assert!(matches!(event(&journal), JournalEvent::Failed(_)));
        fs::rename(&moved, &path).unwrap();
        wait_for(|| journal.committed() == last);
        journal.close().unwrap();
        let (_project, saved) = Project::open(&path).unwrap();
        assert_eq!(saved.history.edits(), history.edits());
        assert_eq!(saved.history.labels(), history.labels());
        assert_eq!(saved.scene.frames[0].bytes == 77, !has_them);
    }
}

#[test]
fn work_without_a_name_goes_on_in_the_new_file_and_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let (old, new) = (
        folder.path().join("auto.inplace"),
        folder.path().join("new.inplace"),
    );
    let (journal, mut history) = start(&old);
    journal.record(click(&mut history, 1));
    journal.save_as(under(new.clone(), true));
    journal.record(click(&mut history, 2));
    assert_eq!(event(&journal), JournalEvent::Saved { path: new.clone() });
    journal.save_as(under(folder.path().join("no/such/folder.inplace"), true));
    assert!(matches!(event(&journal), JournalEvent::NotSavedAs(_)));
    journal.record(click(&mut history, 3));
    journal.close().unwrap();
    assert_eq!(names(folder.path()), [".inplace-backups", "new.inplace"]);
    assert_eq!(names(&folder.path().join(".inplace-backups")), ["new.inplace"]);
    assert_saved(&new, &history);
}

#[test]
fn of_files_that_are_saved_one_after_the_other_only_the_one_without_a_name_goes() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let (journal, history) = start(&path("auto.inplace"));
    for name in ["no/such/folder.inplace", "first.inplace", "last.inplace"] {
        journal.save_as(under(path(name), true));
    }
    journal.close().unwrap();
    let left = ["auto.inplace", "first.inplace", "last.inplace"].map(|name| path(name).exists());
    assert_eq!(left, [false, true, true]);
    assert_saved(&path("last.inplace"), &history);
}

#[test]
fn another_file_is_replaced_only_where_that_was_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let (journal, other) = start(&path("other.inplace"));
    journal.close().unwrap();
    let (journal, mut history) = start(&path("own.inplace"));
    journal.record(click(&mut history, 1));
    journal.save_as(under(path("other.inplace"), true));
    assert_eq!(event(&journal), JournalEvent::IsThere(path("other.inplace")));
    assert_saved(&path("other.inplace"), &other);
    journal.save_as(SaveAs {
        replace: true,
        ..under(path("other.inplace"), true)
    });
    let path = path("other.inplace");
    assert_eq!(event(&journal), JournalEvent::Saved { path: path.clone() });
    journal.close().unwrap();
    assert_saved(&path, &history);
}

#[test]
fn a_changed_scene_is_written_before_anything_else() {
    let (folder, path) = place();
    let (journal, _) = start(&path);
    journal.save_maps(vec![map(0, 1, 1), map(1, 1, 2)]);
    journal.close().unwrap();
    let (project, saved) = Project::open(&path).unwrap();
    let changed = scene(folder.path(), &["b", "new", "a"]);
    let mut saved = saved.matched(&changed, OpenOptions::default()).unwrap();
    Journal::start(project, &saved, || ()).unwrap().close().unwrap();
    let (project, reopened) = Project::open(&path).unwrap();
    let maps = reopened.maps.iter();
    let labels: Vec<_> = maps.map(|map| (map.frame, map.labels()[0])).collect();
    assert_eq!(labels, [(0, 2), (2, 1)]);
    // Once more, and labelled before it is written.
    let journal = Journal::start(project, &saved, || ()).unwrap();
    journal.record(Step::Do(saved.history.add_stroke(Stroke::click(1, 1, [0, 0]))));
    journal.close().unwrap();
    let (_project, reopened) = Project::open(&path).unwrap();
    assert_eq!(reopened.scene.stems(), ["b", "new", "a", "c"]);
    assert_eq!(labelled(&reopened), labelled(&saved));
    assert!(reopened.maps.is_empty());
}

#[test]
fn maps_are_kept_for_the_labels_that_they_follow_and_for_no_others() {
    let (_folder, path) = place();
    let (journal, mut history) = start(&path);
    journal.save_maps(vec![map(0, 1, 1)]);
    // Still waiting or written already: they are of the labels of before.
    journal.record(click(&mut history, 2));
    journal.save_maps(vec![map(1, 2, 2)]);
    journal.close().unwrap();
    let (_project, reopened) = Project::open(&path).unwrap();
    assert_eq!(reopened.maps, [map(1, 2, 2)]);
}

#[test]
fn what_is_saved_elsewhere_while_the_file_cannot_be_written_has_no_map_of_other_labels() {
    let (folder, path) = place();
    let elsewhere = folder.path().join("elsewhere.inplace");
    let mut contents = contents(folder.path());
    contents.maps = vec![map(0, 1, 1)];
    let project = Project::create(&path, &contents).unwrap();
    let journal = Journal::start(project, &contents, || ()).unwrap();
    fs::rename(&path, folder.path().join("moved.inplace")).unwrap();
    fs::write(&path, "another file").unwrap();
    journal.record(click(&mut contents.history, 1));
    assert!(matches!(event(&journal), JournalEvent::Failed(_)));
    journal.save_as(under(elsewhere.clone(), true));
    let saved = JournalEvent::Saved {
        path: elsewhere.clone(),
    };
    assert_eq!(event(&journal), saved);
    drop(journal);
    assert_eq!(
        fs::read(&path).unwrap(),
        b"another file",
        "it is not ours to remove"
    );
    assert_saved(&elsewhere, &contents.history);
    assert!(Project::open(&elsewhere).unwrap().1.maps.is_empty());
}

#[test]
fn a_project_whose_name_another_file_has_taken_gets_it_back_when_it_is_saved_under_it() {
    let (folder, path) = place();
    let (journal, mut history) = start(&path);
    fs::rename(&path, folder.path().join("moved.inplace")).unwrap();
    fs::write(&path, "another file").unwrap();
    journal.record(click(&mut history, 1));
    assert!(matches!(event(&journal), JournalEvent::Failed(_)));
    journal.save_as(under(path.clone(), false));
    assert_eq!(event(&journal), JournalEvent::Saved { path: path.clone() });
    journal.record(click(&mut history, 2));
    journal.close().unwrap();
    assert_saved(&path, &history);
}

#[test]
fn a_model_that_does_not_fit_on_the_disk_is_told_and_keeps_no_edit_from_being_written() {
    let (folder, path) = place();
    let mut contents = contents(folder.path());
    let project = Project::create(&path, &contents).unwrap();
    let query = |sql: &str| -> i64 { project.connection.query_row(sql, [], |row| row.get(0)).unwrap() };
    let pages = query("PRAGMA page_count");
    query(&format!("PRAGMA max_page_count = {}", pages + 20));
    let journal = Journal::start(project, &contents, || ()).unwrap();
    journal.save_model(Arc::new(ModelState {
        steps: 1,
        tensors: vec![7; 1 << 20],
    }));
    let JournalEvent::Problem(sentence) = event(&journal) else {
        panic!("it is told");
    };
    let told = "p.inplace: has all labels, but not its newest maps and model: the disk is full";
    assert!(sentence.contains(told), "{sentence}");
    let last = journal.record(click(&mut contents.history, 1));
    wait_for(|| journal.committed() == last);
    assert!(journal.events().is_empty());
    journal.close().unwrap();
    assert_saved(&path, &contents.history);
}
