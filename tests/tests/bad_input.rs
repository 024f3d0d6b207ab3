//! Whatever is wrong with what is given, the program says so in one sentence and writes nothing.
#![allow(clippy::unwrap_used, reason = "a test ends where it fails")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use image::{DynamicImage, GrayImage, RgbImage};
use inplace_core::labels::{History, LabelSet};
use inplace_core::project::{Contents, Project, SceneRecord};
use inplace_core::scene::{OpenOptions, Scene, SceneSource};
use inplace_tests::{Running, Small, inplace, one_line};
use serde_json::{Value, json};
use tempfile::TempDir;

/// A capture with strokes to spoil, and a place for results.
struct Case {
    root: TempDir,
}

impl Case {
    fn new() -> Self {
        let root = tempfile::tempdir().unwrap();
        let case = Self { root };
        Small::get().write(&case.scene());
        case.write_strokes(&Small::get().strokes());
        case
    }

    fn scene(&self) -> PathBuf {
        self.root.path().join("room")
    }

    fn strokes(&self) -> PathBuf {
        self.root.path().join("strokes.json")
    }

    fn out(&self) -> PathBuf {
        self.root.path().join("out")
    }

    fn write_strokes(&self, strokes: &Value) {
        fs::write(self.strokes(), strokes.to_string()).unwrap();
    }

    fn label(&self) -> Command {
        let mut command = inplace();
        command.arg("label").arg(self.scene());
        command.arg("--strokes").arg(self.strokes());
        command.arg("--out").arg(self.out()).args(["--budget", "4"]);
        command
    }

    /// The command fails with one sentence that says all of `parts`, and leaves no file in the results.
    #[track_caller]
    fn assert_refused(&self, what: &str, mut command: Command, parts: &[&str]) {
        let outcome = Running::to_the_end(&mut command);
        assert_eq!(outcome.code, Some(1), "{what}: {outcome:?}");
        assert_eq!(outcome.stdout, "", "{what}");
        let line = one_line(&outcome.stderr);
        for part in parts {
            assert!(line.contains(part), "{what}: \"{part}\" is not in: {line}");
        }
        let left = files_below(&self.out());
        assert!(left.is_empty(), "{what}: left {left:?}");
    }
}

fn files_below(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries
        .flat_map(|entry| {
            let path = entry.path();
            if path.is_dir() {
                files_below(&path)
            } else {
                vec![path]
            }
        })
        .collect()
}

/// Numbers of the first `count` frames.
fn spoil_images(scene: &Path, count: usize, spoil: impl Fn(PathBuf)) {
    for number in 0..count {
        spoil(scene.join(format!("rgb/rgb_{number}.png")));
    }
}

/// Replaces lines of the trajectory.
fn edit_poses(scene: &Path, edit: impl Fn(usize, &str) -> String) {
    let path = scene.join("traj_w_c.txt");
    let text = fs::read_to_string(&path).unwrap();
    let lines: Vec<String> = text.lines().enumerate().map(|(n, line)| edit(n, line)).collect();
    fs::write(path, lines.join("\n")).unwrap();
}

/// A pose line with its rotation scaled by two.
fn scaled(line: &str) -> String {
    let numbers = line.split_whitespace().enumerate();
    let scaled = numbers.map(|(index, word)| {
        let value: f64 = word.parse().unwrap();
        let rotates = index < 12 && index % 4 < 3;
        (if rotates { 2.0 * value } else { value }).to_string()
    });
    scaled.collect::<Vec<_>>().join(" ")
}

#[test]
fn captures_that_cannot_be_used_are_refused_in_one_sentence() {
    type Spoil = fn(&Path);
    let cases: [(&str, Spoil, &[&str]); 16] = [
        (
            "missing folder",
            |scene| fs::remove_dir_all(scene).unwrap(),
            &["room"],
        ),
        (
            "empty folder",
            |scene| {
                fs::remove_dir_all(scene).unwrap();
                fs::create_dir(scene).unwrap();
            },
            &["room", "rgb/rgb_N.png"],
        ),
        (
            "no poses",
            |scene| fs::remove_file(scene.join("traj_w_c.txt")).unwrap(),
            &["traj_w_c.txt"],
        ),
        (
            "empty poses",
            |scene| fs::write(scene.join("traj_w_c.txt"), "").unwrap(),
            &["traj_w_c.txt"],
        ),
        (
            "no images",
            |scene| fs::remove_dir_all(scene.join("rgb")).unwrap(),
            &["rgb"],
        ),
        (
            "more poses than images",
            |scene| spoil_images(scene, 6, |image| fs::remove_file(image).unwrap()),
            &["traj_w_c.txt", "10 poses", "6 of them"],
        ),
        (
            "unreadable images",
            |scene| spoil_images(scene, 7, |image| fs::write(image, "no image").unwrap()),
            &["rgb_0.png", "7 of 10"],
        ),
        (
            "truncated images",
            |scene| {
                spoil_images(scene, 7, |image| {
                    let bytes = fs::read(&image).unwrap();
                    fs::write(image, &bytes[..bytes.len() / 2]).unwrap();
                });
            },
            &["rgb", "7 of 10"],
        ),
        (
            "images of many sizes",
            |scene| {
                for number in 0..10 {
                    RgbImage::new(20 + number, 20)
                        .save(scene.join(format!("rgb/rgb_{number}.png")))
                        .unwrap();
                }
                fs::remove_file(scene.join("intrinsics.txt")).unwrap();
            },
            &["rgb", "size"],
        ),
        (
            "poses that are not numbers",
            |scene| {
                edit_poses(scene, |_, line| {
                    format!("NaN {}", line.split_once(' ').unwrap().1)
                });
            },
            &["traj_w_c.txt", "10 of 10", "finite"],
        ),
        (
            "poses that are not rigid",
            |scene| edit_poses(scene, |_, line| scaled(line)),
            &["traj_w_c.txt", "10 of 10", "rotation"],
        ),
        (
            "zero focal length",
            |scene| fs::write(scene.join("intrinsics.txt"), "0 0 32 24 64 48").unwrap(),
            &["intrinsics.txt", "focal length"],
        ),
        (
            "broken intrinsics",
            |scene| fs::write(scene.join("intrinsics.txt"), "fx=40").unwrap(),
            &["intrinsics.txt", "line 1"],
        ),
        (
            "intrinsics of other images",
            |scene| fs::write(scene.join("intrinsics.txt"), "40 40 64 48 128 90").unwrap(),
            &["intrinsics.txt", "128x90", "64x48"],
        ),
        (
            "depth of another size",
            |scene| {
                DynamicImage::ImageLuma8(GrayImage::new(32, 32))
                    .into_luma16()
                    .save(scene.join("depth/depth_3.png"))
                    .unwrap();
            },
            &["depth_3.png", "32x32"],
        ),
        (
            "no readable depth",
            |scene| {
                for number in 0..10 {
                    fs::write(scene.join(format!("depth/depth_{number}.png")), "").unwrap();
                }
            },
            &["depth", "10 of 10"],
        ),
    ];
    for (what, spoil, parts) in cases {
        let case = Case::new();
        spoil(&case.scene());
        case.assert_refused(what, case.label(), parts);
        let mut info = inplace();
        info.arg("info").arg(case.scene());
        case.assert_refused(what, info, parts);
    }
}

#[test]
fn the_published_network_is_refused_without_a_budget() {
    let case = Case::new();
    let mut label = inplace();
    label.arg("label").arg(case.scene());
    label.arg("--strokes").arg(case.strokes());
    label.arg("--out").arg(case.out()).args(["--preset", "reference"]);
    case.assert_refused("no budget", label, &["month", "--budget"]);
    let mut window = inplace();
    window.arg(case.scene()).args(["--preset", "reference"]);
    case.assert_refused("window", window, &["month", "--budget"]);
}

#[test]
fn strokes_that_cannot_be_used_are_refused_in_one_sentence() {
    type Spoil = fn(&mut Value);
    let case = Case::new();
    let cases: [(&str, Spoil, &[&str]); 7] = [
        (
            "unknown frame",
            |strokes| strokes["strokes"][1]["frame"] = json!("rgb_77"),
            &["stroke 2", "rgb_77"],
        ),
        (
            "unknown class",
            |strokes| strokes["strokes"][0]["class"] = json!(999),
            &["stroke 1", "999"],
        ),
        (
            "point outside",
            |strokes| strokes["strokes"][0]["points"] = json!([[64, 0]]),
            &["[64, 0]", "64x48"],
        ),
        (
            "negative point",
            |strokes| strokes["strokes"][0]["points"] = json!([[-1, 0]]),
            &["-1"],
        ),
        (
            "no points",
            |strokes| strokes["strokes"][0]["points"] = json!([]),
            &["stroke 1", "no points"],
        ),
        (
            "duplicate class",
            |strokes| strokes["classes"][1]["id"] = strokes["classes"][0]["id"].clone(),
            &["class 1", "twice"],
        ),
        (
            "no classes",
            |strokes| *strokes = json!({ "classes": [], "strokes": [] }),
            &["classes"],
        ),
    ];
    for (what, spoil, parts) in cases {
        let mut strokes = Small::get().strokes();
        spoil(&mut strokes);
        case.write_strokes(&strokes);
        let mut all = vec!["strokes.json"];
        if what == "no classes" {
            all.clear();
        }
        all.extend(parts);
        case.assert_refused(what, case.label(), &all);
    }
    fs::write(case.strokes(), "{ \"classes\": [").unwrap();
    case.assert_refused("not JSON", case.label(), &["strokes.json"]);
    fs::write(case.strokes(), [0xff, 0xfe, 0x00]).unwrap();
    case.assert_refused("not text", case.label(), &["strokes.json"]);
    fs::remove_file(case.strokes()).unwrap();
    case.assert_refused("missing", case.label(), &["strokes.json"]);
    let mut without = inplace();
    without
        .arg("label")
        .arg(case.scene())
        .arg("--out")
        .arg(case.out());
    case.assert_refused("no strokes file", without, &["room", "--strokes"]);
}

#[test]
fn results_that_cannot_be_written_are_refused_before_any_work() {
    let case = Case::new();
    let file = case.root.path().join("file");
    fs::write(&file, "mine").unwrap();
    for command in ["label", "demo"] {
        let mut command = match command {
            "label" => case.label(),
            _ => {
                let mut demo = inplace();
                demo.arg("demo").arg("--out").arg(case.out());
                demo
            }
        };
        let arguments: Vec<_> = command.get_args().map(ToOwned::to_owned).collect();
        let moved = arguments
            .iter()
            .map(|argument| match argument == case.out().as_os_str() {
                true => file.join("out").into_os_string(),
                false => argument.clone(),
            });
        let mut refused = inplace();
        refused.args(moved);
        command = refused;
        case.assert_refused("below a regular file", command, &["file"]);
        assert_eq!(fs::read(&file).unwrap(), b"mine");
    }
}

#[test]
fn files_that_are_no_projects_of_this_version_are_refused() {
    let case = Case::new();
    let path = case.root.path().join("work.inplace");
    let label = || {
        let mut command = inplace();
        command.arg("label").arg(&path).arg("--out").arg(case.out());
        command
    };
    case.assert_refused("missing project", label(), &["work.inplace", "no such"]);
    fs::write(&path, "just a text that is long enough to be looked at").unwrap();
    case.assert_refused(
        "not a project",
        label(),
        &["work.inplace", "not an Inplace project"],
    );
    fs::remove_file(&path).unwrap();

    let options = OpenOptions::default();
    let scene = Scene::open(&SceneSource::Folder(case.scene()), options, &|_, _| {}).unwrap();
    let history = History::new(LabelSet::default());
    let contents = Contents::new(SceneRecord::of(&scene, options), history);
    drop(Project::create(&path, &contents).unwrap());
    case.assert_refused("nothing to label with", label(), &["work.inplace", "no classes"]);
    let held = Project::open(&path).unwrap();
    case.assert_refused(
        "open elsewhere",
        label(),
        &["work.inplace", "open in another window"],
    );
    drop(held);
    let database = rusqlite::Connection::open(&path).unwrap();
    database.pragma_update(None, "user_version", 999).unwrap();
    drop(database);
    case.assert_refused("newer project", label(), &["work.inplace", "newer", "999"]);
}

#[test]
fn a_project_whose_scene_is_gone_is_refused() {
    let case = Case::new();
    let path = case.root.path().join("work.inplace");
    let options = OpenOptions::default();
    let scene = Scene::open(&SceneSource::Folder(case.scene()), options, &|_, _| {}).unwrap();
    let contents = Contents::new(
        SceneRecord::of(&scene, options),
        History::new(LabelSet::default()),
    );
    drop(Project::create(&path, &contents).unwrap());
    fs::remove_dir_all(case.scene()).unwrap();
    let mut command = inplace();
    command.arg("label").arg(&path).arg("--out").arg(case.out());
    case.assert_refused("scene is gone", command, &["room"]);
}

#[test]
fn a_small_fault_is_counted_in_a_warning_and_the_rest_is_labelled() {
    type Spoil = fn(&Path);
    let cases: [(&str, Spoil, usize, &str); 2] = [
        (
            "a bad pose",
            |scene| {
                edit_poses(scene, |number, line| match number {
                    9 => scaled(line),
                    _ => line.to_owned(),
                });
            },
            9,
            "traj_w_c.txt",
        ),
        (
            "a missing image",
            |scene| fs::remove_file(scene.join("rgb/rgb_9.png")).unwrap(),
            9,
            "rgb/",
        ),
    ];
    for (what, spoil, frames, part) in cases {
        let case = Case::new();
        spoil(&case.scene());
        let mut strokes = Small::get().strokes();
        if let Some(strokes) = strokes["strokes"].as_array_mut() {
            strokes.retain(|stroke| stroke["frame"] != "rgb_9");
        }
        case.write_strokes(&strokes);
        let outcome = Running::to_the_end(&mut case.label());
        assert_eq!(outcome.code, Some(0), "{what}: {outcome:?}");
        let warning = one_line(&outcome.stderr);
        assert!(
            warning.contains("(1 in all)") && warning.contains(part),
            "{what}: {warning}"
        );
        let written = fs::read_dir(case.out().join("labels")).unwrap().count();
        assert_eq!(written, frames, "{what}");
    }
}

#[test]
fn label_images_that_cannot_be_used_are_refused_in_one_sentence() {
    let case = Case::new();
    let images = case.root.path().join("predictions");
    let refused = |what: &str, parts: &[&str]| {
        let mut command = case.label();
        command.arg("--import").arg(&images);
        case.assert_refused(what, command, parts);
    };
    refused("no folder", &["predictions", "is no folder"]);
    fs::create_dir(&images).unwrap();
    refused("empty folder", &["predictions", "has no label images"]);
    GrayImage::new(64, 48).save(images.join("other.png")).unwrap();
    refused("other names", &["predictions", "rgb_0.png"]);
    let brown = RgbImage::from_pixel(64, 48, image::Rgb([90, 60, 30]));
    brown.save(images.join("rgb_3.png")).unwrap();
    refused(
        "no class's colour",
        &["rgb_3.png", "(90, 60, 30)", "classes.json"],
    );
    GrayImage::new(32, 20).save(images.join("rgb_3.png")).unwrap();
    refused("another aspect", &["rgb_3.png", "32x20", "64x48"]);
    fs::write(images.join("rgb_3.png"), "no image").unwrap();
    refused("no image", &["rgb_3.png", "is no label image"]);
}
