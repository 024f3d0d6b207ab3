//! Project files: as bytes, as values in a file that is otherwise whole, and the model in them.

use std::fs;
use std::path::Path;
use std::sync::{Arc, LazyLock, Mutex, PoisonError};

use inplace_core::field::{Preset, Trainer};
use inplace_core::labels::{
    FoundObject, History, ImportedLabels, ImportedMap, LabelImages, LabelSet, Stroke, Trust, rasterise,
};
use inplace_core::project::{Contents, Journal, Opened, Project, SceneRecord, Step};
use inplace_core::scene::{Frame, OpenOptions};
use inplace_core::session::{FrameMap, ModelState};
use rusqlite::Connection;

use super::{Parser, assert_sentence, two_frames, write};

/// The project that is opened, in the folder of a check.
const NAME: &str = "p.inplace";

/// A label image of the first frame.
fn images(trust: Trust) -> LabelImages {
    ImportedLabels::new(vec![ImportedMap::new(0, &[1; 64 * 48])], trust).into()
}

/// A project with something in every table.
fn write_project(path: &Path) {
    let scene = two_frames([64, 48]);
    let mut history = History::new(LabelSet::default());
    history.add_class("wall");
    history.add_class("floor");
    history.add_stroke(Stroke::click(0, 1, [1, 1]));
    history.add_stroke(Stroke::polygon(1, 2, &[[2, 3], [9, 4], [5, 9]]));
    history.import(images(Trust::VOTES));
    let (chair, _) = history.add_class("chair");
    for pixel in [[20, 20], [40, 20]] {
        history.add_object(Stroke::click(1, chair, pixel), &[]);
    }
    history.toggle_checked(1);
    history.add_stroke(Stroke::click(0, 2, [9, 9]));
    history.undo();
    let record = SceneRecord::of(&scene, OpenOptions::default());
    let map = FrameMap::new(0, 3, [64, 48], vec![1; 64 * 48], vec![100; 64 * 48]);
    let mut contents = Contents::new(record, history);
    let part = r#"{"object": {"id": 9, "class": 3, "name": "chair 3"}, "places": [[0, 1.5, 2]]}"#;
    contents.view = Some(format!(r#"{{"parts": [{part}]}}"#));
    contents.maps = vec![Arc::new(map.expect("a value for each pixel"))];
    drop(Project::create(path, &contents).expect("a project can be written"));
    // Small pages make a small file.
    let file = Connection::open(path).expect("the project is there");
    file.execute_batch("PRAGMA page_size = 512; VACUUM")
        .expect("the project can be packed");
}

/// Opens a project and works with it.
fn check(path: &Path) {
    let (mut project, contents) = match Project::open(path) {
        Ok(opened) => opened,
        Err(error) => return assert_sentence(&error.to_string()),
    };
    for warning in &contents.warnings {
        assert_sentence(warning);
    }
    for map in &contents.maps {
        let frame = &contents.scene.frames[map.frame];
        assert_eq!([frame.width, frame.height], [map.width, map.height]);
    }
    for part in contents.parts() {
        assert!(
            part.places.iter().flatten().all(|place| !place.is_nan()),
            "{part:?}"
        );
    }
    let mut history = contents.history.clone();
    while history.undo().is_some() {}
    while history.redo().is_some() {}
    let scene = two_frames([64, 48]);
    let matched = match contents.matched(&scene, OpenOptions::default()) {
        Ok(matched) => matched,
        Err(error) => return assert_sentence(&error.to_string()),
    };
    for (index, Frame { camera, .. }) in scene.frames.iter().enumerate() {
        rasterise(matched.history.labels(), index, camera.width, camera.height);
    }
    let mut history = matched.history;
    history.add_class("new");
    history.import(images(Trust::RIGHT));
    history.undo();
    let edit = history.add_stroke(Stroke::click(0, 1, [3, 4]));
    let mut steps = vec![Step::Do(edit), Step::Undo, Step::Redo];
    let listed: Vec<FoundObject> = history.labels().objects.iter().cloned().map(Into::into).collect();
    if let [first, .., last] = &listed[..] {
        let edits = [
            history.merge_object(first, last),
            history.rename_object(last, "another name"),
            history.delete_object(last.object.id),
            Some(history.toggle_checked(0)),
        ];
        steps.extend(edits.into_iter().flatten().map(Step::Do));
    }
    // A spoilt file may refuse what is written.
    if let Err(error) = project.record(&steps) {
        assert_sentence(&error.to_string());
    }
}

pub(super) const FILE: Parser = Parser::alone("project", |folder, bytes| {
    let path = folder.join(NAME);
    write(&path, bytes);
    check(&path);
    // A journal of the file before would belong to this one.
    let _ = fs::remove_file(folder.join("p.inplace-journal"));
});

/// A project file that may be damaged, and has a backup.
pub(super) const DAMAGED: Parser = Parser {
    name: "damaged_project",
    prepare: |folder| {
        let path = folder.join(NAME);
        write_project(&path);
        let opened = Opened::open(&path).expect("the project is there");
        let project = opened.project.expect("it can be written");
        let journal = Journal::start(project, &opened.contents, || ()).expect("a thread");
        journal.record(Step::Redo);
        let closed = journal.close();
        closed.expect("the project and its backup can be written");
    },
    check: |folder, bytes| {
        let path = folder.join(NAME);
        write(&path, bytes);
        match Opened::open(&path) {
            Ok(Opened {
                damage: Some(sentence),
                project,
                contents,
            }) => {
                assert_sentence(&sentence);
                assert_eq!(contents.history.labels().strokes.len(), 5);
                drop(project.expect("the folder can be written"));
                let aside = folder.join("p-damaged.inplace");
                assert_eq!(fs::read(&aside).expect("the file was put aside"), bytes);
                fs::remove_file(aside).expect("the temporary folder can be written");
                check(&path);
            }
            Ok(_) => {}
            Err(error) => assert_sentence(&error.to_string()),
        }
        // Journals of this file would belong to the next one.
        for name in ["p.inplace-journal", "p-damaged.inplace-journal"] {
            let _ = fs::remove_file(folder.join(name));
        }
    },
};

/// The saved model of a project.
pub(super) const MODEL: Parser = Parser::alone("model_state", |_, bytes| {
    static TRAINER: LazyLock<Mutex<Trainer>> = LazyLock::new(|| {
        let trainer = Trainer::new(Arc::new(two_frames([64, 48])), Preset::Fast, 1);
        Mutex::new(trainer.expect("a field of two frames"))
    });
    let state = ModelState {
        steps: 1,
        tensors: bytes.to_vec(),
    };
    let Ok(tensors) = state.load() else {
        return;
    };
    // A whole field is larger than what is tried here.
    let mut trainer = TRAINER.lock().unwrap_or_else(PoisonError::into_inner);
    assert!(trainer.restore(&tensors, state.steps).is_err());
    assert_eq!(trainer.steps(), 0);
});

/// The lines of a stroke, an edit, the view and a map's label image, with a zero byte after each of the first three.
pub(super) const ROWS: Parser = Parser {
    name: "project_rows",
    prepare: |folder| write_project(&folder.join("whole.inplace")),
    check: |folder, bytes| {
        let mut parts = bytes.splitn(4, |&byte| byte == 0);
        let mut part = || parts.next().unwrap_or_default();
        let (lines, edit, view, png) = (part(), part(), part(), part());
        let texts = [lines, edit, view].map(std::str::from_utf8);
        let [Ok(lines), Ok(edit), Ok(view)] = texts else {
            return;
        };
        let path = folder.join(NAME);
        fs::copy(folder.join("whole.inplace"), &path).expect("the temporary folder can be written");
        let file = Connection::open(&path).expect("the project is there");
        file.execute_batch("PRAGMA synchronous = OFF; PRAGMA journal_mode = OFF")
            .expect("the project can be changed");
        let changed = file
            .execute("UPDATE stroke SET lines = ?1 WHERE id = 1", [lines])
            .and_then(|_| file.execute("UPDATE edit SET change = ?1 WHERE number = 2", [edit]))
            .and_then(|_| file.execute("UPDATE project SET view = ?1", [view]))
            .and_then(|_| file.execute("UPDATE map SET labels = ?1", [png]));
        changed.expect("the project can be changed");
        drop(file);
        check(&path);
    },
};
