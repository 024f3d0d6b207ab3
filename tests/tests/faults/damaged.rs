//! A damaged project is labelled from its backup.

use std::fs::{self, Permissions};
use std::os::unix::fs::PermissionsExt;

use inplace_core::labels::Stroke;
use inplace_core::project::{Journal, Project, Step};
use inplace_tests::{Running, Small, class_ids, contents_of, label, program};

use crate::{WriteProtected, bound, open_folder};

#[test]
fn a_damaged_project_on_a_read_only_medium_is_labelled_from_its_backup() {
    let root = open_folder();
    let medium = root.path().join("medium");
    let scene_folder = medium.join("room");
    fs::create_dir(&medium).unwrap();
    Small::get().write(&scene_folder);
    let strokes = root.path().join("strokes.json");
    fs::write(&strokes, Small::get().strokes().to_string()).unwrap();
    let path = medium.join("room.inplace");
    let contents = contents_of(&scene_folder, Some(&strokes));
    let mut history = contents.history.clone();
    let class = history.labels().classes[0].id;
    let project = Project::create(&path, &contents).unwrap();
    let journal = Journal::start(project, &contents, || ()).unwrap();
    journal.record(Step::Do(history.add_stroke(Stroke::click(0, class, [1, 1]))));
    journal.close().unwrap();
    let bytes = vec![0; 4096];
    fs::write(&path, &bytes).unwrap();

    let out = root.path().join("out");
    fs::create_dir(&out).unwrap();
    fs::set_permissions(&out, Permissions::from_mode(0o777)).unwrap();
    let _protected = WriteProtected::new(&medium);
    let mut command = label(&path, &out.join("labels-of-room"));
    command.args(["--budget", "8"]);
    assert_eq!(command.get_program(), program());
    let outcome = Running::to_the_end(&mut bound(&command, root.path()));
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    let told = format!("inplace: {}: is damaged", path.display());
    assert!(outcome.stderr.contains(&told), "{outcome:?}");
    assert!(outcome.stderr.contains("its backup of"), "{outcome:?}");
    let (width, height, _) = class_ids(&out.join("labels-of-room/labels/rgb_0.png"));
    assert_eq!((width, height), (64, 48));
    assert_eq!(fs::read(&path).unwrap(), bytes);
}
