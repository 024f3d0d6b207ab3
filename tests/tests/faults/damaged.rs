//! A damaged project is labelled from what is readable.

use std::fs::{self, Permissions};
use std::os::unix::fs::PermissionsExt;

use inplace_core::labels::{History, Stroke, read_strokes};
use inplace_core::project::{Contents, Project, SceneRecord};
use inplace_core::scene::{OpenOptions, Scene, SceneSource};
use inplace_tests::{Running, Small, class_ids, inplace, program};

use crate::{WriteProtected, bound, open_folder};

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
