//! What holds for captures with a `transforms.json`.

use std::fs;

use glam::{DQuat, DVec3};
use serde_json::{Value, json};
use tempfile::TempDir;

use super::*;
use crate::scene::testing::{
    assert_outside, assert_refused, change_files, check_changes, expanded, far_away, open, opened,
    opened_without_depth, stems, wall, z_depth,
};
use crate::scene::{Camera, Distortion};

const WIDTH: u32 = 32;
const HEIGHT: u32 = 24;
/// Paths of the images of the wall's frames, as the file gives them, and where they are.
const IMAGES: [(&str, &str); 3] = [
    ("./images/c", "images/c.png"),
    ("images/b.png", "images/b.png"),
    ("images/a", "images/a.jpg"),
];

/// The file of the wall, as seen by three cameras with OpenGL's axes, in metres.
fn file_of_wall() -> Value {
    let (turn, shift) = far_away();
    // x stays, y and z are turned round.
    let opengl = turn * DQuat::from_rotation_x(std::f64::consts::PI);
    let rotation = glam::DMat3::from_quat(opengl);
    let frames = wall(3, WIDTH, HEIGHT).frames.into_iter().zip(IMAGES);
    let frames = frames.map(|(frame, (path, _))| {
        let centre = turn * frame.center().as_dvec3() + shift;
        let [x, y, z] = [rotation.x_axis, rotation.y_axis, rotation.z_axis];
        let row = |i: usize| json!([x[i], y[i], z[i], centre[i]]);
        json!({"file_path": path, "transform_matrix": [row(0), row(1), row(2), [0, 0, 0, 1]]})
    });
    json!({
        "camera_angle_x": std::f64::consts::FRAC_PI_2,
        "applied_transform": [[0, 1, 0, 5], [1, 0, 0, 5], [0, 0, 1, 5]],
        "applied_scale": 3.0,
        "frames": frames.collect::<Vec<Value>>(),
    })
}

/// A capture on disk with the wall's images and this file.
fn capture_of(file: &Value) -> (TempDir, PathBuf) {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().to_path_buf();
    fs::create_dir(folder.join("images")).unwrap();
    for (frame, (_, name)) in wall(3, WIDTH, HEIGHT).frames.iter().zip(IMAGES) {
        let path = folder.join(name);
        image::save_buffer(path, frame.color().bytes(), WIDTH, HEIGHT, image::ColorType::Rgb8).unwrap();
    }
    fs::write(folder.join("transforms.json"), file.to_string()).unwrap();
    (root, folder)
}

fn capture() -> (TempDir, PathBuf) {
    capture_of(&file_of_wall())
}

/// Sets values of the file: steps `POINTER = JSON` with `; ` between them. A pointer with `{a,b}` in it is two, and
/// what does not begin with a pointer changes other files.
fn change_file(folder: &Path, steps: &str) {
    let path = folder.join("transforms.json");
    for step in steps.split("; ") {
        let Some((pointers, value)) = step.split_once(" = ").filter(|_| step.starts_with('/')) else {
            change_files(folder, step);
            continue;
        };
        let mut file: Value = serde_json::from_str(&fs::read_to_string(&path).unwrap()).unwrap();
        for pointer in expanded(pointers) {
            let (parent, key) = pointer.rsplit_once('/').unwrap();
            file.pointer_mut(parent).unwrap()[key] = serde_json::from_str(value).unwrap();
        }
        fs::write(&path, file.to_string()).unwrap();
    }
}

/// The camera of the first frame that is read from a file with these values for all frames.
fn camera_with(values: &[(&str, f64)]) -> Camera {
    let mut file = file_of_wall();
    file.as_object_mut().unwrap().remove("camera_angle_x");
    for (key, value) in values {
        file[*key] = json!(value);
    }
    opened(&capture_of(&file).1).frames[0].camera
}

/// Writes a depth image of one value, and says that it is that of every frame.
fn add_depth(folder: &Path, width: u32, height: u32, steps: u16) {
    let depth = image::ImageBuffer::<image::Luma<u16>, _>::from_pixel(width, height, image::Luma([steps]));
    depth.save(folder.join("images/depth.png")).unwrap();
    change_file(folder, r#"/frames/{0,1,2}/depth_file_path = "images/depth.png""#);
}

#[test]
fn frames_are_posed_and_named_in_the_order_of_their_paths() {
    let (_root, folder) = capture();
    let scene = opened(&folder);
    assert_eq!(scene.format, "transforms.json");
    assert_eq!(stems(&scene), ["a", "b", "c"]);

    let (turn, shift) = far_away();
    let mut of_wall = wall(3, WIDTH, HEIGHT).frames;
    of_wall.reverse();
    for (frame, original) in scene.frames.iter().zip(&of_wall) {
        assert_eq!(frame.camera, original.camera);
        let centre = scene.to_capture(frame.center());
        assert!(centre.distance(turn * original.center().as_dvec3() + shift) < 1e-6);
        for index in [0, 40, 700] {
            let expected = turn * original.ray_direction(index).as_dvec3();
            assert!(frame.ray_direction(index).as_dvec3().distance(expected) < 1e-5);
        }
    }
    assert_eq!(scene.frames[1].color(), of_wall[1].color());
    // Without depth the cameras span two metres.
    assert!(scene.notes.join(" ").contains("2 m"), "{:?}", scene.notes);
    let span = (turn * DVec3::new(0.4, 0.0, 0.0)).abs().max_element();
    assert!((scene.unit - 0.5 * span).abs() < 1e-6, "{}", scene.unit);
}

#[test]
fn a_byte_order_mark_before_the_text_changes_nothing() {
    let (_root, folder) = capture();
    let path = folder.join("transforms.json");
    let marked = format!("\u{feff}{}", fs::read_to_string(&path).unwrap());
    fs::write(&path, marked).unwrap();
    assert_eq!(opened(&folder).frames.len(), 3);
}

#[test]
fn the_camera_is_given_by_lengths_or_angles_and_a_frames_own_comes_first() {
    let of_wall = wall(1, WIDTH, HEIGHT).frames[0].camera;
    assert_eq!(camera_with(&[("fl_x", 16.0)]), of_wall);
    let angle_y = 2.0 * (12.0_f64 / 20.0).atan();
    let camera = camera_with(&[
        ("camera_angle_x", 0.1),
        ("fl_x", 16.0),
        ("camera_angle_y", angle_y),
        ("cx", 15.0),
        ("cy", 13.0),
        ("w", 32.0),
        ("h", 24.0),
    ]);
    assert!((camera.fy - 20.0).abs() < 1e-4);
    assert_eq!((camera.fx, camera.cx, camera.cy), (16.0, 15.0, 13.0));

    let (_root, folder) = capture();
    let own = 2.0 * 0.5_f64.atan();
    change_file(&folder, &format!("/fl_x = 16; /frames/2/camera_angle_x = {own}"));
    let frames = opened(&folder).frames;
    let focal: Vec<f32> = frames.iter().map(|frame| frame.camera.fx.round()).collect();
    assert_eq!(focal, [32.0, 16.0, 16.0]);
}

#[test]
fn depth_is_along_z_in_millimetres_unless_the_file_says_otherwise() {
    for (scale, steps) in [("", 2000), ("/depth_unit_scale_factor = 0.01", 200)] {
        let (_root, folder) = capture();
        if !scale.is_empty() {
            change_file(&folder, scale);
        }
        add_depth(&folder, WIDTH, HEIGHT, steps);
        let scene = opened(&folder);
        assert_eq!(scene.unit, 1.0);
        for index in [0, 40, 700] {
            assert!((z_depth(&scene.frames[0], index).unwrap() - 2.0).abs() < 1e-4);
        }
    }
}

#[test]
fn distortion_is_undone_and_depth_follows_which_may_be_smaller_but_not_of_another_shape() {
    let (_root, folder) = capture();
    let steps = "/k1 = -0.12; /k2 = 0.01; /k3 = 0; /p1 = 0.001; /p2 = -0.002";
    change_file(&folder, steps);
    add_depth(&folder, WIDTH / 2, HEIGHT / 2, 2000);
    let frame = opened(&folder).frames.remove(0);
    let lens = frame.lens.unwrap();
    assert_eq!(lens.distortion, Distortion::opencv([-0.12, 0.01, 0.001, -0.002]));
    assert_eq!(Some(frame.camera), lens.pinhole());
    assert_eq!(frame.color().width(), frame.camera.width);
    let mut outside = 0;
    for index in 0..frame.camera.pixels() {
        let known = z_depth(&frame, index);
        assert_eq!(known.is_some(), frame.is_valid(index));
        outside += usize::from(known.is_none());
        assert!(known.is_none_or(|z| (z - 2.0).abs() < 1e-3));
    }
    assert!(outside > 0);
    add_depth(&folder, WIDTH, WIDTH, 2000);
    assert_refused(&folder, &["another shape", "without depth"]);
    assert_eq!(opened_without_depth(&folder).unit, 1.0);
}

#[test]
fn what_a_mask_has_black_is_no_part_of_the_scene_and_has_no_depth() {
    let (_root, folder) = capture();
    let mask = |x, _| image::Luma([u8::from(x >= 5)]);
    let mask = image::GrayImage::from_fn(WIDTH, HEIGHT, mask);
    mask.save(folder.join("images/mask.png")).unwrap();
    change_file(&folder, r#"/frames/2/mask_path = "images/mask.png""#);
    add_depth(&folder, WIDTH, HEIGHT, 2000);
    let scene = opened(&folder);
    let (masked, whole) = (&scene.frames[0], &scene.frames[1]);
    assert!(whole.is_whole() && !masked.is_whole());
    for index in 0..masked.camera.pixels() {
        let shown = index % WIDTH as usize >= 5;
        assert_eq!(masked.is_valid(index), shown, "{index}");
        assert_eq!(masked.depth().unwrap().ray_length(index).is_some(), shown);
        assert!(whole.is_valid(index));
    }
    let mut notes = scene.notes.iter();
    let note = notes.find(|note| note.contains("alpha or masks")).unwrap();
    assert!(note.contains("1 of 3 frames") && note.contains("5.2%"), "{note}");
}

/// What opening the capture says after changes to its file.
const CHANGES: &str = r#"
transforms.json = {}                        | refused | transforms.json & no frames
transforms.json = {"frames": []}            | refused | transforms.json & no frames
transforms.json = {"frames": 3}             | refused | transforms.json & not a list
transforms.json = {"fl_x": NaN, "frames": []} | refused | transforms.json & line 1
/depth_unit_scale_factor = 0                | refused | transforms.json & depth_unit_scale_factor
/camera_model = "OPENCV_FISHEYE"            | refused | transforms.json & OPENCV_FISHEYE
/camera_model = "EQUIRECTANGULAR"           | refused | transforms.json & EQUIRECTANGULAR
/is_fisheye = true                          | refused | transforms.json & fisheye
/k3 = 0.01                                  | refused | transforms.json & k3
/k1 = 1e308                                 | refused | transforms.json & distortion
/fl_x = -3                                  | refused | transforms.json & focal length
/fl_x = 1e300                               | refused | transforms.json & finite
/camera_angle_x = 4                         | refused | transforms.json & finite
/camera_angle_x = null                      | refused | transforms.json & no focal length & fl_x
/h = 24; /w = 0.5                           | refused | transforms.json & image size
/frames/1/file_path = "/tmp/a.png"          | refused | transforms.json & "/tmp/a.png" & --outside-files
/frames/1/depth_file_path = "../a.png"      | refused | transforms.json & "../a.png" & --outside-files
/frames/1/mask_path = "images/../../a.png"  | refused | transforms.json & "images/../../a.png" & inside the folder
/frames/1/file_path = ""                    | refused | transforms.json & "" & not the path of a file
/frames/1/depth_file_path = "."             | refused | transforms.json & "." & not the path of a file
/frames/1/mask_path = "a\u0000b"            | refused | transforms.json & "a\0b" & not the path of a file
/frames/1/file_path = "images/a"            | refused | transforms.json & "images/a.jpg" twice
/frames/0/file_path = "images/gone.png"; /frames/1/file_path = "images/gone_too" | 1 | missing (2 in all)
remove images/{a.jpg,b.png,c.png}           | refused | transforms.json & none of its 3 images
/frames/1/mask_path = "images/no_mask.png"  | 2 | b.png & no_mask.png
/w = 32; /h = 24; rgb8 images/b.png 8x8     | 2 | 8x8 instead of 32x24
spoil images/{b.png,c.png}                  | refused | 2 of its 3 images
/frames/0/transform_matrix = [[2,0,0,0],[0,2,0,0],[0,0,2,0],[0,0,0,1]]       | 2 | not a rotation
/frames/{0,1}/transform_matrix = [[2,0,0,0],[0,2,0,0],[0,0,2,0],[0,0,0,1]] | refused | 2 of its 3 poses & images/c.png & not a rotation
/frames/{0,1,2}/transform_matrix = [[1,0,0,1e300],[0,1,0,0],[0,0,1,0]] | refused | 3 of its 3 poses & too far from zero
/frames/{0,1,2}/transform_matrix = [[1,0,0],[0,1,0],[0,0,1]]           | refused | 3 of its 3 poses & 4 x 4
/frames/{0,1,2}/transform_matrix = [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,1,1]] | refused | 3 of its 3 poses & last row
/frames/{0,1,2}/transform_matrix = [[1,0,0,0],[0,1,0,0],[0,0,-1,0]]    | refused | 3 of its 3 poses & not a rotation
"#;

#[test]
fn faults_are_warned_of_where_they_are_few_and_refused_by_the_file_otherwise() {
    check_changes(capture, change_file, CHANGES);
}

#[test]
fn paths_that_leave_the_folder_are_read_where_that_is_allowed() {
    let (_root, folder) = capture();
    let outside = tempfile::tempdir().unwrap();
    fs::rename(folder.join("images/b.png"), outside.path().join("b.png")).unwrap();
    let path = json!(outside.path().join("b"));
    change_file(&folder, &format!("/frames/1/file_path = {path}"));
    add_depth(&folder, WIDTH, HEIGHT, 2000);
    let inner = folder.join("inner");
    fs::rename(folder.join("images"), folder.join("pictures")).unwrap();
    fs::create_dir(&inner).unwrap();
    let text = fs::read_to_string(folder.join("transforms.json")).unwrap();
    let text = text.replace("images/", "../pictures/").replace("./../", "../");
    fs::write(inner.join("transforms.json"), text).unwrap();
    let scene = assert_outside(&inner, &["transforms.json"], 3);
    assert!(scene.frames.iter().all(|frame| frame.has_depth()));
    let mut named = stems(&scene);
    named.sort_unstable();
    assert_eq!(named, ["a", "b", "c"]);
}

#[test]
fn images_in_a_folder_named_rgb_do_not_make_it_a_replica() {
    let (_root, folder) = capture();
    fs::create_dir(folder.join("rgb")).unwrap();
    assert_eq!(opened(&folder).format, FORMAT.name);
    change_files(&folder, "traj_w_c.txt =");
    let message = open(&folder).unwrap_err().to_string();
    assert!(!message.contains("transforms.json"), "{message}");
}
