//! Images outside the folder of a capture are read where the person allows it, and only there.
#![allow(clippy::unwrap_used, reason = "a test ends where it fails")]

use std::fs;
use std::path::{Path, PathBuf};

use glam::{Mat3, Mat4, Vec3};
use inplace_core::scene::Frame;
use inplace_tests::{Outcome, Running, Small, inplace, one_line};
use serde_json::{Value, json};

/// The frame's entry of a `transforms.json`, with an image beside the folder of the file.
fn entry(frame: &Frame) -> Value {
    let pose = frame.camera_to_world;
    // OpenGL's cameras look along -z with y up.
    let rotation = Mat3::from(pose.matrix3) * Mat3::from_diagonal(Vec3::new(1.0, -1.0, -1.0));
    let matrix = Mat4::from_mat3(rotation);
    let rows: [[f32; 4]; 3] = std::array::from_fn(|row| {
        let [x, y, z, _] = matrix.row(row).to_array();
        [x, y, z, pose.translation[row]]
    });
    let camera = &frame.camera;
    json!({
        "file_path": format!("../room/rgb/{}.png", frame.stem),
        "transform_matrix": rows,
        "fl_x": camera.fx,
        "fl_y": camera.fy,
        "cx": camera.cx,
        "cy": camera.cy,
    })
}

/// A folder with a `transforms.json` alone, whose images lie in the folder `room` beside it.
fn capture(root: &Path) -> PathBuf {
    let small = Small::get();
    small.write(&root.join("room"));
    let folder = root.join("elsewhere");
    fs::create_dir(&folder).unwrap();
    let frames: Vec<Value> = small.scene.frames.iter().map(entry).collect();
    fs::write(
        folder.join("transforms.json"),
        json!({ "frames": frames }).to_string(),
    )
    .unwrap();
    folder
}

fn info(folder: &Path, more: &[&str]) -> Outcome {
    Running::to_the_end(inplace().arg("info").arg(folder).arg("--json").args(more))
}

fn label(root: &Path, folder: &Path, more: &[&str]) -> Outcome {
    let mut command = inplace();
    command.arg("label").arg(folder);
    command.arg("--strokes").arg(root.join("strokes.json"));
    command.arg("--out").arg(root.join("out"));
    Running::to_the_end(command.args(["--budget", "2"]).args(more))
}

#[test]
fn images_outside_the_folder_are_refused_by_name_unless_the_flag_allows_them() {
    let root = tempfile::tempdir().unwrap();
    let folder = capture(root.path());
    let small = Small::get();
    fs::write(root.path().join("strokes.json"), small.strokes().to_string()).unwrap();

    for refused in [info(&folder, &[]), label(root.path(), &folder, &[])] {
        assert_eq!(refused.code, Some(1), "{refused:?}");
        let sentence = one_line(&refused.stderr);
        for part in ["transforms.json", "../room/rgb/rgb_", "--outside-files"] {
            assert!(sentence.contains(part), "{part} is not in: {sentence}");
        }
    }
    assert!(!root.path().join("out").exists());

    let allowed = info(&folder, &["--outside-files"]);
    assert_eq!(allowed.code, Some(0), "{allowed:?}");
    let facts: Value = serde_json::from_str(&allowed.stdout).unwrap();
    assert_eq!(facts["format"], "transforms.json");
    assert_eq!(facts["frames"], small.scene.frames.len());
    let labelled = label(root.path(), &folder, &["--outside-files"]);
    assert_eq!(labelled.code, Some(0), "{labelled:?}");
    let written = fs::read_dir(root.path().join("out/labels")).unwrap().count();
    assert_eq!(written, small.scene.frames.len());
}
