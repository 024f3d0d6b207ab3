//! What holds for captures in this layout, good and bad.

use std::fs;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{Affine3A, DVec3, Quat, Vec3};
use tempfile::TempDir;

use super::*;
use crate::labels::Class;
use crate::scene::testing::{
    change_files, check_changes, frame, open, opened, opened_without_depth, scene, stems, z_depth,
};
use crate::scene::{DepthMap, SceneSource};

const WIDTH: u32 = 8;
const HEIGHT: u32 = 6;

fn tiny_scene(frames: usize) -> Scene {
    let camera = Camera::new([WIDTH, HEIGHT], [7.5, 7.25, 4.125, 2.875]);
    let tiny_frame = |number: usize| {
        let bytes = (0..camera.pixels() * 3)
            .map(|i| (i * 7 + number * 31) as u8)
            .collect();
        let lengths: Vec<f32> = (0..camera.pixels())
            .map(|i| if i == 5 { 0.0 } else { 1.0 + 0.037 * i as f32 })
            .collect();
        let depth = DepthMap::from_ray_lengths(WIDTH, &lengths);
        let mut frame = frame(&format!("rgb_{number}"), camera, bytes, Some(depth));
        frame.camera_to_world = Affine3A::from_rotation_translation(
            Quat::from_rotation_y(0.3 * number as f32),
            Vec3::new(0.1 * number as f32, 1.0, -2.0),
        );
        frame
    };
    scene((0..frames).map(tiny_frame).collect())
}

/// A written capture of twelve frames to spoil.
fn capture() -> (TempDir, PathBuf) {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("capture");
    write(&tiny_scene(12), &folder, None).unwrap();
    (parent, folder)
}

#[test]
fn what_was_written_is_read_again() {
    let mut scene = tiny_scene(11);
    scene.origin = DVec3::new(500_000.0, -20.0, 3.0);
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("deep/er/capture");
    write(&scene, &folder, None).unwrap();
    let read = opened(&folder);
    assert_eq!(read.frames.len(), 11);
    assert!(read.origin.x > 499_999.0);
    let shift = (scene.origin - read.origin).as_vec3();
    for (before, after) in scene.frames.iter().zip(&read.frames) {
        assert_eq!(before.stem, after.stem);
        assert_eq!(before.color(), after.color());
        assert_eq!(before.camera, after.camera);
        let moved = before.center() + shift;
        assert!(moved.distance(after.center()) < 1e-6);
        let rotations = [before, after].map(|frame| frame.camera_to_world.matrix3);
        assert!(rotations[0].abs_diff_eq(rotations[1], 1e-6));
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
        objects: Some(TrueObjects {
            listed: &[(1, 3), (700, 200)].into(),
            of_frame: &|frame| vec![[1, 700][frame]; 48],
        }),
        held_out: &[1],
    };
    write(&scene, &folder, Some(&truth)).unwrap();
    let image = image::open(folder.join("semantic_instance/semantic_instance_1.png")).unwrap();
    assert_eq!(image.as_luma16().unwrap().as_raw(), &[700; 48]);
    let image = image::open(folder.join("semantic_class/semantic_class_1.png")).unwrap();
    assert_eq!(image.as_luma8().unwrap().as_raw(), &[200; 48]);
    let read = |name: &str| -> serde_json::Value {
        serde_json::from_slice(&fs::read(folder.join(name)).unwrap()).unwrap()
    };
    assert_eq!(read("classes.json"), serde_json::to_value(&classes).unwrap());
    assert_eq!(read("split.json"), serde_json::json!({"train": [0], "test": [1]}));
    let record = |id: u16, class: &Class| serde_json::json!({ "id": id, "class_id": class.id, "class_name": class.name, "thing": class.thing });
    let listed = serde_json::json!([record(1, &classes[0]), record(700, &classes[1])]);
    assert_eq!(read("objects.json"), listed);
}

#[test]
fn nothing_is_written_over_a_folder_in_use_and_no_rest_is_left() {
    let (parent, folder) = capture();
    let message = write(&tiny_scene(1), &folder, None).unwrap_err().to_string();
    assert!(message.contains("capture"), "{message}");
    assert!(message.contains("empty"), "{message}");
    let truth = GroundTruth {
        classes: &[],
        labels: &|_| Vec::new(),
        objects: None,
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
fn intrinsics_are_scaled_to_images_of_the_same_proportions_and_without_any_the_field_of_view_is_90_degrees() {
    let (_parent, folder) = capture();
    change_files(&folder, "intrinsics.txt = 14 15 8 7 16 12");
    let scene = opened(&folder);
    let expected = Camera::new([WIDTH, HEIGHT], [7.0, 7.5, 4.0, 3.5]);
    assert_eq!(scene.frames[0].camera, expected);
    assert_eq!(scene.notes.len(), 1);
    assert!(scene.notes[0].contains("16x12") && scene.notes[0].contains("8x6"));
    change_files(&folder, "remove intrinsics.txt");
    let camera = open(&folder).unwrap().frames[0].camera;
    assert_eq!(camera, Camera::with_horizontal_fov(WIDTH, HEIGHT, 90.0));
}

#[test]
fn any_numbered_image_is_a_frame_in_numerical_order_and_progress_reaches_their_number() {
    let (_parent, folder) = capture();
    let rgb = folder.join("rgb");
    fs::rename(rgb.join("rgb_2.png"), rgb.join("frame-0002.PNG")).unwrap();
    let most = AtomicUsize::new(0);
    let progress = |done: usize, total: usize| {
        assert_eq!(total, 12);
        most.fetch_max(done, Ordering::Relaxed);
    };
    let source = SceneSource::Folder(folder);
    let scene = Scene::open(&source, OpenOptions::default(), &progress).unwrap();
    assert_eq!(most.into_inner(), 12);
    let stems = stems(&scene);
    assert_eq!(stems[1..4], ["rgb_1", "frame-0002", "rgb_3"]);
    assert_eq!(stems[10], "rgb_10");
}

/// What opening the capture says after changes to its files.
const CHANGES: &str = r#"
remove traj_w_c.txt                          | refused | traj_w_c.txt & no such file
traj_w_c.txt = \n\n                          | refused | traj_w_c.txt & no poses
spoil traj_w_c.txt                           | refused | traj_w_c.txt & text
traj_w_c.txt:4 = 1 0 0 0                     | refused | traj_w_c.txt & line 4 & 4 numbers
traj_w_c.txt:4 = 1 0 0 zero 0 1 0 0 0 0 1 0 0 0 0 1 | refused | traj_w_c.txt & line 4 & "zero"
remove rgb                                   | refused | rgb & no such folder
remove rgb/rgb_{0,1,2,3,4,5,6,7,8,9,10,11}.png | refused | rgb & no PNG or JPEG
traj_w_c.txt:{7,8,9,10,11,12} =              | refused | traj_w_c.txt & 6 poses & 6 of the 12 images & rgb_6.png
traj_w_c.txt:2 = nan 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1; traj_w_c.txt:3 = 2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 1 | 10 | (2 in all) & line 2 & line 3 & not a rotation
traj_w_c.txt:{1,2,3,4,5,6,7,8,9,10,11,12} = nan 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 | refused | traj_w_c.txt & 12 of 12 & line 1 & finite
remove rgb/rgb_4.png                         | 11 | poses have no image & (1 in all) & frame 4
remove rgb/rgb_{4,5}.png                     | refused | traj_w_c.txt & 12 poses & 2 of them
traj_w_c.txt:12 =                            | 11 | without a pose & (1 in all) & rgb_11.png
spoil rgb/rgb_7.png                          | 11 | images cannot be used & (1 in all) & rgb_7.png
halve rgb/rgb_7.png                          | 11 | images cannot be used & (1 in all) & rgb_7.png
spoil rgb/rgb_{0,1,2,3,4,5,6,7,8,9,10,11}.png | refused | rgb_0.png & 12 of 12
rgb8 rgb/rgb_3.png 4x4                       | 11 | 8x6 & rgb_3.png (4x4)
rgb8 rgb/other_3.png 8x6                     | refused | _3.png & same number
intrinsics.txt = 7 7 4 3 16 16               | refused | intrinsics.txt & 16x16 pixels, but those in rgb/ have 8x6
intrinsics.txt = 0 7 4 3 8 6                 | refused | intrinsics.txt & focal length
intrinsics.txt = nan 7 4 3 8 6               | refused | intrinsics.txt & finite
intrinsics.txt = 3e38 7 2 1.5 4 3            | refused | intrinsics.txt & 8x6 & finite
intrinsics.txt = 7 7 0 0 8 6                 | refused | intrinsics.txt & principal point
intrinsics.txt = 7 7 4 3                     | refused | intrinsics.txt & 4 numbers
intrinsics.txt = 7 7 4 3 0 0                 | refused | intrinsics.txt & image size
intrinsics.txt = 7 7 4 3 8 six               | refused | intrinsics.txt & line 1: "six"
intrinsics.txt =                             | refused | intrinsics.txt & 0 numbers
gray16 depth/depth_6.png 4x4                 | 12 | without depth & depth_6.png & 4x4 & 8x6
spoil depth/depth_{0,1,2,3,4,5,6,7,8,9,10,11}.png | refused | depth & 12 of 12
remove depth/depth_5.png; spoil depth/depth_2.png; gray8 depth/depth_6.png 8x6 | 12 | (3 in all) & depth_2.png & rgb_5.png (no file) & 16-bit
"#;

#[test]
fn faults_are_warned_of_where_they_are_few_and_refused_by_the_file_otherwise() {
    check_changes(capture, change_files, CHANGES);
}

#[test]
fn unusable_depth_leaves_its_frame_without_depth_and_none_is_read_where_none_is_wanted() {
    let (_parent, folder) = capture();
    change_files(&folder, "spoil depth/depth_2.png");
    let scene = open(&folder).unwrap();
    assert!(scene.frames[2].depth().is_none() && scene.frames[3].depth().is_some());
    opened_without_depth(&folder);
}

#[test]
fn images_of_half_the_size_get_half_the_intrinsics_and_the_depth_of_either_size() {
    let (_parent, folder) = capture();
    let whole = open(&folder).unwrap();
    change_files(&folder, "rgb8 rgb/rgb_{3,4}.png 4x3");
    let steps: Vec<u16> = (1..=12).map(|n| 1000 * n).collect();
    let bytes: &[u8] = bytemuck::cast_slice(&steps);
    let path = folder.join("depth/depth_3.png");
    image::save_buffer(path, bytes, 4, 3, image::ColorType::L16).unwrap();
    let scene = opened(&folder);
    assert_eq!(scene.notes.len(), 1, "{:?}", scene.notes);
    assert!(scene.notes[0].contains("2 images") && scene.notes[0].contains("8x6"));
    let expected = Camera::new([4, 3], [3.75, 3.625, 2.0625, 1.4375]);
    assert_eq!(scene.frames[3].camera, expected);
    for index in 0..12 {
        assert!((z_depth(&scene.frames[3], index).unwrap() - (1 + index) as f32).abs() < 1e-3);
        // The centre of a pixel of half the size is the corner of four of the whole.
        let corner = 2 * (index / 4) * 8 + 2 * (index % 4);
        let around = [0, 1, 8, 9].map(|step| z_depth(&whole.frames[4], corner + step));
        let own = z_depth(&scene.frames[4], index).unwrap();
        let is_own = |z: &f32| (z - own).abs() < 2e-3;
        assert!(around.iter().flatten().any(is_own), "{own} {around:?}");
    }
}
