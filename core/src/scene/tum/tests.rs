//! What holds for sequences of the TUM RGB-D benchmark, good and bad.

use std::fmt::Write as _;
use std::fs;

use glam::Vec3;
use tempfile::TempDir;

use super::*;
use crate::scene::testing::{
    assert_outside, change_files, check_changes, open, open_with, opened, stems, write_color, write_depth,
};

const FRAMES: usize = 6;
/// Of the first image, seconds.
const START: f64 = 1_305_031_102.175;

/// A sequence of six images every 0.1 s, depth 5 ms and poses 1 ms later, that move along x in front of a wall.
fn named_sequence(name: &str) -> (TempDir, PathBuf) {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join(name);
    for part in ["rgb", "depth"] {
        fs::create_dir_all(folder.join(part)).unwrap();
    }
    let header = "# a comment\n";
    let (mut images, mut depths, mut poses) = (header.to_owned(), header.to_owned(), header.to_owned());
    for number in 0..FRAMES {
        let time = START + 0.1 * number as f64;
        writeln!(images, "{time:.6} rgb/{time:.6}.png").unwrap();
        write_color(&folder.join(format!("rgb/{time:.6}.png")), 10 * number as u8);
        let later = time + 0.005;
        writeln!(depths, "{later:.6} depth/{later:.6}.png").unwrap();
        write_depth(
            &folder.join(format!("depth/{later:.6}.png")),
            &[0],
            10_000 + number as u16,
        );
        // A quarter turn around y, as numbers of four decimals: what the camera sees ahead is along x.
        let (x, later) = (0.1 * number as f64, time + 0.001);
        writeln!(poses, "{later:.4} {x:.4} 0.5 -3 0 0.7071 0 0.7071").unwrap();
    }
    fs::write(folder.join("rgb.txt"), images).unwrap();
    fs::write(folder.join("depth.txt"), depths).unwrap();
    fs::write(folder.join("groundtruth.txt"), poses).unwrap();
    (parent, folder)
}

fn sequence() -> (TempDir, PathBuf) {
    named_sequence("capture")
}

#[test]
fn a_sequence_is_read_with_the_poses_and_depths_of_its_times() {
    let (_parent, folder) = sequence();
    let scene = opened(&folder);
    assert_eq!(scene.format, "TUM RGB-D");
    assert_eq!(scene.frames.len(), FRAMES);
    let frame = &scene.frames[3];
    assert_eq!(frame.stem, "1305031102.475000");
    assert_eq!(frame.color().pixel(5), [30; 3]);
    assert!(frame.center().distance(Vec3::new(0.3, 0.5, -3.0)) < 1e-6);
    let depth = frame.depth().unwrap();
    assert_eq!(depth.ray_length(0), None);
    // 10,003 steps along z wherever the pixel is.
    for index in [2, 20, 47] {
        let point = frame.place(index, depth.ray_length(index).unwrap());
        assert!((point.x - 0.3 - 2.0006).abs() < 1e-4, "{point}");
    }
}

#[test]
fn intrinsics_follow_the_family_in_the_name_and_a_file_goes_before_them() {
    // Published for pixel centres at whole numbers; here they are at +0.5.
    for (name, part, expected) in [
        ("freiburg1_desk", "distortion", [517.3, 516.5, 319.1, 255.8]),
        ("freiburg2_xyz", "distortion", [520.9, 521.0, 325.6, 250.2]),
        ("freiburg3_office", "freiburg3", [535.4, 539.2, 320.6, 248.1]),
        ("office", "defaults", [525.0, 525.0, 320.0, 240.0]),
    ] {
        let (_parent, folder) = named_sequence(name);
        let scene = open(&folder).unwrap();
        let camera = scene.frames[0].camera;
        let published = [camera.fx, camera.fy, camera.cx, camera.cy].map(|value| 80.0 * value);
        for (is, expected) in published.into_iter().zip(expected) {
            assert!((is - expected).abs() < 1e-3, "{name}: {camera:?}");
        }
        assert_eq!(scene.notes.len(), 1, "{:?}", scene.notes);
        assert!(scene.notes[0].contains(part), "{:?}", scene.notes);
        change_files(&folder, "intrinsics.txt = 7 7.5 4.5 2.5 8 6");
        let scene = opened(&folder);
        assert_eq!(scene.frames[0].camera.fx, 7.0);
        assert!(scene.notes.is_empty(), "{:?}", scene.notes);
    }
}

#[test]
fn what_is_nearest_in_time_belongs_together_if_it_is_within_20_ms() {
    let times = [(1.0, 'a'), (1.03, 'b'), (2.0, 'c')];
    for (time, expected) in [
        (0.97, None),
        (0.99, Some('a')),
        (1.0, Some('a')),
        (1.014, Some('a')),
        (1.016, Some('b')),
        (1.049, Some('b')),
        (1.5, None),
        (2.019, Some('c')),
        (2.03, None),
    ] {
        assert_eq!(nearest(&times, time).copied(), expected, "{time}");
    }
    assert_eq!(nearest::<char>(&[], 1.0), None);
}

/// What opening the sequence says after changes to its files; the first line of each list is a comment.
const CHANGES: &str = r#"
groundtruth.txt:4 =                                   | 5 | pose & (1 in all) & 1305031102.375000.png
depth.txt:2 =                                         | 5 | depth image & (1 in all) & 1305031102.175000.png
groundtruth.txt:7 = 1305031102.6760 0 0 0 0 nan 0 1   | 5 | (1 in all) & line 7
groundtruth.txt = 5 0 0 0 0 0 0 1                     | refused | groundtruth.txt & 0.02 s & 6 images
groundtruth.txt:3 = 1305031102.2760 nan 0 0 0 0 0 1   | 5 | (1 in all) & line 3 & finite
groundtruth.txt:6 = 1305031102.5760 0 0 0 0 0 0 0     | 5 | (1 in all) & line 6 & not a rotation
groundtruth.txt:4 = 1305031102 1 2 3                  | refused | groundtruth.txt & line 4 has 4 numbers
groundtruth.txt:4 = 1305031102 1 2 3 0 0 zero 1       | refused | groundtruth.txt & line 4: "zero"
groundtruth.txt:4 = nan 1 2 3 0 0 0 1                 | refused | groundtruth.txt & line 4 has no finite time
groundtruth.txt:2 = 1305031102.1750 0 0 0 1 1 1 1; groundtruth.txt:3 = 1305031102.2750 0 0 0 1 1 1 1; groundtruth.txt:4 = 1305031102.3750 0 0 0 1 1 1 1 | 3 | (3 in all) & line 2 & line 4
groundtruth.txt:2 = 1305031102.1750 0 0 0 1 1 1 1; groundtruth.txt:3 = 1305031102.2750 0 0 0 1 1 1 1; groundtruth.txt:4 = 1305031102.3750 0 0 0 1 1 1 1; groundtruth.txt:5 = 1305031102.4750 0 0 0 1 1 1 1 | refused | groundtruth.txt & 4 of 6 poses & line 2
remove groundtruth.txt                                | refused | groundtruth.txt & no such file
rgb.txt:4 = 1305031102.2                              | refused | rgb.txt & line 4 is not a time
rgb.txt:4 = soon rgb/a.png                            | refused | rgb.txt & line 4 is not a time
rgb.txt:3 = 1305031102.275 rgb/1305031102.175000.jpg  | refused | rgb.txt & one name
rgb.txt = # nothing                                   | refused | rgb.txt & lists no images
depth.txt:4 = 1305031102.2 ../depth/a.png             | refused | depth.txt & line 4 names "../depth/a.png"
"#;

#[test]
fn faults_are_warned_of_where_they_are_few_and_refused_by_the_file_otherwise() {
    check_changes(sequence, change_files, CHANGES);
}

#[test]
fn the_frames_are_the_same_without_depth_which_may_be_missing() {
    let (_parent, folder) = sequence();
    change_files(&folder, "depth.txt:2 =");
    let without = OpenOptions {
        depth: false,
        ..OpenOptions::default()
    };
    let without = open_with(&folder, without).unwrap();
    assert!(!without.has_depth());
    assert_eq!(stems(&without), stems(&open(&folder).unwrap()));
    change_files(&folder, "remove depth.txt");
    let scene = opened(&folder);
    assert!(!scene.has_depth() && scene.frames.len() == FRAMES);
}

#[test]
fn lists_that_leave_the_folder_are_refused_unless_that_is_allowed() {
    for (list, name) in [("rgb.txt", "rgb"), ("depth.txt", "depth")] {
        let (parent, folder) = sequence();
        fs::rename(folder.join(name), parent.path().join("elsewhere")).unwrap();
        let text = fs::read_to_string(folder.join(list)).unwrap();
        let moved = text.replace(&format!(" {name}/"), " ../elsewhere/");
        assert_ne!(moved, text);
        fs::write(folder.join(list), moved).unwrap();
        let scene = assert_outside(&folder, &[list, "line 2", "../elsewhere/"], FRAMES);
        assert!(scene.frames.iter().all(|frame| frame.has_depth()));
    }
}
