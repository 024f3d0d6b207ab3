//! What holds for captures with a `transforms.json`.

use std::fs;

use glam::{DQuat, DVec3};
use serde_json::{Value, json};

use super::*;
use crate::scene::Distortion;
#[cfg(unix)]
use crate::scene::testing::move_out;
use crate::scene::testing::{WITHOUT_DEPTH, open_with_outside_files, wall};

const WIDTH: u32 = 32;
const HEIGHT: u32 = 24;
/// Paths of the images of the wall's frames, as the file gives them, and where they are.
const IMAGES: [(&str, &str); 3] = [
    ("./images/c", "images/c.png"),
    ("images/b.png", "images/b.png"),
    ("images/a", "images/a.jpg"),
];

/// Somewhere far away and turned: position and directions of a world that the wall lies in.
fn placed() -> (DQuat, DVec3) {
    (
        DQuat::from_euler(glam::EulerRot::XYZ, 0.3, -0.8, 2.1),
        DVec3::new(400_000.0, -20.0, 3.0),
    )
}

/// The file of the wall, as seen by three cameras with OpenGL's axes, in metres.
fn file_of_wall() -> Value {
    let (turn, shift) = placed();
    // x stays, y and z are turned round.
    let opengl = turn * DQuat::from_rotation_x(std::f64::consts::PI);
    let rotation = glam::DMat3::from_quat(opengl);
    let frames = wall(3, WIDTH, HEIGHT).frames.into_iter().zip(IMAGES);
    let frames = frames.map(|(frame, (path, _))| {
        let centre = turn * frame.center().as_dvec3() + shift;
        let row = |i: usize| {
            json!([
                rotation.x_axis[i],
                rotation.y_axis[i],
                rotation.z_axis[i],
                centre[i]
            ])
        };
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
fn capture(file: &Value) -> tempfile::TempDir {
    let root = tempfile::tempdir().unwrap();
    fs::create_dir_all(root.path().join("images")).unwrap();
    for (frame, (_, name)) in wall(3, WIDTH, HEIGHT).frames.iter().zip(IMAGES) {
        let path = root.path().join(name);
        image::save_buffer(path, frame.color().bytes(), WIDTH, HEIGHT, image::ColorType::Rgb8).unwrap();
    }
    fs::write(root.path().join("transforms.json"), file.to_string()).unwrap();
    root
}

fn open(folder: &Path) -> Result<Scene, SceneError> {
    let source = SceneSource::Folder(folder.to_path_buf());
    Scene::open(&source, OpenOptions::default(), &|_, _| {})
}

/// The file is refused in one sentence that names it and says all of `parts`.
#[track_caller]
fn assert_refused(file: &Value, parts: &[&str]) {
    let message = open(capture(file).path()).unwrap_err().to_string();
    assert!(!message.contains('\n'), "{message}");
    for part in [&["transforms.json"], parts].concat() {
        assert!(message.contains(part), "\"{part}\" is not in: {message}");
    }
}

/// The camera of the first frame that is read from a file with these values for all frames.
fn camera_with(values: &[(&str, f64)]) -> Camera {
    let mut file = file_of_wall();
    file.as_object_mut().unwrap().remove("camera_angle_x");
    for (key, value) in values {
        file[*key] = json!(value);
    }
    open(capture(&file).path()).unwrap().frames[0].camera
}

/// Writes a depth image of one value, and says that it is that of every frame.
fn add_depth(root: &Path, file: &mut Value, width: u32, height: u32, steps: u16) {
    let depth = image::ImageBuffer::<image::Luma<u16>, _>::from_pixel(width, height, image::Luma([steps]));
    depth.save(root.join("images/depth.png")).unwrap();
    for frame in file["frames"].as_array_mut().unwrap() {
        frame["depth_file_path"] = json!("images/depth.png");
    }
    fs::write(root.join("transforms.json"), file.to_string()).unwrap();
}

#[test]
fn frames_are_posed_and_named_in_the_order_of_their_paths() {
    let root = capture(&file_of_wall());
    let scene = open(root.path()).unwrap();
    assert_eq!(scene.format, "transforms.json");
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let stems: Vec<&str> = scene.frames.iter().map(|frame| frame.stem.as_str()).collect();
    assert_eq!(stems, ["a", "b", "c"]);

    let (turn, shift) = placed();
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
}

#[test]
fn without_depth_the_cameras_span_two_metres_and_points_come_back_to_the_file() {
    let scene = open(capture(&file_of_wall()).path()).unwrap();
    assert!(
        scene.notes.iter().any(|note| note.contains("2 m")),
        "{:?}",
        scene.notes
    );
    let (turn, _) = placed();
    let span = (turn * DVec3::new(0.4, 0.0, 0.0)).abs().max_element();
    assert!((scene.unit - 0.5 * span).abs() < 1e-6, "{}", scene.unit);
}

#[test]
fn the_camera_is_given_by_lengths_or_angles() {
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
}

#[test]
fn a_frames_own_camera_comes_before_the_shared_one() {
    let mut file = file_of_wall();
    file["fl_x"] = json!(16.0);
    file["frames"][2]["camera_angle_x"] = json!(2.0 * 0.5_f64.atan());
    let scene = open(capture(&file).path()).unwrap();
    let focal: Vec<f32> = scene.frames.iter().map(|frame| frame.camera.fx.round()).collect();
    assert_eq!(focal, [32.0, 16.0, 16.0]);
}

#[test]
fn distortion_is_undone() {
    let distortion = Distortion {
        k1: -0.12,
        k2: 0.01,
        p1: 0.001,
        p2: -0.002,
    };
    let mut file = file_of_wall();
    for (key, value) in [
        ("k1", -0.12),
        ("k2", 0.01),
        ("k3", 0.0),
        ("p1", 0.001),
        ("p2", -0.002),
    ] {
        file[key] = json!(value);
    }
    let scene = open(capture(&file).path()).unwrap();
    let lens = scene.frames[0].lens.unwrap();
    assert_eq!(lens.distortion, distortion);
    assert_eq!(Some(scene.frames[0].camera), lens.pinhole());
    assert_eq!(scene.frames[0].color().width(), scene.frames[0].camera.width);
}

#[test]
fn depth_is_along_z_in_millimetres_unless_the_file_says_otherwise() {
    for (factor, steps) in [(None, 2000), (Some(0.01), 200)] {
        let mut file = file_of_wall();
        if let Some(factor) = factor {
            file["depth_unit_scale_factor"] = json!(factor);
        }
        let root = capture(&file);
        add_depth(root.path(), &mut file, WIDTH, HEIGHT, steps);
        let scene = open(root.path()).unwrap();
        assert_eq!(scene.unit, 1.0);
        let expected = DepthMap::from_z_depths(&scene.frames[0].camera, vec![2.0; (WIDTH * HEIGHT) as usize]);
        for index in [0, 40, 700] {
            let length = scene.frames[0].depth().unwrap().ray_length(index).unwrap();
            assert!((length - expected.ray_length(index).unwrap()).abs() < 1e-4);
        }
    }
}

#[test]
fn depth_follows_the_undistorted_image_and_may_be_smaller() {
    let mut file = file_of_wall();
    file["k1"] = json!(-0.12);
    let root = capture(&file);
    add_depth(root.path(), &mut file, WIDTH / 2, HEIGHT / 2, 2000);
    let frame = open(root.path()).unwrap().frames.remove(0);
    let depth = frame.depth().unwrap();
    let mut outside = 0;
    for index in 0..depth.len() {
        let known = depth.ray_length(index);
        assert_eq!(known.is_some(), frame.is_valid(index));
        outside += usize::from(known.is_none());
        if let Some(length) = known {
            let (column, row) = (
                index as u32 % frame.camera.width,
                index as u32 / frame.camera.width,
            );
            let direction = frame.camera.pixel_direction(column, row);
            assert!((length / direction.length() - 2.0).abs() < 1e-3);
        }
    }
    assert!(outside > 0);

    add_depth(root.path(), &mut file, WIDTH, WIDTH, 2000);
    let message = open(root.path()).unwrap_err().to_string();
    assert!(
        message.contains("another shape") && message.contains("without depth"),
        "{message}"
    );
    let source = SceneSource::Folder(root.path().to_path_buf());
    let scene = Scene::open(&source, WITHOUT_DEPTH, &|_, _| {}).unwrap();
    assert!(!scene.has_depth() && scene.unit == 1.0);
}

#[test]
fn missing_images_are_counted_once() {
    let mut file = file_of_wall();
    file["frames"][0]["file_path"] = json!("images/gone.png");
    file["frames"][1]["file_path"] = json!("images/gone_too");
    let scene = open(capture(&file).path()).unwrap();
    assert_eq!(scene.frames.len(), 1);
    assert_eq!(scene.warnings.len(), 1);
    assert!(
        scene.warnings[0].contains("missing (2 in all)"),
        "{:?}",
        scene.warnings
    );

    file["frames"][2]["file_path"] = json!("images/nor_this.png");
    assert_refused(&file, &["none of its 3 images", "gone.png"]);
}

/// The keys of a frame that name files.
const PATH_KEYS: [&str; 3] = ["file_path", "depth_file_path", "mask_path"];

#[test]
fn what_a_mask_has_black_is_no_part_of_the_scene_and_has_no_depth() {
    let mut file = file_of_wall();
    let root = capture(&file);
    let mask: Vec<u8> = (0..WIDTH * HEIGHT)
        .map(|index| u8::from(index % WIDTH >= 5))
        .collect();
    image::save_buffer(
        root.path().join("images/mask.png"),
        &mask,
        WIDTH,
        HEIGHT,
        image::ColorType::L8,
    )
    .unwrap();
    file["frames"][2]["mask_path"] = json!("images/mask.png");
    file["frames"][1]["mask_path"] = json!("images/no_mask.png");
    add_depth(root.path(), &mut file, WIDTH, HEIGHT, 2000);
    let scene = open(root.path()).unwrap();
    assert_eq!(scene.frames.len(), 2);
    assert_eq!(scene.warnings.len(), 1, "{:?}", scene.warnings);
    assert!(scene.warnings[0].contains("b.png") && scene.warnings[0].contains("no_mask.png"));
    let (masked, whole) = (&scene.frames[0], &scene.frames[1]);
    assert!(whole.is_whole() && !masked.is_whole());
    for index in 0..masked.camera.pixels() {
        let shown = index % WIDTH as usize >= 5;
        assert_eq!(masked.is_valid(index), shown, "{index}");
        assert_eq!(masked.depth().unwrap().ray_length(index).is_some(), shown);
        assert!(whole.is_valid(index));
    }
    let note = scene
        .notes
        .iter()
        .find(|note| note.contains("alpha or masks"))
        .unwrap();
    assert!(note.contains("1 of 2 frames") && note.contains("7.8%"), "{note}");
    file["frames"][2]["mask_path"] = json!("../mask.png");
    assert_refused(&file, &["../mask.png", "inside the folder"]);
}

#[test]
fn paths_that_leave_the_folder_are_refused() {
    for key in PATH_KEYS {
        for path in ["../a.png", "/tmp/a.png", "images/../../a.png"] {
            let mut file = file_of_wall();
            file["frames"][1][key] = json!(path);
            assert_refused(
                &file,
                &[&format!("{path:?}"), "inside the folder", "--outside-files"],
            );
        }
        for path in ["", ".", "a\0b"] {
            let mut file = file_of_wall();
            file["frames"][1][key] = json!(path);
            assert_refused(&file, &[&format!("{path:?}"), "not the path of a file"]);
        }
    }
}

#[test]
fn paths_that_leave_the_folder_are_read_where_that_is_allowed() {
    let root = capture(&file_of_wall());
    let outside = tempfile::tempdir().unwrap();
    fs::rename(root.path().join("images/b.png"), outside.path().join("b.png")).unwrap();
    let mut file = file_of_wall();
    file["frames"][1]["file_path"] = json!(outside.path().join("b"));
    add_depth(root.path(), &mut file, WIDTH, HEIGHT, 2000);
    let inner = root.path().join("inner");
    fs::rename(root.path().join("images"), root.path().join("pictures")).unwrap();
    fs::create_dir(&inner).unwrap();
    let text = file
        .to_string()
        .replace("images/", "../pictures/")
        .replace("./../", "../");
    fs::write(inner.join("transforms.json"), text).unwrap();
    let scene = open_with_outside_files(&inner).unwrap();
    assert_eq!(scene.frames.len(), 3, "{:?}", scene.warnings);
    assert!(scene.frames.iter().all(|frame| frame.has_depth()));
    let mut stems: Vec<&str> = scene.frames.iter().map(|frame| frame.stem.as_str()).collect();
    stems.sort_unstable();
    assert_eq!(stems, ["a", "b", "c"]);
    let message = open(&inner).unwrap_err().to_string();
    assert!(message.contains("--outside-files"), "{message}");
}

#[cfg(unix)]
#[test]
fn links_that_leave_the_folder_are_refused_unless_that_is_allowed() {
    for name in ["images/b.png", "images/depth.png"] {
        let root = capture(&file_of_wall());
        add_depth(root.path(), &mut file_of_wall(), WIDTH, HEIGHT, 2000);
        let outside = move_out(root.path(), name);
        let message = open(root.path()).unwrap_err().to_string();
        assert!(
            message.contains(name) && message.contains("--outside-files"),
            "{message}"
        );
        let scene = open_with_outside_files(root.path()).unwrap();
        assert_eq!(scene.frames.len(), 3);
        assert!(scene.frames.iter().all(|frame| frame.has_depth()));
        drop(outside);
    }
    // A link to a file of the capture stays inside.
    let root = capture(&file_of_wall());
    let images = root.path().join("images");
    fs::rename(images.join("b.png"), root.path().join("moved.png")).unwrap();
    std::os::unix::fs::symlink("../moved.png", images.join("b.png")).unwrap();
    assert_eq!(open(root.path()).unwrap().frames.len(), 3);
}

#[test]
fn lenses_that_cannot_be_undone_are_refused() {
    for (key, value, part) in [
        ("camera_model", json!("OPENCV_FISHEYE"), "OPENCV_FISHEYE"),
        ("camera_model", json!("EQUIRECTANGULAR"), "EQUIRECTANGULAR"),
        ("is_fisheye", json!(true), "fisheye"),
        ("k3", json!(0.01), "k3"),
        ("fl_x", json!(-3.0), "focal length"),
        ("fl_x", json!(1e300), "finite"),
        ("camera_angle_x", json!(4.0), "finite"),
        ("w", json!(0.5), "image size"),
        ("k1", json!(1e308), "distortion"),
    ] {
        let mut file = file_of_wall();
        (file["w"], file["h"]) = (json!(WIDTH), json!(HEIGHT));
        file[key] = value;
        assert_refused(&file, &[part]);
    }
    let mut file = file_of_wall();
    file.as_object_mut().unwrap().remove("camera_angle_x");
    assert_refused(&file, &["no focal length", "fl_x"]);
}

#[test]
fn unusable_poses_are_left_out_up_to_half_of_them() {
    let rows = json!([[2, 0, 0, 0], [0, 2, 0, 0], [0, 0, 2, 0], [0, 0, 0, 1]]);
    let mut file = file_of_wall();
    file["frames"][0]["transform_matrix"] = rows.clone();
    let scene = open(capture(&file).path()).unwrap();
    assert_eq!(scene.frames.len(), 2);
    assert!(
        scene.warnings[0].contains("not a rotation"),
        "{:?}",
        scene.warnings
    );
    file["frames"][1]["transform_matrix"] = rows;
    assert_refused(&file, &["2 of its 3 poses", "images/c.png", "not a rotation"]);

    for (pose, problem) in [
        (
            json!([[1, 0, 0, 1e300], [0, 1, 0, 0], [0, 0, 1, 0]]),
            "too far from zero",
        ),
        (json!([[1, 0, 0], [0, 1, 0], [0, 0, 1]]), "4 x 4"),
        (
            json!([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 1, 1]]),
            "last row",
        ),
        (
            json!([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1, 0]]),
            "not a rotation",
        ),
    ] {
        let mut file = file_of_wall();
        for frame in file["frames"].as_array_mut().unwrap() {
            frame["transform_matrix"] = pose.clone();
        }
        assert_refused(&file, &["3 of its 3 poses", problem]);
    }
}

#[test]
fn a_file_without_frames_or_with_other_content_is_refused() {
    assert_refused(&json!({}), &["no frames"]);
    assert_refused(&json!({"frames": []}), &["no frames"]);
    assert_refused(&json!({"frames": 3}), &["not a list"]);
    let mut file = file_of_wall();
    file["depth_unit_scale_factor"] = json!(0.0);
    assert_refused(&file, &["depth_unit_scale_factor"]);
    let root = capture(&file_of_wall());
    // What Python writes for a number that is not finite.
    fs::write(
        root.path().join("transforms.json"),
        r#"{"fl_x": NaN, "frames": []}"#,
    )
    .unwrap();
    let message = open(root.path()).unwrap_err().to_string();
    assert!(
        message.contains("transforms.json") && message.contains("line 1"),
        "{message}"
    );
}

#[test]
fn images_of_another_size_or_none_at_all_are_left_out() {
    let mut file = file_of_wall();
    (file["w"], file["h"]) = (json!(WIDTH), json!(HEIGHT));
    let root = capture(&file);
    image::RgbImage::new(8, 8)
        .save(root.path().join("images/b.png"))
        .unwrap();
    let scene = open(root.path()).unwrap();
    assert_eq!(scene.frames.len(), 2);
    assert!(
        scene.warnings[0].contains("8x8 instead of 32x24"),
        "{:?}",
        scene.warnings
    );
    fs::write(root.path().join("images/c.png"), "no image").unwrap();
    let message = open(root.path()).unwrap_err().to_string();
    assert!(message.contains("2 of its 3 images"), "{message}");
}

#[test]
fn an_image_that_is_listed_twice_is_refused() {
    let mut file = file_of_wall();
    file["frames"][1]["file_path"] = json!("images/a");
    assert_refused(&file, &["\"images/a.jpg\" twice"]);
}

#[test]
fn images_in_a_folder_named_rgb_do_not_make_it_a_replica() {
    let root = capture(&file_of_wall());
    fs::create_dir(root.path().join("rgb")).unwrap();
    assert_eq!(open(root.path()).unwrap().format, NAME);
    fs::write(root.path().join("traj_w_c.txt"), "").unwrap();
    let message = open(root.path()).unwrap_err().to_string();
    assert!(!message.contains("transforms.json"), "{message}");
}
