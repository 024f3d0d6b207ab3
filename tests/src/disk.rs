//! The small capture as files, and what commands do with them.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;

use inplace_core::labels::{Class, History, LabelSet, Stroke, read_strokes};
use inplace_core::project::{Contents, FrameRecord, SceneRecord};
use inplace_core::scene::{OpenOptions, Scene, SceneSource};
use inplace_core::semantics::{LabelPropagation, Surface};
use inplace_core::session::FrameMap;
use serde_json::Value;
use tempfile::TempDir;

use crate::{Outcome, Running, Small, inplace};

/// A folder with the small capture in `room` and clicks on it in `strokes.json`.
#[derive(Debug)]
pub struct OnDisk {
    root: TempDir,
}

impl Default for OnDisk {
    fn default() -> Self {
        let root = tempfile::tempdir().expect("a temporary folder");
        let disk = Self { root };
        Small::get().write(&disk.path("room"));
        disk.write_strokes(&Small::get().strokes());
        disk
    }
}

impl OnDisk {
    /// A path in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.root.path().join(name)
    }

    /// Writes another strokes file.
    pub fn write_strokes(&self, strokes: &Value) {
        fs::write(self.path("strokes.json"), strokes.to_string()).expect("the folder can be written");
    }

    /// The command that labels the capture by its strokes into `out`.
    pub fn label(&self, more: &[&str]) -> Command {
        let mut command = label(&self.path("room"), &self.path("out"));
        command.arg("--strokes").arg(self.path("strokes.json")).args(more);
        command
    }
}

/// The command that labels a capture or a project into a folder.
pub fn label(scene: &Path, out: &Path) -> Command {
    let mut command = inplace();
    command.arg("label").arg(scene).arg("--out").arg(out);
    command
}

/// Opens the capture in a folder as the program would.
#[track_caller]
pub fn open(folder: &Path) -> Scene {
    let source = SceneSource::Folder(folder.to_path_buf());
    Scene::open(&source, OpenOptions::default(), &|_, _| {}).expect("the capture can be opened")
}

/// What a project of the capture in a folder holds: the strokes of a file, or nothing.
#[track_caller]
pub fn contents_of(folder: &Path, strokes: Option<&Path>) -> Contents {
    let scene = open(folder);
    let labels = strokes.map(|file| read_strokes(file, &scene).expect("the strokes can be read"));
    let record = SceneRecord::of(&scene, OpenOptions::default());
    Contents::new(record, History::new(labels.unwrap_or_default()))
}

/// The maps of all frames when labels have been propagated over the surface of a scene in a box of this side, in metres.
pub fn propagated(scene: &Arc<Scene>, labels: &LabelSet, side: f32) -> Vec<Arc<FrameMap>> {
    let surface = Surface::build(scene, &[], side).expect("the scene has a surface");
    let mut propagation = LabelPropagation::new(Arc::new(surface));
    propagation.set_labels(scene, labels);
    let frames = 0..scene.frames.len();
    frames
        .map(|frame| Arc::new(propagation.map(scene, frame, 1)))
        .collect()
}

/// What a project without strokes holds: two classes, and four frames of this width and height.
pub fn contents([width, height]: [u32; 2]) -> Contents {
    let frame = |number: usize| FrameRecord {
        stem: format!("rgb_{number}"),
        width,
        height,
        bytes: 0,
    };
    let scene = SceneRecord {
        source: SceneSource::Demo,
        depth: true,
        frames: (0..4).map(frame).collect(),
    };
    let labels = LabelSet::of_classes(vec![Class::new(1, "wall"), Class::new(2, "floor")]);
    Contents::new(scene, History::new(labels))
}

/// The strokes of a project, oldest first.
pub fn strokes_of(contents: &Contents) -> Vec<Stroke> {
    let strokes = contents.history.labels().strokes.values();
    strokes.map(|stroke| stroke.as_ref().clone()).collect()
}

/// Runs a command that has to succeed.
#[track_caller]
pub fn succeed(command: &mut Command) -> Outcome {
    let outcome = Running::to_the_end(command);
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    outcome
}

/// What `inplace info` knows about a scene.
#[track_caller]
pub fn info(scene: &Path, more: &[&str]) -> Value {
    let outcome = succeed(inplace().arg("info").arg(scene).arg("--json").args(more));
    serde_json::from_str(&outcome.stdout).expect("the facts are JSON")
}

/// A file of JSON.
#[track_caller]
pub fn json(path: &Path) -> Value {
    let bytes = fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    serde_json::from_slice(&bytes).expect("the file is JSON")
}

/// All files below a folder, which may be missing.
pub fn files_below(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let below = entries.flat_map(|entry| match entry.path() {
        path if path.is_dir() => files_below(&path),
        path => vec![path],
    });
    below.collect()
}

/// The project files below a folder, backups aside.
pub fn projects_below(folder: &Path) -> Vec<PathBuf> {
    let mut files = files_below(folder);
    files.retain(|path| {
        let mut parts = path.components().map(|part| part.as_os_str());
        let is_backup = parts.any(|part| part == ".inplace-backups");
        !is_backup && path.extension().is_some_and(|end| end == "inplace")
    });
    files
}
