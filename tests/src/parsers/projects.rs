//! Project files: as bytes, and as values in a file that is otherwise whole.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use inplace_core::labels::{
    History, ImportedLabels, ImportedMap, LabelImages, LabelSet, Stroke, Trust, rasterise,
};
use inplace_core::project::{Contents, Project, SceneRecord, Step};
use inplace_core::scene::OpenOptions;
use inplace_core::session::FrameMap;
use rusqlite::Connection;

use super::{Parser, assert_sentence, two_frames};

/// A project with something in every table.
fn write_project(path: &Path) {
    let scene = two_frames();
    let mut history = History::new(LabelSet::default());
    history.add_class("wall");
    history.add_class("floor");
    history.add_stroke(Stroke::click(0, 1, [1, 1]));
    history.add_stroke(Stroke::polygon(1, 2, &[[2, 3], [9, 4], [5, 9]]));
    history.import(LabelImages {
        labels: ImportedLabels {
            maps: vec![ImportedMap::new(0, &[1; 64 * 48])],
            trust: Trust::VOTES,
        },
        classes: Vec::new(),
        unmatched: 0,
    });
    history.add_stroke(Stroke::click(0, 2, [9, 9]));
    history.undo();
    let record = SceneRecord::of(&scene, OpenOptions::default());
    let map = FrameMap::new(0, 3, [64, 48], vec![1; 64 * 48], vec![100; 64 * 48]);
    let mut contents = Contents::new(record, history);
    contents.view = Some("{}".to_owned());
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
    contents
        .warnings
        .iter()
        .for_each(|warning| assert_sentence(warning));
    for map in &contents.maps {
        let frame = &contents.scene.frames[map.frame];
        assert_eq!([frame.width, frame.height], [map.width, map.height]);
    }
    let mut history = contents.history.clone();
    while history.undo().is_some() {}
    while history.redo().is_some() {}
    let scene = two_frames();
    let matched = match contents.matched(&scene, OpenOptions::default()) {
        Ok(matched) => matched,
        Err(error) => return assert_sentence(&error.to_string()),
    };
    for (index, frame) in scene.frames.iter().enumerate() {
        rasterise(
            matched.history.labels(),
            index,
            frame.camera.width,
            frame.camera.height,
        );
    }
    let mut history = matched.history;
    history.add_class("new");
    let edit = history.add_stroke(Stroke::click(0, 1, [3, 4]));
    // A spoilt file may refuse what is written.
    if let Err(error) = project.record(&[Step::Do(edit), Step::Undo, Step::Redo]) {
        assert_sentence(&error.to_string());
    }
}

pub(super) const FILE: Parser = Parser {
    name: "project",
    prepare: |_| {},
    check: |folder, bytes| {
        let path = folder.join("p.inplace");
        fs::write(&path, bytes).expect("the temporary folder can be written");
        check(&path);
        // A journal of the file before would belong to this one.
        let _ = fs::remove_file(folder.join("p.inplace-journal"));
    },
};

/// The lines of a stroke, an edit and a map's label image, with a zero byte after each of the first two.
pub(super) const ROWS: Parser = Parser {
    name: "project_rows",
    prepare: |folder| write_project(&folder.join("whole.inplace")),
    check: |folder, bytes| {
        let mut parts = bytes.splitn(3, |&byte| byte == 0);
        let mut part = || parts.next().unwrap_or_default();
        let (lines, edit, png) = (part(), part(), part());
        let (Ok(lines), Ok(edit)) = (std::str::from_utf8(lines), std::str::from_utf8(edit)) else {
            return;
        };
        let path = folder.join("p.inplace");
        fs::copy(folder.join("whole.inplace"), &path).expect("the temporary folder can be written");
        let file = Connection::open(&path).expect("the project is there");
        file.execute_batch("PRAGMA synchronous = OFF; PRAGMA journal_mode = OFF")
            .expect("the project can be changed");
        let changed = file
            .execute("UPDATE stroke SET lines = ?1 WHERE id = 1", [lines])
            .and_then(|_| file.execute("UPDATE edit SET change = ?1 WHERE number = 2", [edit]))
            .and_then(|_| file.execute("UPDATE map SET labels = ?1", [png]));
        changed.expect("the project can be changed");
        drop(file);
        check(&path);
    },
};
