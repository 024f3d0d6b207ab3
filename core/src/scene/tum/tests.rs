//! What holds for sequences of the TUM RGB-D benchmark, good and bad.

use std::fmt::Write as _;
use std::fs;

use glam::Vec3;

use super::*;
use crate::scene::SceneSource;
#[cfg(unix)]
use crate::scene::testing::move_out;
use crate::scene::testing::{
    WITHOUT_DEPTH, assert_refused, assert_warned, open, open_with_outside_files, write_color, write_depth,
};

const FRAMES: usize = 6;
/// Of the first image, seconds.
const START: f64 = 1_305_031_102.175;

/// A sequence of six images every 0.1 s, depth 5 ms and poses 1 ms later, that move along x in front of a wall.
fn sequence(name: &str) -> (tempfile::TempDir, PathBuf) {
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

/// Replaces line `number` (from 0, without the comment) of a file, or removes it.
fn edit(folder: &Path, file: &str, number: usize, by: Option<&str>) {
    let path = folder.join(file);
    let text = fs::read_to_string(&path).unwrap();
    let lines = text
        .lines()
        .enumerate()
        .filter_map(|(n, line)| if n == number + 1 { by } else { Some(line) });
    let lines: Vec<&str> = lines.collect();
    fs::write(path, lines.join("\n")).unwrap();
}

#[test]
fn a_sequence_is_read_with_the_poses_and_depths_of_its_times() {
    let (_parent, folder) = sequence("capture");
    let scene = open(&folder).unwrap();
    assert_eq!(scene.format, "TUM RGB-D");
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    assert_eq!(scene.frames.len(), FRAMES);
    let frame = &scene.frames[3];
    assert_eq!(frame.stem, "1305031102.475000");
    assert_eq!(frame.color().pixel(5), [30; 3]);
    assert!(frame.center().distance(Vec3::new(0.3, 0.5, -3.0)) < 1e-6);
    let depth = frame.depth().unwrap();
    assert_eq!(depth.ray_length(0), None);
    // 10,003 steps along z wherever the pixel is.
    for index in [2, 20, 47] {
        let point = frame.center() + depth.ray_length(index).unwrap() * frame.ray_direction(index);
        assert!((point.x - 0.3 - 2.0006).abs() < 1e-4, "{point}");
    }
}

#[test]
fn intrinsics_follow_the_family_in_the_name_and_a_file_goes_before_them() {
    // Published for pixel centres at whole numbers; here they are at +0.5.
    for (name, part, [fx, fy, cx, cy]) in [
        (
            "rgbd_dataset_freiburg1_desk",
            "distortion",
            [517.3, 516.5, 319.1, 255.8],
        ),
        (
            "rgbd_dataset_freiburg2_xyz",
            "distortion",
            [520.9, 521.0, 325.6, 250.2],
        ),
        (
            "rgbd_dataset_freiburg3_office",
            "freiburg3",
            [535.4, 539.2, 320.6, 248.1],
        ),
        ("office", "defaults", [525.0, 525.0, 320.0, 240.0]),
    ] {
        let (_parent, folder) = sequence(name);
        let scene = open(&folder).unwrap();
        let camera = scene.frames[0].camera;
        for (is, expected) in [camera.fx, camera.fy, camera.cx, camera.cy]
            .into_iter()
            .zip([fx, fy, cx, cy])
        {
            assert!((80.0 * is - expected).abs() < 1e-3, "{name}: {camera:?}");
        }
        assert_eq!(scene.notes.len(), 1, "{:?}", scene.notes);
        assert!(scene.notes[0].contains(part), "{:?}", scene.notes);
        fs::write(folder.join("intrinsics.txt"), "7 7.5 4.5 2.5 8 6").unwrap();
        let scene = open(&folder).unwrap();
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

#[test]
fn images_without_a_partner_in_time_are_left_out_and_counted() {
    let (_parent, folder) = sequence("capture");
    edit(&folder, "groundtruth.txt", 2, None);
    assert_warned(
        &folder,
        FRAMES - 1,
        &["pose", "(1 in all)", "1305031102.375000.png"],
    );
    edit(&folder, "groundtruth.txt", 2, None);
    edit(&folder, "depth.txt", 0, None);
    let scene = open(&folder).unwrap();
    assert_eq!(scene.frames.len(), FRAMES - 3);
    assert_eq!(scene.warnings.len(), 2, "{:?}", scene.warnings);
    assert!(scene.warnings[1].contains("depth image"), "{:?}", scene.warnings);
    // Without depth the frames are the same ones.
    let source = SceneSource::Folder(folder.clone());
    let without = Scene::open(&source, WITHOUT_DEPTH, &|_, _| {}).unwrap();
    let stems = |scene: &Scene| scene.frames.iter().map(|f| f.stem.clone()).collect::<Vec<_>>();
    assert!(!without.has_depth());
    assert_eq!(stems(&scene), stems(&without));
    fs::write(folder.join("groundtruth.txt"), "5 0 0 0 0 0 0 1").unwrap();
    assert_refused(&folder, &["groundtruth.txt", "0.02 s", "6 images"]);
}

#[test]
fn a_sequence_may_have_no_depth() {
    let (_parent, folder) = sequence("capture");
    fs::remove_file(folder.join("depth.txt")).unwrap();
    let scene = open(&folder).unwrap();
    assert!(!scene.has_depth() && scene.warnings.is_empty());
    assert_eq!(scene.frames.len(), FRAMES);
}

#[test]
fn frames_with_an_unusable_pose_are_left_out_with_one_warning_and_most_are_an_error() {
    let (_parent, folder) = sequence("capture");
    let spoil = |number: usize, pose: &str| {
        let time = START + 0.1 * number as f64;
        edit(
            &folder,
            "groundtruth.txt",
            number,
            Some(&format!("{time:.4} {pose}")),
        );
    };
    spoil(1, "nan 0 0 0 0 0 1");
    spoil(4, "0 0 0 0 0 0 0");
    spoil(5, "0 0 0 0 nan 0 1");
    assert_warned(
        &folder,
        FRAMES - 3,
        &["(3 in all)", "line 3", "finite", "line 6", "not a rotation"],
    );
    spoil(2, "0 0 0 1 1 1 1");
    assert_refused(&folder, &["groundtruth.txt", "4 of 6 poses", "line 3"]);
}

#[test]
fn malformed_files_are_refused_with_their_line() {
    for (file, line, part) in [
        ("groundtruth.txt", "1305031102 1 2 3", "line 4 has 4 numbers"),
        (
            "groundtruth.txt",
            "1305031102 1 2 3 0 0 zero 1",
            "line 4: \"zero\"",
        ),
        (
            "groundtruth.txt",
            "nan 1 2 3 0 0 0 1",
            "line 4 has no finite time",
        ),
        ("rgb.txt", "1305031102.2", "line 4 is not a time"),
        ("rgb.txt", "soon rgb/a.png", "line 4 is not a time"),
        (
            "depth.txt",
            "1305031102.2 ../depth/a.png",
            "line 4 names \"../depth/a.png\"",
        ),
    ] {
        let (_parent, folder) = sequence("capture");
        edit(&folder, file, 2, Some(line));
        assert_refused(&folder, &[file, part]);
    }
    let (_parent, folder) = sequence("capture");
    let double = format!("{:.6} rgb/{START:.6}.jpg", START + 0.1);
    edit(&folder, "rgb.txt", 1, Some(&double));
    assert_refused(&folder, &["rgb.txt", "one name"]);
    fs::write(folder.join("rgb.txt"), "# nothing\n").unwrap();
    assert_refused(&folder, &["rgb.txt", "lists no images"]);
    let (_parent, folder) = sequence("capture");
    fs::remove_file(folder.join("groundtruth.txt")).unwrap();
    assert_refused(&folder, &["groundtruth.txt", "no such file"]);
}

#[test]
fn lists_that_leave_the_folder_are_refused_unless_that_is_allowed() {
    for (list, name) in [("rgb.txt", "rgb"), ("depth.txt", "depth")] {
        let (parent, folder) = sequence("capture");
        fs::rename(folder.join(name), parent.path().join("elsewhere")).unwrap();
        let text = fs::read_to_string(folder.join(list)).unwrap();
        let moved = text.replace(&format!(" {name}/"), " ../elsewhere/");
        assert_ne!(moved, text);
        fs::write(folder.join(list), moved).unwrap();
        assert_refused(&folder, &[list, "line 2", "../elsewhere/", "--outside-files"]);
        let scene = open_with_outside_files(&folder).unwrap();
        assert_eq!(scene.frames.len(), FRAMES);
        assert!(scene.frames.iter().all(|frame| frame.has_depth()));
    }
}

#[cfg(unix)]
#[test]
fn links_that_leave_the_folder_are_refused_unless_that_is_allowed() {
    for folder_of in ["rgb", "depth"] {
        let (_parent, folder) = sequence("capture");
        let name = fs::read_dir(folder.join(folder_of))
            .unwrap()
            .next()
            .unwrap()
            .unwrap()
            .file_name();
        let name = format!("{folder_of}/{}", name.to_str().unwrap());
        let _outside = move_out(&folder, &name);
        assert_refused(&folder, &[&name, "link", "--outside-files"]);
        assert_eq!(open_with_outside_files(&folder).unwrap().frames.len(), FRAMES);
    }
}
