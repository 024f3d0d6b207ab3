//! Whatever bytes a file holds, its parser neither panics nor believes them: a check for each parser, which fuzzing
//! and the replay of its seeds (`tests/tests/seeds.rs`) share.

mod captures;
mod imports;
mod labels;
mod opened;
mod projects;

use std::fs;
use std::path::{Path, PathBuf};

use inplace_core::scene::{Camera, ColorImage, Distortion, Frame, Lens, Pixels, Scene, SceneSource};
use tempfile::TempDir;

/// Width and height of the images in the captures of these checks, in pixels.
const SIZE: [u32; 2] = [8, 6];

/// A parser and what must hold of it.
#[derive(Debug)]
struct Parser {
    name: &'static str,
    /// Writes what else there is, into a new folder.
    prepare: fn(&Path),
    /// Asserts what holds of bytes; in that folder.
    check: fn(&Path, &[u8]),
}

impl Parser {
    const fn new(name: &'static str, prepare: fn(&Path), check: fn(&Path, &[u8])) -> Self {
        Self { name, prepare, check }
    }

    /// A parser that needs no other files.
    const fn alone(name: &'static str, check: fn(&Path, &[u8])) -> Self {
        Self::new(name, |_| {}, check)
    }
}

/// All parsers; seeds and fuzz targets are named after them.
const PARSERS: [Parser; 23] = [
    captures::REPLICA_POSES,
    captures::INTRINSICS,
    captures::TRANSFORMS,
    captures::COLMAP_BINARY,
    captures::COLMAP_TEXT,
    captures::TUM,
    captures::SEVEN_SCENES,
    captures::SCANNET,
    captures::CAMERA_PATH,
    captures::COLOR_IMAGE,
    captures::DEPTH_IMAGE,
    labels::STROKES,
    labels::CLASSES,
    labels::LABEL_IMAGE,
    labels::IDS,
    imports::IMAGE,
    imports::ARRAY,
    imports::ARCHIVE,
    imports::OBJECTS,
    projects::FILE,
    projects::DAMAGED,
    projects::ROWS,
    projects::MODEL,
];

/// A parser with a temporary folder of its own.
#[derive(Debug)]
pub struct Fuzzed {
    parser: &'static Parser,
    root: TempDir,
}

impl Fuzzed {
    /// The names of all parsers.
    pub fn names() -> impl Iterator<Item = &'static str> {
        PARSERS.iter().map(|parser| parser.name)
    }

    /// The parser of this name.
    pub fn new(name: &str) -> Self {
        let parser = PARSERS.iter().find(|parser| parser.name == name);
        let parser = parser.expect("a parser of this name");
        let root = tempfile::tempdir().expect("a temporary folder");
        let fuzzed = Self { parser, root };
        fs::create_dir(fuzzed.folder()).expect("a folder");
        // A path that leaves the capture would find this.
        captures::write_color(&fuzzed.root.path().join("outside.png"));
        (parser.prepare)(&fuzzed.folder());
        fuzzed
    }

    fn folder(&self) -> PathBuf {
        self.root.path().join("inside")
    }

    /// Asserts what holds of these bytes.
    pub fn check(&self, bytes: &[u8]) {
        (self.parser.check)(&self.folder(), bytes);
    }
}

/// Writes a file.
fn write(path: &Path, bytes: impl AsRef<[u8]>) {
    fs::write(path, bytes).expect("the temporary folder can be written");
}

/// Makes folders.
fn make(folder: &Path, names: &[&str]) {
    for name in names {
        fs::create_dir_all(folder.join(name)).expect("the temporary folder can be written");
    }
}

/// Asserts that a message is one sentence for people.
fn assert_sentence(message: &str) {
    assert!(!message.is_empty(), "{message:?}");
    assert!(!message.contains(['\n', '\r', '\0']), "{message:?}");
}

/// Two frames of this width and height, the second through a lens.
fn two_frames([width, height]: [u32; 2]) -> Scene {
    let camera = Camera::with_horizontal_fov(width, height, 90.0);
    let lens = Lens {
        image: camera,
        distortion: Distortion::opencv([-0.05]),
    };
    let pinhole = lens.pinhole().expect("a mild lens");
    let frame = |number: usize, camera: Camera, lens: Option<Lens>| Frame {
        stem: format!("rgb_{number}"),
        path: PathBuf::new(),
        camera,
        camera_to_world: glam::Affine3A::IDENTITY,
        pixels: Pixels::new(
            ColorImage::new(camera.width, camera.height, vec![0; 3 * camera.pixels()])
                .expect("three bytes a pixel"),
            None,
        )
        .into(),
        points: Vec::new(),
        lens,
    };
    let frames = vec![frame(0, camera, None), frame(1, pinhole, Some(lens))];
    Scene::new(SceneSource::Demo, "test", frames)
}
