//! What holds for sequences of 7-Scenes, good and bad.

use std::fs;
use std::path::PathBuf;

use glam::Vec3;

use super::*;
use crate::scene::SceneSource;
use crate::scene::testing::{WITHOUT_DEPTH, assert_refused, assert_warned, open, write_color, write_depth};

const FRAMES: usize = 6;

fn file(folder: &Path, number: usize, kind: &str) -> PathBuf {
    folder.join(format!("frame-{number:06}.{kind}"))
}

/// A sequence of six frames that move along x, two metres from a wall, with two kinds of unknown depth.
fn sequence() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for number in 0..FRAMES {
        write_color(&file(folder.path(), number, "color.png"), 10 * number as u8);
        write_depth(&file(folder.path(), number, "depth.png"), &[0, 65535], 2000);
        // A quarter turn around y: what the camera sees ahead is along x.
        let pose = format!("0 0 1 {}\t\n0 1 0 0.5\n-1 0 0 -3\n0 0 0 1\n", 0.1 * number as f64);
        fs::write(file(folder.path(), number, "pose.txt"), pose).unwrap();
    }
    folder
}

#[test]
fn a_sequence_is_read_with_its_poses_and_depths() {
    let folder = sequence();
    let scene = open(folder.path()).unwrap();
    assert_eq!(scene.format, "7-Scenes");
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    assert_eq!(scene.frames.len(), FRAMES);
    let frame = &scene.frames[3];
    assert_eq!(frame.stem, "frame-000003.color");
    assert_eq!(frame.color().pixel(5), [30; 3]);
    assert!(frame.center().distance(Vec3::new(0.3, 0.5, -3.0)) < 1e-6);
    let depth = frame.depth().unwrap();
    assert_eq!((depth.ray_length(0), depth.ray_length(1)), (None, None));
    // Two metres along z wherever the pixel is: the wall is at x = 2.3.
    for index in [2, 20, 47] {
        let point = frame.center() + depth.ray_length(index).unwrap() * frame.ray_direction(index);
        assert!((point.x - 2.3).abs() < 1e-3, "{point}");
    }
}

#[test]
fn the_published_intrinsics_are_a_note_and_a_file_goes_before_them() {
    let folder = sequence();
    let scene = open(folder.path()).unwrap();
    let camera = scene.frames[0].camera;
    assert_eq!((camera.cx, camera.cy), (4.0, 3.0));
    assert!((camera.fx - 585.0 / 80.0).abs() < 1e-5 && camera.fx == camera.fy);
    assert_eq!(scene.notes.len(), 1);
    assert!(scene.notes[0].contains("585"), "{:?}", scene.notes);
    fs::write(folder.path().join("intrinsics.txt"), "7 7.5 4.5 2.5 8 6").unwrap();
    let scene = open(folder.path()).unwrap();
    let camera = scene.frames[0].camera;
    assert_eq!((camera.fx, camera.fy, camera.cx, camera.cy), (7.0, 7.5, 4.5, 2.5));
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);
}

#[test]
fn jpegs_serve_as_colour_images_but_not_beside_a_png() {
    let folder = sequence();
    let (png, jpeg) = (
        file(folder.path(), 2, "color.png"),
        file(folder.path(), 2, "color.jpg"),
    );
    image::open(&png).unwrap().save(&jpeg).unwrap();
    assert_refused(folder.path(), &["frame-000002.color", "same frame"]);
    fs::remove_file(png).unwrap();
    assert_eq!(open(folder.path()).unwrap().frames[2].path, jpeg);
}

#[test]
fn depth_is_left_out_when_it_is_not_wanted_and_may_be_missing() {
    let folder = sequence();
    fs::write(file(folder.path(), 1, "depth.png"), "spoilt").unwrap();
    let source = SceneSource::Folder(folder.path().to_path_buf());
    let scene = Scene::open(&source, WITHOUT_DEPTH, &|_, _| {}).unwrap();
    assert!(!scene.has_depth() && scene.warnings.is_empty());
    assert_warned(
        folder.path(),
        FRAMES,
        &["without depth", "frame-000001.depth.png"],
    );
    for number in 0..FRAMES {
        fs::remove_file(file(folder.path(), number, "depth.png")).unwrap();
    }
    let scene = open(folder.path()).unwrap();
    assert!(!scene.has_depth() && scene.warnings.is_empty());
}

#[test]
fn frames_with_an_unusable_pose_are_left_out_with_one_warning_and_most_are_an_error() {
    let folder = sequence();
    let spoil = |number: usize, pose: &str| fs::write(file(folder.path(), number, "pose.txt"), pose).unwrap();
    spoil(1, "nan 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1");
    spoil(4, "2 0 0 0\n0 2 0 0\n0 0 2 0\n0 0 0 1");
    assert_warned(
        folder.path(),
        FRAMES - 2,
        &["(2 in all)", "frame-000001.pose.txt", "finite", "not a rotation"],
    );
    for number in 0..4 {
        spoil(number, "inf 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1");
    }
    assert_refused(folder.path(), &["5 of 6 poses", "frame-000000.pose.txt"]);
}

#[test]
fn malformed_poses_are_refused_with_file_and_line() {
    let folder = sequence();
    for (pose, part) in [
        ("1 0 0 0\n0 1 0\n0 0 1 0\n0 0 0 1", "line 2 has 3 numbers"),
        ("1 0 0 0\n0 one 0 0\n0 0 1 0\n0 0 0 1", "line 2: \"one\""),
        ("1 0 0 0\n0 1 0 0\n0 0 1 0\n", "has 3 lines"),
        ("", "has 0 lines"),
    ] {
        fs::write(file(folder.path(), 3, "pose.txt"), pose).unwrap();
        assert_refused(folder.path(), &["frame-000003.pose.txt", part]);
    }
}

#[test]
fn images_without_a_pose_are_left_out_and_most_are_an_error() {
    let folder = sequence();
    fs::remove_file(file(folder.path(), 5, "pose.txt")).unwrap();
    assert_warned(
        folder.path(),
        FRAMES - 1,
        &["no .pose.txt", "(1 in all)", "frame-000005.color.png"],
    );
    for number in 0..4 {
        fs::remove_file(file(folder.path(), number, "pose.txt")).unwrap();
    }
    assert_refused(
        folder.path(),
        &["5 images have no .pose.txt", "frame-000000.color.png"],
    );
}

#[test]
fn depth_of_another_shape_is_refused() {
    let folder = sequence();
    let depth = file(folder.path(), 2, "depth.png");
    image::save_buffer(depth, &[9; 32], 4, 4, image::ColorType::L16).unwrap();
    assert_refused(folder.path(), &["frame-000002.depth.png", "4x4", "8x6"]);
}
