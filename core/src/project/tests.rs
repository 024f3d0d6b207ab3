mod backups;
mod damage;
mod journal;
mod versions;

use std::fs;
use std::time::{Duration, Instant};

use super::*;
use crate::labels::testing::{clicked, label_images, object};
use crate::labels::{ImportedMap, Label, LabelImages, Likeliest, Probabilities, Stroke, Trust};
use crate::scene::{Camera, Frame, OpenOptions, Scene, SceneSource, testing};
use crate::semantics::KnownPart;

/// A folder, and the path of a project in it.
fn place() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("p.inplace");
    (folder, path)
}

/// A scene of tiny frames, in a folder.
fn scene(folder: &Path, stems: &[&str]) -> Scene {
    let camera = Camera::with_horizontal_fov(3, 2, 90.0);
    let frame = |stem: &&str| Frame {
        path: folder.join(stem),
        ..testing::frame(stem, camera, vec![0; 18], None)
    };
    let source = SceneSource::Folder(folder.to_path_buf());
    Scene::new(source, "test", stems.iter().map(frame).collect())
}

/// A project on frames a, b, c with two classes, a stroke on a and on c, and one undone on b.
fn contents(folder: &Path) -> Contents {
    let record = SceneRecord::of(&scene(folder, &["a", "b", "c"]), OpenOptions::default());
    let clicks = [(0, 1, [1, 1]), (2, 2, [2, 0]), (1, 2, [0, 0])];
    let mut history = clicked(&["wall", "floor"], &clicks);
    history.undo();
    Contents::new(record, history)
}

fn map(frame: usize, generation: u64, label: u16) -> Arc<FrameMap> {
    let entropy = (0..6).map(|i| i * 10_000).collect();
    Arc::new(FrameMap::new(frame, generation, [3, 2], vec![label; 6], entropy).unwrap())
}

/// Stem and class of every stroke.
fn labelled(contents: &Contents) -> Vec<(String, u16)> {
    let stems = contents.scene.stems();
    let strokes = contents.history.labels().strokes.values();
    strokes
        .map(|stroke| (stems[stroke.frame].clone(), stroke.class))
        .collect()
}

/// A new project at `path` and its journal.
fn start(path: &Path) -> (Journal, History) {
    let contents = contents(path.parent().unwrap());
    let project = Project::create(path, &contents).unwrap();
    let journal = Journal::start(project, &contents, || ()).unwrap();
    (journal, contents.history)
}

fn click(history: &mut History, x: u32) -> Step {
    Step::Do(history.add_stroke(Stroke::click(0, 1, [x, 0])))
}

fn event(journal: &Journal) -> JournalEvent {
    journal.events().recv_timeout(Duration::from_secs(20)).unwrap()
}

fn wait_for(condition: impl Fn() -> bool) {
    let start = Instant::now();
    while !condition() {
        assert!(start.elapsed() < Duration::from_secs(20), "waited too long");
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// What is in a folder, sorted.
fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

fn assert_saved(path: &Path, history: &History) {
    let (_project, saved) = Project::open(path).unwrap();
    assert_eq!(saved.history.labels(), history.labels());
}

fn assert_same(a: &Contents, b: &Contents) {
    assert_eq!(a.scene, b.scene);
    assert_eq!(a.history.labels(), b.history.labels());
    assert_eq!(a.history.edits(), b.history.edits());
    assert_eq!(a.history.imports(), b.history.imports());
    assert_eq!((&a.view, &a.model, &a.maps), (&b.view, &b.model, &b.maps));
}

#[test]
fn a_project_comes_back_as_it_was_is_open_once_and_undo_and_redo_go_on() {
    let (folder, path) = place();
    let mut contents = contents(folder.path());
    let parts = [KnownPart {
        object: object(3, 2, "chair 3"),
        places: vec![[0.5, -1.25, 2.0]],
    }];
    assert!(contents.parts().is_empty());
    contents.view = Some(serde_json::json!({ "frame": 2, "parts": parts }).to_string());
    contents.maps = vec![map(0, 7, 1), map(2, 6, 300)];
    contents.model = Some(Arc::new(ModelState {
        steps: 1234,
        tensors: vec![1, 2, 3],
    }));
    drop(Project::create(&path, &contents).unwrap());
    let (mut project, mut saved) = Project::open(&path).unwrap();
    let in_use = ProjectError::InUse(path.clone());
    assert_eq!(Project::open(&path).unwrap_err(), in_use);
    assert_eq!(Project::create(&path, &contents).unwrap_err(), in_use);
    assert_same(&saved, &contents);
    assert_eq!(saved.parts(), parts);
    assert!(saved.warnings.is_empty());
    assert_eq!(saved.next_generation(), 8);

    saved.history.redo().unwrap();
    saved.history.undo().unwrap();
    saved.history.undo().unwrap();
    project.record(&[Step::Redo, Step::Undo, Step::Undo]).unwrap();
    let edit = saved.history.delete_class(1).unwrap();
    project.record(&[Step::Do(edit)]).unwrap();
    // Those of the labels of before are gone.
    project.save_maps(&[map(2, 8, 2)]).unwrap();
    project.save_view("{}").unwrap();
    saved.maps = vec![map(2, 8, 2)];
    saved.view = Some("{}".to_owned());
    drop(project);
    let (_project, again) = Project::open(&path).unwrap();
    assert_same(&again, &saved);
    assert_eq!(again.history.redo_name(), None);
}

/// Label images of the frames a and c, the first of which shows an object.
fn images(class: u16) -> LabelImages {
    let stool = object(9, class, "stool");
    let label = Label::new(class, Some(stool.id));
    let maps = vec![
        ImportedMap::with_objects(
            0,
            &[class.into(), label, label, class.into(), label, Label::from(2)],
        ),
        ImportedMap::new(2, &[0, 1, 2, 300, 2, 1]),
    ];
    LabelImages {
        objects: vec![stool],
        ..label_images(maps, Trust::VOTES)
    }
}

fn import(history: &mut History, images: LabelImages) -> [Step; 2] {
    let edit = history.import(images);
    let (id, images) = history.brought_by(&edit).unwrap();
    [Step::Import(id, Arc::clone(images)), Step::Do(edit)]
}

#[test]
fn imported_images_come_back_with_their_history_and_forgotten_ones_leave_the_file() {
    let (folder, path) = place();
    let mut contents = contents(folder.path());
    let mut project = Project::create(&path, &contents).unwrap();
    for images in [images(1), probabilities()] {
        let steps = import(&mut contents.history, images);
        project.record(&steps).unwrap();
    }
    contents.history.undo().unwrap();
    project.record(&[Step::Undo]).unwrap();
    drop(project);
    let (mut project, mut saved) = Project::open(&path).unwrap();
    assert_same(&saved, &contents);
    assert_eq!(saved.history.imports().0.len(), 2);
    assert_eq!(saved.history.redo_name(), Some("import predictions"));

    let edit = saved.history.delete_class(2).unwrap();
    project.record(&[Step::Do(edit)]).unwrap();
    assert_eq!(saved.history.imports().0.len(), 1);
    let edit = saved.history.remove_imported().unwrap();
    project.record(&[Step::Do(edit)]).unwrap();
    drop(project);
    let (project, again) = Project::open(&path).unwrap();
    assert_same(&again, &saved);
    let count = |table: &str| -> i64 {
        let sql = format!("SELECT count(*) FROM {table}");
        project.connection.query_row(&sql, [], |row| row.get(0)).unwrap()
    };
    assert_eq!((count("import"), count("imported_map")), (1, 2));
    drop(project);
    // Written as a whole, as after a failure, it is the same.
    drop(Project::create(&path, &saved).unwrap());
    assert_same(&Project::open(&path).unwrap().1, &saved);
}

#[test]
fn imported_images_follow_their_frames_and_are_left_out_where_a_frame_has_another_size() {
    let (folder, path) = place();
    let options = OpenOptions::default();
    let mut before = contents(folder.path());
    before.history.import(images(1));
    let mut scene = scene(folder.path(), &["c", "x", "a"]);
    let frames = |contents: &Contents| -> Vec<usize> {
        let images = contents.history.labels().imported.clone().unwrap();
        images.maps.iter().map(|map| map.frame).collect()
    };
    let after = before.clone().matched(&scene, options).unwrap();
    assert_eq!(frames(&after), [2, 0]);
    scene.frames[2].camera = Camera::with_horizontal_fov(4, 2, 90.0);
    let after = before.matched(&scene, options).unwrap();
    assert_eq!(frames(&after), [0]);
    let mut warnings = after.warnings.iter();
    let is_told = warnings.any(|warning| warning.contains("left out: 1"));
    assert!(is_told, "{:?}", after.warnings);
    drop(Project::create(&path, &after).unwrap());
    assert_same(&Project::open(&path).unwrap().1, &after);
}

#[test]
fn a_full_disk_is_a_sentence_and_leaves_the_file_as_it_was() {
    let (folder, path) = place();
    let mut contents = contents(folder.path());
    let mut project = Project::create(&path, &contents).unwrap();
    let limit = |project: &Project, pages: i64| {
        let pragma = format!("PRAGMA max_page_count = {pages}");
        project.connection.query_row(&pragma, [], |_| Ok(())).unwrap();
    };
    limit(&project, 1);
    let scribble = Stroke::drawn(0, 1, 0, vec![(0..5000).map(|x| [x, x]).collect()]);
    let edit = contents.history.add_stroke(scribble);
    let error = project.record(&[Step::Do(edit)]).unwrap_err().to_string();
    assert!(error.contains("the disk is full"), "{error}");
    limit(&project, 1_000_000);
    project.rewrite(&contents.scene, &contents.history, "").unwrap();
    drop(project);
    assert_same(&Project::open(&path).unwrap().1, &contents);
}

#[test]
fn save_as_copies_everything_and_finds_the_scene_from_its_new_place() {
    let root = tempfile::tempdir().unwrap();
    let (scene_folder, deep) = (root.path().join("scene"), root.path().join("x/y"));
    fs::create_dir(&scene_folder).unwrap();
    fs::create_dir_all(&deep).unwrap();
    let contents = contents(&scene_folder);
    let project = Project::create(&root.path().join("p.inplace"), &contents).unwrap();
    let target = deep.join("q.inplace");
    fs::write(&target, "an old file").unwrap();
    drop(project.copy_to(&target).unwrap());
    let moved = root.path().join("moved");
    fs::create_dir(&moved).unwrap();
    fs::rename(&scene_folder, moved.join("scene")).unwrap();
    fs::rename(root.path().join("x"), moved.join("x")).unwrap();
    let (_copy, saved) = Project::open(&moved.join("x/y/q.inplace")).unwrap();
    assert!(saved.scene.is_there());
    let place = location::absolute(&moved.join("scene"));
    assert_eq!(saved.scene.source, SceneSource::Folder(place));
    assert_eq!(saved.history.labels(), contents.history.labels());
    assert_eq!(fs::read_dir(moved.join("x/y")).unwrap().count(), 1);
}

#[test]
fn strokes_follow_their_frames_and_vanished_frames_and_changed_images_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let options = OpenOptions::default();
    let unchanged = scene(folder.path(), &["a", "b", "c"]);
    let mut before = contents(folder.path());
    let same = before.clone().matched(&unchanged, options).unwrap();
    assert!(same.pending == contents::Pending::Nothing && same.warnings.is_empty());
    before.maps = vec![map(0, 1, 1), map(2, 1, 2)];
    let moved = scene(folder.path(), &["x", "c", "b"]);
    let after = before.clone().matched(&moved, options).unwrap();
    assert_eq!(labelled(&after), labelled(&before));
    assert_eq!(after.scene.stems(), ["x", "c", "b", "a"]);
    assert_eq!(after.maps.iter().map(|map| map.frame).collect::<Vec<_>>(), [1]);
    let warning = &after.warnings[0];
    let told = "gone: 1 (a); strokes on them, kept but without effect: 1";
    assert!(warning.contains(told), "{warning}");
    let mut history = after.history;
    history.redo().unwrap();
    assert_eq!(history.labels().strokes_of(2).count(), 1);

    let other = scene(folder.path(), &["p", "q"]);
    let error = before.clone().matched(&other, options).unwrap_err();
    assert!(matches!(error, ProjectError::OtherScene(_, 3)));

    fs::write(folder.path().join("b"), "other pixels").unwrap();
    let changed = scene(folder.path(), &["a", "b", "c"]);
    let warnings = before.matched(&changed, options).unwrap().warnings;
    assert!(warnings[0].contains("labelled: 1 (b)"), "{warnings:?}");
}

/// Probabilities of the frames a and c, on a grid that is coarser than theirs.
fn probabilities() -> LabelImages {
    let cell = |class| Likeliest::of([(class, 0.75), (300, 0.25)].into_iter());
    let grid = |classes: [u16; 2]| Probabilities::new([2, 1], [3, 2], classes.map(cell).to_vec()).unwrap();
    let maps = vec![
        ImportedMap::of_probabilities(0, grid([1, 2])),
        ImportedMap::of_probabilities(2, grid([0, 1])),
    ];
    label_images(maps, Trust::new(0.3).unwrap())
}
