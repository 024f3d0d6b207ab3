//! Whatever is wrong with what is given, the program says so in one sentence and writes nothing.
#![allow(clippy::unwrap_used, reason = "a test ends where it fails")]

use std::fs;
use std::path::Path;
use std::process::Command;

use inplace_core::project::Project;
use inplace_core::scene::SceneSource;
use inplace_tests::{
    OnDisk, Running, Small, contents, contents_of, files_below, inplace, label, one_line, succeed,
};
use serde_json::json;

/// The command fails with one sentence that says all of `parts`, and leaves no file in the results.
#[track_caller]
fn assert_refused(disk: &OnDisk, what: &str, mut command: Command, parts: &[&str]) {
    let outcome = Running::to_the_end(&mut command);
    assert_eq!(outcome.code, Some(1), "{what}: {outcome:?}");
    assert_eq!(outcome.stdout, "", "{what}");
    let line = one_line(&outcome.stderr);
    for part in parts {
        assert!(line.contains(part), "{what}: \"{part}\" is not in: {line}");
    }
    let left = files_below(&disk.path("out"));
    assert!(left.is_empty(), "{what}: left {left:?}");
}

/// Leaves the first half of every file in a folder.
fn cut(folder: &Path) {
    for file in files_below(folder) {
        let bytes = fs::read(&file).unwrap();
        fs::write(&file, &bytes[..bytes.len() / 2]).unwrap();
    }
}

#[test]
fn captures_that_cannot_be_used_are_refused_in_one_sentence() {
    let disk = OnDisk::default();
    let scene = disk.path("room");
    let refused = |what: &str, parts: &[&str]| {
        assert_refused(&disk, what, disk.label(&[]), parts);
        let mut info = inplace();
        info.arg("info").arg(&scene);
        assert_refused(&disk, what, info, parts);
    };
    fs::remove_dir_all(&scene).unwrap();
    refused("missing folder", &["room", "no such folder"]);
    fs::create_dir(&scene).unwrap();
    refused(
        "no capture",
        &["room", "no capture", "rgb/rgb_N.png", "traj_w_c.txt"],
    );
}

#[test]
fn labels_and_options_that_cannot_be_used_are_refused_in_one_sentence() {
    let disk = OnDisk::default();
    let refused_with = |more: &[&str], what: &str, parts: &[&str]| {
        assert_refused(&disk, what, disk.label(more), parts);
    };
    let images = disk.path("predictions");
    let import = ["--import", images.to_str().unwrap()];
    refused_with(&import, "no folder", &["predictions", "is no folder"]);

    let refused = |what: &str, parts: &[&str]| refused_with(&[], what, parts);
    disk.write_strokes(&json!({ "classes": [], "strokes": [] }));
    refused("no classes", &["strokes.json", "no classes"]);
    fs::write(disk.path("strokes.json"), "{ \"classes\": [").unwrap();
    refused("not JSON", &["strokes.json"]);
    fs::write(disk.path("strokes.json"), [0xff, 0xfe, 0x00]).unwrap();
    refused("not text", &["strokes.json"]);
    fs::remove_file(disk.path("strokes.json")).unwrap();
    refused("missing", &["strokes.json"]);
    let without = label(&disk.path("room"), &disk.path("out"));
    assert_refused(&disk, "no strokes file", without, &["room", "--strokes"]);
}

#[test]
fn labels_on_frames_that_the_capture_lacks_are_refused_before_its_images_are_read() {
    let disk = OnDisk::default();
    cut(&disk.path("room/rgb"));
    assert_refused(&disk, "images", disk.label(&[]), &["rgb", "10 of 10 images"]);
    let predictions = disk.path("predictions");
    fs::create_dir(&predictions).unwrap();
    fs::write(predictions.join("rgb_3.png"), "no image").unwrap();
    let import = disk.label(&["--import", predictions.to_str().unwrap()]);
    assert_refused(&disk, "import", import, &["rgb_3.png", "is no label image"]);
    let mut strokes = Small::get().strokes();
    strokes["strokes"][0]["frame"] = json!("rgb_77");
    disk.write_strokes(&strokes);
    assert_refused(&disk, "strokes", disk.label(&[]), &["strokes.json", "rgb_77"]);

    let mut other = contents([64, 48]);
    other.scene.source = SceneSource::Folder(disk.path("room"));
    other
        .scene
        .frames
        .iter_mut()
        .for_each(|frame| frame.stem.push('a'));
    let path = disk.path("work.inplace");
    drop(Project::create(&path, &other).unwrap());
    for name in ["label", "export"] {
        let mut command = inplace();
        command.arg(name).arg(&path).arg("--out").arg(disk.path("out"));
        assert_refused(&disk, name, command, &["room", "none of the 4 frames"]);
    }
}

/// A `transforms.json` with the ten images of the small capture in a folder.
fn transforms(images: &str) -> String {
    let frame = |number: usize| {
        let pose = [[1, 0, 0, number], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]];
        json!({"file_path": format!("{images}/rgb_{number}.png"), "transform_matrix": pose})
    };
    let frames: Vec<_> = (0..10).map(frame).collect();
    json!({"camera_angle_x": 1.5, "frames": frames}).to_string()
}

#[test]
fn labels_among_the_images_of_the_capture_are_refused_before_those_are_read() {
    let disk = OnDisk::default();
    let listing = disk.path("listing");
    fs::create_dir(&listing).unwrap();
    fs::rename(disk.path("room/rgb"), listing.join("color")).unwrap();
    fs::write(listing.join("transforms.json"), transforms("color")).unwrap();
    let project = disk.path("work.inplace");
    let contents = contents_of(&listing, Some(&disk.path("strokes.json")));
    drop(Project::create(&project, &contents).unwrap());
    cut(&listing.join("color"));
    for name in ["label", "export"] {
        let mut command = inplace();
        command.arg(name).arg(&project).arg("--out").arg(&listing);
        assert_refused(
            &disk,
            name,
            command,
            &["listing", "color/ has the capture's own images"],
        );
        assert!(!listing.join("labels").exists());
    }
}

#[test]
fn results_that_cannot_be_written_are_refused_before_any_work() {
    let disk = OnDisk::default();
    let file = disk.path("file");
    fs::write(&file, "mine").unwrap();
    let out = file.join("out");
    let mut label = label(&disk.path("room"), &out);
    label.arg("--strokes").arg(disk.path("strokes.json"));
    let mut demo = inplace();
    demo.args(["demo", "--out"]).arg(&out);
    for (what, command) in [("label", label), ("demo", demo)] {
        assert_refused(&disk, what, command, &["file"]);
        assert_eq!(fs::read(&file).unwrap(), b"mine");
    }
}

#[test]
fn projects_that_cannot_be_used_are_refused_in_one_sentence() {
    let disk = OnDisk::default();
    let path = disk.path("work.inplace");
    let refused = |what: &str, parts: &[&str]| {
        assert_refused(&disk, what, label(&path, &disk.path("out")), parts);
    };
    refused("missing project", &["work.inplace", "no such"]);

    let contents = contents_of(&disk.path("room"), None);
    drop(Project::create(&path, &contents).unwrap());
    refused("nothing to label with", &["work.inplace", "no classes"]);
    let held = Project::open(&path).unwrap();
    refused("open elsewhere", &["work.inplace", "open in another window"]);
    drop(held);
    fs::rename(disk.path("room"), disk.path("elsewhere")).unwrap();
    refused("scene is gone", &["room"]);
}

#[test]
fn views_are_not_written_over_the_capture_that_they_are_of() {
    let disk = OnDisk::default();
    let (room, path) = (disk.path("room"), disk.path("room.inplace"));
    let contents = contents_of(&room, Some(&disk.path("strokes.json")));
    drop(Project::create(&path, &contents).unwrap());
    let poses = fs::read(room.join("traj_w_c.txt")).unwrap();
    let mut export = inplace();
    export.arg("export").arg(&path);
    export.arg("--out").arg(room.join("rgb/.."));
    export.arg("--trajectory").arg(room.join("traj_w_c.txt"));
    assert_refused(&disk, "the capture", export, &["room", "capture itself"]);
    assert_eq!(fs::read(room.join("traj_w_c.txt")).unwrap(), poses);
    assert!(!room.join("labels").exists());
}

#[test]
fn a_small_fault_is_counted_in_a_warning_and_the_rest_is_labelled() {
    let disk = OnDisk::default();
    fs::remove_file(disk.path("room/rgb/rgb_9.png")).unwrap();
    let mut strokes = Small::get().strokes();
    let listed = strokes["strokes"].as_array_mut().unwrap();
    listed.retain(|stroke| stroke["frame"] != "rgb_9");
    disk.write_strokes(&strokes);
    // Depth is measured everywhere: it ends by itself, and a slow machine has no more to tell.
    let outcome = succeed(&mut disk.label(&["--budget", "60"]));
    let warning = one_line(&outcome.stderr);
    assert!(warning.contains("(1 in all)"), "{warning}");
    assert!(warning.contains("rgb/"), "{warning}");
    assert_eq!(files_below(&disk.path("out/labels")).len(), 9);
}

/// Labs keep the images of many captures in one place, with links to them.
#[cfg(unix)]
#[test]
fn images_that_are_links_open_and_those_that_a_file_names_outside_the_folder_need_the_option() {
    let disk = OnDisk::default();
    let (images, outside) = (disk.path("room/rgb"), disk.path("kept"));
    fs::rename(&images, &outside).unwrap();
    std::os::unix::fs::symlink(&outside, &images).unwrap();
    succeed(&mut disk.label(&["--budget", "2"]));
    assert_eq!(files_below(&disk.path("out/labels")).len(), 10);

    let disk = OnDisk::default();
    let listing = disk.path("listing");
    fs::create_dir(&listing).unwrap();
    fs::write(listing.join("transforms.json"), transforms("../room/rgb")).unwrap();
    let mut info = inplace();
    info.arg("info").arg(&listing);
    assert_refused(&disk, "info", info, &["transforms.json", "--outside-files"]);
    let facts = inplace_tests::info(&listing, &["--outside-files"]);
    assert_eq!(facts["frames"], 10);
}
