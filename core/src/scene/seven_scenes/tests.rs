//! What holds for sequences of 7-Scenes, good and bad.

use std::fs;
use std::path::PathBuf;

use glam::Vec3;
use tempfile::TempDir;

use crate::scene::Camera;
use crate::scene::testing::{
    change_files, check_changes, open, opened, opened_without_depth, write_color, write_depth,
};

const FRAMES: usize = 6;

/// A sequence of six frames that move along x, two metres from a wall, with two kinds of unknown depth.
fn sequence() -> (TempDir, PathBuf) {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().to_path_buf();
    for number in 0..FRAMES {
        let file = |kind: &str| folder.join(format!("frame-{number:06}.{kind}"));
        write_color(&file("color.png"), 10 * number as u8);
        write_depth(&file("depth.png"), &[0, 65535], 2000);
        // A quarter turn around y: what the camera sees ahead is along x.
        let pose = format!("0 0 1 {}\t\n0 1 0 0.5\n-1 0 0 -3\n0 0 0 1\n", 0.1 * number as f64);
        fs::write(file("pose.txt"), pose).unwrap();
    }
    (parent, folder)
}

#[test]
fn a_sequence_is_read_with_its_poses_depths_and_intrinsics() {
    let (_parent, folder) = sequence();
    let scene = opened(&folder);
    assert_eq!(scene.format, "7-Scenes");
    assert_eq!(scene.frames.len(), FRAMES);
    let frame = &scene.frames[3];
    assert_eq!(frame.stem, "frame-000003.color");
    assert_eq!(frame.color().pixel(5), [30; 3]);
    assert!(frame.center().distance(Vec3::new(0.3, 0.5, -3.0)) < 1e-6);
    let depth = frame.depth().unwrap();
    assert_eq!((depth.ray_length(0), depth.ray_length(1)), (None, None));
    // Two metres along z wherever the pixel is: the wall is at x = 2.3.
    for index in [2, 20, 47] {
        let point = frame.place(index, depth.ray_length(index).unwrap());
        assert!((point.x - 2.3).abs() < 1e-3, "{point}");
    }
    // The published intrinsics are a note, and a file goes before them.
    let camera = frame.camera;
    assert_eq!((camera.cx, camera.cy), (4.0, 3.0));
    assert!((camera.fx - 585.0 / 80.0).abs() < 1e-5 && camera.fx == camera.fy);
    assert_eq!(scene.notes.len(), 1);
    assert!(scene.notes[0].contains("585"), "{:?}", scene.notes);
    change_files(&folder, "intrinsics.txt = 7 7.5 4.5 2.5 8 6");
    let scene = opened(&folder);
    let expected = Camera::new([8, 6], [7.0, 7.5, 4.5, 2.5]);
    assert_eq!(scene.frames[0].camera, expected);
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);
}

/// What opening the sequence says after changes to its files.
const CHANGES: &str = r#"
rgb8 frame-000002.color.jpg 8x6            | refused | frame-000002.color & same frame
spoil frame-000001.depth.png               | 6 | without depth & frame-000001.depth.png
gray16 frame-000002.depth.png 4x4          | 6 | without depth & frame-000002.depth.png & 4x4 & 8x6
remove frame-000005.pose.txt               | 5 | no .pose.txt & (1 in all) & frame-000005.color.png
remove frame-00000{0,1,2,3,5}.pose.txt     | refused | 5 images have no .pose.txt & frame-000000.color.png
frame-000001.pose.txt = nan 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1 | 5 | (1 in all) & frame-000001.pose.txt & finite
frame-00000{1,4}.pose.txt = 2 0 0 0\n0 2 0 0\n0 0 2 0\n0 0 0 1 | 4 | (2 in all) & frame-000001.pose.txt & not a rotation
frame-00000{0,1,2,3,4}.pose.txt = inf 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1 | refused | 5 of 6 poses & frame-000000.pose.txt
frame-000003.pose.txt = 1 0 0 0\n0 1 0\n0 0 1 0\n0 0 0 1 | refused | frame-000003.pose.txt & line 2 has 3 numbers
frame-000003.pose.txt = 1 0 0 0\n0 one 0 0\n0 0 1 0\n0 0 0 1 | refused | frame-000003.pose.txt & line 2: "one"
frame-000003.pose.txt = 1 0 0 0\n0 1 0 0\n0 0 1 0\n | refused | frame-000003.pose.txt & has 3 lines
rgb8 frame-00000{0,1,2,3,4,5}.color.png 8x4 | refused | intrinsics.txt & 640x480 pixels, not for images of 8x4 & fx fy cx cy
frame-000003.pose.txt =                    | refused | frame-000003.pose.txt & has 0 lines
"#;

#[test]
fn faults_are_warned_of_where_they_are_few_and_refused_by_the_file_otherwise() {
    check_changes(sequence, change_files, CHANGES);
}

#[test]
fn depth_is_not_read_when_it_is_not_wanted_and_may_be_missing() {
    let (_parent, folder) = sequence();
    change_files(&folder, "spoil frame-000001.depth.png");
    opened_without_depth(&folder);
    change_files(&folder, "remove frame-00000{0,1,2,3,4,5}.depth.png");
    assert!(!opened(&folder).has_depth());
}

#[test]
fn a_capture_whose_depth_images_are_all_empty_is_one_without_depth() {
    let (_parent, folder) = sequence();
    change_files(&folder, "gray16 frame-00000{0,1,2,3,4}.depth.png 8x6");
    let scene = opened(&folder);
    assert!(scene.has_depth() && !scene.frames[0].has_depth());
    change_files(&folder, "gray16 frame-000005.depth.png 8x6");
    let scene = open(&folder).unwrap();
    assert!(!scene.has_depth());
    let warnings = &scene.warnings;
    assert!(
        warnings.len() == 1 && warnings[0].contains("all empty"),
        "{warnings:?}"
    );
}
