//! What holds for captures in this layout, good and bad.

use std::fs;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{Affine3A, DVec3, Quat, Vec3};

use super::*;
use crate::labels::Class;
use crate::scene::testing::{WITHOUT_DEPTH, assert_refused, assert_warned, open};
use crate::scene::{ColorImage, DepthMap, Frame, FramePixels, SceneSource};

const WIDTH: u32 = 8;
const HEIGHT: u32 = 6;

fn tiny_scene(frames: usize) -> Scene {
    let camera = Camera {
        width: WIDTH,
        height: HEIGHT,
        fx: 7.5,
        fy: 7.25,
        cx: 4.125,
        cy: 2.875,
    };
    let frame = |number: usize| {
        let bytes = (0..camera.pixels() * 3)
            .map(|i| (i * 7 + number * 31) as u8)
            .collect();
        let lengths: Vec<f32> = (0..camera.pixels())
            .map(|i| if i == 5 { 0.0 } else { 1.0 + 0.037 * i as f32 })
            .collect();
        Frame {
            stem: format!("rgb_{number}"),
            path: PathBuf::new(),
            camera,
            camera_to_world: Affine3A::from_rotation_translation(
                Quat::from_rotation_y(0.3 * number as f32),
                Vec3::new(0.1 * number as f32, 1.0, -2.0),
            ),
            pixels: FramePixels::new(
                ColorImage::new(WIDTH, HEIGHT, bytes).unwrap(),
                Some(DepthMap::from_ray_lengths(WIDTH, &lengths)),
            ),
            points: Vec::new(),
            lens: None,
        }
    };
    Scene {
        source: SceneSource::Demo,
        format: "test",
        frames: (0..frames).map(frame).collect(),
        origin: DVec3::ZERO,
        unit: 1.0,
        point_errors: None,
        warnings: Vec::new(),
        notes: Vec::new(),
    }
}

/// A written capture of twelve frames to spoil.
fn capture() -> (tempfile::TempDir, PathBuf) {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("capture");
    write(&tiny_scene(12), &folder, None).unwrap();
    (parent, folder)
}

/// Replaces lines of the trajectory.
fn edit_poses(folder: &Path, edit: impl Fn(usize, &str) -> Option<String>) {
    let path = folder.join("traj_w_c.txt");
    let text = fs::read_to_string(&path).unwrap();
    let lines: Vec<String> = text
        .lines()
        .enumerate()
        .filter_map(|(n, line)| edit(n, line))
        .collect();
    fs::write(path, lines.join("\n")).unwrap();
}

#[test]
fn what_was_written_is_read_again() {
    let mut scene = tiny_scene(11);
    scene.origin = DVec3::new(500_000.0, -20.0, 3.0);
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("deep/er/capture");
    write(&scene, &folder, None).unwrap();
    let read = open(&folder).unwrap();
    assert!(read.warnings.is_empty(), "{:?}", read.warnings);
    assert_eq!(read.frames.len(), 11);
    assert!(read.origin.x > 499_999.0);
    let shift = (scene.origin - read.origin).as_vec3();
    for (before, after) in scene.frames.iter().zip(&read.frames) {
        assert_eq!(before.stem, after.stem);
        assert_eq!(before.color(), after.color());
        assert_eq!(before.camera, after.camera);
        let moved = before.center() + shift;
        assert!(moved.distance(after.center()) < 1e-6);
        for (a, b) in before
            .camera_to_world
            .matrix3
            .to_cols_array()
            .iter()
            .zip(after.camera_to_world.matrix3.to_cols_array())
        {
            assert!((a - b).abs() < 1e-6);
        }
        let (before, after) = (before.depth().unwrap(), after.depth().unwrap());
        for index in 0..before.len() {
            match (before.ray_length(index), after.ray_length(index)) {
                (Some(a), Some(b)) => assert!((a - b).abs() < 1e-3),
                (a, b) => assert_eq!(a, b),
            }
        }
    }
}

#[test]
fn ground_truth_is_written_beside_the_frames() {
    let scene = tiny_scene(2);
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("capture");
    let labels = [vec![3; 48], vec![200; 48]];
    let classes = [Class::new(3, "wall"), Class::new(200, "floor")];
    let truth = GroundTruth {
        classes: &classes,
        labels: &|frame| labels[frame].clone(),
        held_out: &[1],
    };
    write(&scene, &folder, Some(&truth)).unwrap();
    let image = image::open(folder.join("semantic_class/semantic_class_1.png")).unwrap();
    assert_eq!(
        image.as_luma8().unwrap().as_raw(),
        &labels[1].iter().map(|&id| id as u8).collect::<Vec<_>>()
    );
    let read: Vec<Class> =
        serde_json::from_str(&fs::read_to_string(folder.join("classes.json")).unwrap()).unwrap();
    assert_eq!(read, classes);
    let split = fs::read_to_string(folder.join("split.json")).unwrap();
    let split: serde_json::Value = serde_json::from_str(&split).unwrap();
    assert_eq!(split, serde_json::json!({"train": [0], "test": [1]}));
}

#[test]
fn nothing_is_written_over_a_folder_in_use_and_no_rest_is_left() {
    let (parent, folder) = capture();
    let message = write(&tiny_scene(1), &folder, None).unwrap_err().to_string();
    assert!(
        message.contains("capture") && message.contains("empty"),
        "{message}"
    );
    let truth = GroundTruth {
        classes: &[],
        labels: &|_| Vec::new(),
        held_out: &[],
    };
    assert!(write(&tiny_scene(1), &parent.path().join("other"), Some(&truth)).is_err());
    assert_eq!(fs::read_dir(parent.path()).unwrap().count(), 1);
    let empty = parent.path().join("empty");
    fs::create_dir(&empty).unwrap();
    write(&tiny_scene(1), &empty, None).unwrap();
    assert_eq!(open(&empty).unwrap().frames.len(), 1);
}

#[test]
fn without_intrinsics_the_field_of_view_is_90_degrees() {
    let (_parent, folder) = capture();
    fs::remove_file(folder.join("intrinsics.txt")).unwrap();
    let camera = open(&folder).unwrap().frames[0].camera;
    assert_eq!(camera, Camera::with_horizontal_fov(WIDTH, HEIGHT, 90.0));
}

#[test]
fn any_numbered_image_is_a_frame_and_frames_are_in_numerical_order() {
    let (_parent, folder) = capture();
    let rgb = folder.join("rgb");
    fs::rename(rgb.join("rgb_2.png"), rgb.join("frame-0002.PNG")).unwrap();
    let stems: Vec<String> = open(&folder)
        .unwrap()
        .frames
        .into_iter()
        .map(|f| f.stem)
        .collect();
    assert_eq!(stems[1..4], ["rgb_1", "frame-0002", "rgb_3"]);
    assert_eq!(stems[10], "rgb_10");
    fs::copy(rgb.join("rgb_3.png"), rgb.join("other_3.png")).unwrap();
    assert_refused(&folder, &["_3.png", "same number"]);
}

#[test]
fn depth_is_left_out_when_it_is_not_wanted() {
    let (_parent, folder) = capture();
    fs::write(folder.join("depth/depth_3.png"), "spoilt").unwrap();
    let source = SceneSource::Folder(folder);
    let scene = Scene::open(&source, WITHOUT_DEPTH, &|_, _| {}).unwrap();
    assert!(!scene.has_depth() && scene.warnings.is_empty());
}

#[test]
fn progress_reaches_the_number_of_frames() {
    let (_parent, folder) = capture();
    let most = AtomicUsize::new(0);
    let progress = |done: usize, total: usize| {
        assert_eq!(total, 12);
        most.fetch_max(done, Ordering::Relaxed);
    };
    Scene::open(&SceneSource::Folder(folder), OpenOptions::default(), &progress).unwrap();
    assert_eq!(most.into_inner(), 12);
}

#[test]
fn incomplete_captures_are_refused_by_the_name_of_what_is_missing() {
    let parent = tempfile::tempdir().unwrap();
    assert_refused(&parent.path().join("nowhere"), &["nowhere", "no such folder"]);
    assert_refused(parent.path(), &["no capture", "traj_w_c.txt"]);
    let (_parent, folder) = capture();
    fs::remove_file(folder.join("traj_w_c.txt")).unwrap();
    assert_refused(&folder, &["traj_w_c.txt", "no such file"]);
    fs::write(folder.join("traj_w_c.txt"), "\n\n").unwrap();
    assert_refused(&folder, &["traj_w_c.txt", "no poses"]);
    fs::remove_dir_all(folder.join("rgb")).unwrap();
    assert_refused(&folder, &["rgb", "no such folder"]);
    fs::create_dir(folder.join("rgb")).unwrap();
    assert_refused(&folder, &["rgb", "no PNG or JPEG"]);
}

#[test]
fn a_missing_image_is_a_warning_and_many_are_an_error() {
    let (_parent, folder) = capture();
    fs::remove_file(folder.join("rgb/rgb_4.png")).unwrap();
    assert_warned(&folder, 11, &["poses have no image", "(1 in all)", "frame 4"]);
    fs::remove_file(folder.join("rgb/rgb_5.png")).unwrap();
    assert_refused(&folder, &["traj_w_c.txt", "12 poses", "2 of them"]);
}

#[test]
fn a_missing_pose_is_a_warning_and_many_are_an_error() {
    let (_parent, folder) = capture();
    edit_poses(&folder, |n, line| (n < 11).then(|| line.to_owned()));
    assert_warned(&folder, 11, &["without a pose", "(1 in all)", "rgb_11.png"]);
    edit_poses(&folder, |n, line| (n < 6).then(|| line.to_owned()));
    assert_refused(
        &folder,
        &["traj_w_c.txt", "6 poses", "6 of the 12 images", "rgb_6.png"],
    );
}

#[test]
fn a_few_unusable_poses_are_a_warning_and_most_are_an_error() {
    let (_parent, folder) = capture();
    let nan = "nan 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1";
    let scaled = "2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 1";
    edit_poses(&folder, |n, line| {
        Some(match n {
            1 => nan.to_owned(),
            2 => scaled.to_owned(),
            _ => line.to_owned(),
        })
    });
    assert_warned(&folder, 10, &["(2 in all)", "line 2", "line 3", "not a rotation"]);
    edit_poses(&folder, |_, _| Some(nan.to_owned()));
    assert_refused(&folder, &["traj_w_c.txt", "12 of 12", "line 1", "finite"]);
}

#[test]
fn malformed_poses_are_refused_with_their_line() {
    let (_parent, folder) = capture();
    let replace = |by: &'static str| {
        edit_poses(&folder, |n, line| {
            Some(if n == 3 { by.to_owned() } else { line.to_owned() })
        });
    };
    replace("1 0 0 zero 0 1 0 0 0 0 1 0 0 0 0 1");
    assert_refused(&folder, &["traj_w_c.txt", "line 4", "\"zero\""]);
    replace("1 0 0 0");
    assert_refused(&folder, &["traj_w_c.txt", "line 4", "4 numbers"]);
    fs::write(folder.join("traj_w_c.txt"), [0xFF, 0xFE, 0x00]).unwrap();
    assert_refused(&folder, &["traj_w_c.txt", "text"]);
}

#[test]
fn spoilt_images_are_a_warning_and_most_are_an_error() {
    let (_parent, folder) = capture();
    let rgb = folder.join("rgb");
    let whole = fs::read(rgb.join("rgb_7.png")).unwrap();
    fs::write(rgb.join("rgb_7.png"), &whole[..whole.len() / 2]).unwrap();
    assert_warned(&folder, 11, &["images cannot be used", "(1 in all)", "rgb_7.png"]);
    for number in 0..12 {
        fs::write(rgb.join(format!("rgb_{number}.png")), "spoilt").unwrap();
    }
    assert_refused(&folder, &["rgb_0.png", "12 of 12"]);
}

#[test]
fn images_of_another_size_are_left_out() {
    let (_parent, folder) = capture();
    let square = vec![0; 3 * 16];
    image::save_buffer(
        folder.join("rgb/rgb_3.png"),
        &square,
        4,
        4,
        image::ColorType::Rgb8,
    )
    .unwrap();
    assert_warned(&folder, 11, &["8x6", "rgb_3.png (4x4)"]);
}

#[test]
fn images_of_half_the_size_get_half_the_intrinsics_and_the_depth_of_either_size() {
    let (_parent, folder) = capture();
    let whole = open(&folder).unwrap();
    let half = vec![9; 3 * 12];
    for number in [3, 4] {
        let path = folder.join(format!("rgb/rgb_{number}.png"));
        image::save_buffer(path, &half, 4, 3, image::ColorType::Rgb8).unwrap();
    }
    let steps: Vec<u16> = (1..=12).map(|n| 1000 * n).collect();
    let bytes: &[u8] = bytemuck::cast_slice(&steps);
    image::save_buffer(
        folder.join("depth/depth_3.png"),
        bytes,
        4,
        3,
        image::ColorType::L16,
    )
    .unwrap();
    let scene = open(&folder).unwrap();
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    assert_eq!(scene.notes.len(), 1, "{:?}", scene.notes);
    assert!(scene.notes[0].contains("2 images") && scene.notes[0].contains("8x6"));
    let camera = scene.frames[3].camera;
    assert_eq!((camera.width, camera.height), (4, 3));
    assert_eq!(
        (camera.fx, camera.fy, camera.cx, camera.cy),
        (3.75, 3.625, 2.0625, 1.4375)
    );
    let z = |frame: &Frame, index: usize| {
        let (column, row) = (
            index as u32 % frame.camera.width,
            index as u32 / frame.camera.width,
        );
        let length = frame.depth().unwrap().ray_length(index);
        length.map(|length| length / frame.camera.pixel_direction(column, row).length())
    };
    for index in 0..12 {
        assert!((z(&scene.frames[3], index).unwrap() - (1 + index) as f32).abs() < 1e-3);
        // The centre of a pixel of half the size is the corner of four of the whole.
        let corner = 2 * (index / 4) * 8 + 2 * (index % 4);
        let around = [0, 1, 8, 9].map(|step| z(&whole.frames[4], corner + step));
        let own = z(&scene.frames[4], index).unwrap();
        let is_own = |z: &f32| (z - own).abs() < 2e-3;
        assert!(around.iter().flatten().any(is_own), "{own} {around:?}");
    }
}

#[test]
fn intrinsics_must_be_whole_and_fit_the_images() {
    let (_parent, folder) = capture();
    for (text, part) in [
        ("7 7 4 3 16 16", "16x16 pixels, but those in rgb/ have 8x6"),
        ("0 7 4 3 8 6", "focal length"),
        ("nan 7 4 3 8 6", "finite"),
        ("7 7 0 0 8 6", "principal point"),
        ("7 7 4 3", "4 numbers"),
        ("7 7 4 3 0 0", "image size"),
        ("7 7 4 3 8 six", "line 1: \"six\""),
        ("", "0 numbers"),
    ] {
        fs::write(folder.join("intrinsics.txt"), text).unwrap();
        assert_refused(&folder, &["intrinsics.txt", part]);
    }
}

#[test]
fn intrinsics_for_another_size_of_the_same_proportions_are_scaled() {
    let (_parent, folder) = capture();
    fs::write(folder.join("intrinsics.txt"), "14 15 8 7 16 12").unwrap();
    let scene = open(&folder).unwrap();
    let camera = scene.frames[0].camera;
    assert_eq!((camera.fx, camera.fy, camera.cx, camera.cy), (7.0, 7.5, 4.0, 3.5));
    assert_eq!(scene.notes.len(), 1);
    assert!(scene.notes[0].contains("16x12") && scene.notes[0].contains("8x6"));
}

#[test]
fn unusable_depth_is_a_warning_but_another_size_or_most_are_an_error() {
    let (_parent, folder) = capture();
    let depth = folder.join("depth");
    fs::write(depth.join("depth_2.png"), "spoilt").unwrap();
    fs::remove_file(depth.join("depth_5.png")).unwrap();
    image::save_buffer(depth.join("depth_6.png"), &[9; 48], 8, 6, image::ColorType::L8).unwrap();
    assert_warned(
        &folder,
        12,
        &["(3 in all)", "depth_2.png", "rgb_5.png (no file)", "16-bit"],
    );
    assert!(open(&folder).unwrap().frames[2].depth().is_none());
    image::save_buffer(depth.join("depth_6.png"), &[9; 32], 4, 4, image::ColorType::L16).unwrap();
    assert_refused(&folder, &["depth_6.png", "4x4", "8x6"]);
    for number in 0..12 {
        fs::write(depth.join(format!("depth_{number}.png")), "spoilt").unwrap();
    }
    assert_refused(&folder, &["depth", "12 of 12"]);
}
