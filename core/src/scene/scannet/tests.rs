//! What holds for scans in this layout, good and bad.

use std::fs;

use glam::Vec3;

use super::*;
use crate::scene::testing::{WITHOUT_DEPTH, assert_refused, assert_warned, open};
use crate::scene::{Frame, SceneSource};

/// Numbers of the frames, as they are left where a scan was thinned.
const NUMBERS: [usize; 6] = [0, 2, 10, 20, 100, 1005];
const COLOR: (u32, u32) = (24, 16);
const DEPTH: (u32, u32) = (16, 12);

fn intrinsic(focal: f64, cx: f64, cy: f64) -> String {
    format!("{focal} 0 {cx} 0\n0 {focal} {cy} 0\n0 0 1 0\n0 0 0 1\n")
}

fn pose(folder: &Path, number: usize) -> PathBuf {
    folder.join(format!("pose/{number}.txt"))
}

/// A scan whose depth image is less of a close-up than its colour image; the depth of column k is 1000 + 100 k
/// millimetres.
fn scan() -> tempfile::TempDir {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path();
    for name in ["color", "depth", "pose", "intrinsic"] {
        fs::create_dir(folder.join(name)).unwrap();
    }
    for (index, number) in NUMBERS.into_iter().enumerate() {
        let color = image::RgbImage::from_pixel(COLOR.0, COLOR.1, image::Rgb([40 * index as u8; 3]));
        color.save(folder.join(format!("color/{number}.jpg"))).unwrap();
        let steps = |x: u32, _| image::Luma([1000 + 100 * x as u16]);
        let depth = image::ImageBuffer::from_fn(DEPTH.0, DEPTH.1, steps);
        depth.save(folder.join(format!("depth/{number}.png"))).unwrap();
        // A quarter turn around y: what the camera sees ahead is along x.
        let matrix = format!("0 0 1 {}\n0 1 0 0.5\n-1 0 0 -3\n0 0 0 1\n", 0.1 * index as f64);
        fs::write(pose(folder, number), matrix).unwrap();
    }
    let file = |name: &str, text: String| fs::write(folder.join("intrinsic").join(name), text).unwrap();
    file("intrinsic_color.txt", intrinsic(20.0, 11.5, 7.5));
    file("intrinsic_depth.txt", intrinsic(10.0, 7.5, 5.5));
    for kind in ["color", "depth"] {
        let identity = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n".to_owned();
        file(&format!("extrinsic_{kind}.txt"), identity);
    }
    root
}

/// Depth of a frame's pixel along the camera's z axis, in metres.
fn z(frame: &Frame, column: u32, row: u32) -> Option<f32> {
    let length = frame
        .depth()?
        .ray_length((row * frame.camera.width + column) as usize)?;
    Some(length / frame.camera.pixel_direction(column, row).length())
}

#[test]
fn frames_are_posed_in_the_order_of_their_numbers() {
    let root = scan();
    let scene = open(root.path()).unwrap();
    assert_eq!(scene.format, "ScanNet");
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);
    let stems: Vec<&str> = scene.frames.iter().map(|frame| frame.stem.as_str()).collect();
    assert_eq!(stems, ["0", "2", "10", "20", "100", "1005"]);
    let frame = &scene.frames[3];
    assert_eq!(frame.color().pixel(5), [120; 3]);
    assert!(frame.center().distance(Vec3::new(0.3, 0.5, -3.0)) < 1e-6);
    // Principal points in the files count pixel centres from 0.
    let camera = frame.camera;
    assert_eq!(
        (camera.fx, camera.fy, camera.cx, camera.cy),
        (20.0, 20.0, 12.0, 8.0)
    );
    let ahead = frame.ray_direction(8 * 24 + 12);
    assert!(ahead.x > 0.99, "{ahead}");
}

#[test]
fn depth_is_brought_to_the_colour_images_by_the_two_intrinsics() {
    let root = scan();
    let frame = &open(root.path()).unwrap().frames[1];
    for row in 0..16 {
        for column in 0..24 {
            let seen = 10.0 * (column as f32 + 0.5 - 12.0) / 20.0 + 8.0;
            let expected = 1.0 + 0.1 * seen.floor();
            assert!(
                (z(frame, column, row).unwrap() - expected).abs() < 1e-3,
                "{column} {row}"
            );
        }
    }
    // A depth camera that sees a part of what the colour camera sees: nothing is known around it.
    fs::write(
        root.path().join("intrinsic/intrinsic_depth.txt"),
        intrinsic(40.0, 7.5, 5.5),
    )
    .unwrap();
    let frame = &open(root.path()).unwrap().frames[1];
    for (column, row, known) in [
        (12, 8, true),
        (8, 8, true),
        (7, 8, false),
        (16, 8, false),
        (12, 4, false),
    ] {
        assert_eq!(z(frame, column, row).is_some(), known, "{column} {row}");
    }
}

#[test]
fn depth_without_a_camera_of_its_own_must_have_the_colour_images_proportions() {
    let root = scan();
    fs::remove_file(root.path().join("intrinsic/intrinsic_depth.txt")).unwrap();
    assert_refused(root.path(), &["0.png", "16x12", "24x16"]);
    let source = SceneSource::Folder(root.path().to_path_buf());
    let scene = Scene::open(&source, WITHOUT_DEPTH, &|_, _| {}).unwrap();
    assert!(!scene.has_depth() && scene.warnings.is_empty());
    for number in NUMBERS {
        let depth = image::ImageBuffer::from_pixel(12, 8, image::Luma([2000_u16]));
        depth
            .save(root.path().join(format!("depth/{number}.png")))
            .unwrap();
    }
    let scene = open(root.path()).unwrap();
    assert!((z(&scene.frames[0], 3, 3).unwrap() - 2.0).abs() < 1e-3);
    assert!(
        scene.notes[0].contains("intrinsic_depth.txt"),
        "{:?}",
        scene.notes
    );
}

#[test]
fn frames_that_lost_track_are_left_out_with_one_warning_and_most_are_an_error() {
    let root = scan();
    let lost = "-inf -inf -inf -inf\n".repeat(4);
    for number in [2, 10, 1005] {
        fs::write(pose(root.path(), number), &lost).unwrap();
    }
    assert_warned(
        root.path(),
        3,
        &["tracking was lost (3 in all)", "2.txt", "10.txt", "1005.txt"],
    );
    fs::write(pose(root.path(), 0), &lost).unwrap();
    assert_refused(root.path(), &["pose", "4 of 6 poses", "0.txt"]);
}

#[test]
fn files_without_a_partner_are_left_out_and_most_are_an_error() {
    let root = scan();
    fs::remove_file(pose(root.path(), 100)).unwrap();
    assert_warned(root.path(), 5, &["no file in pose/", "(1 in all)", "100.jpg"]);
    fs::remove_file(root.path().join("color/2.jpg")).unwrap();
    let scene = open(root.path()).unwrap();
    assert_eq!((scene.frames.len(), scene.warnings.len()), (4, 2));
    for number in [0, 10, 20] {
        fs::remove_file(pose(root.path(), number)).unwrap();
    }
    assert_refused(root.path(), &["4 images in color/", "0.jpg"]);
    fs::remove_dir_all(root.path().join("color")).unwrap();
    fs::create_dir(root.path().join("color")).unwrap();
    assert_refused(root.path(), &["color", "holds no JPEG"]);
}

#[test]
fn the_selected_frames_name_their_intrinsics_otherwise() {
    let root = scan();
    let folder = root.path();
    for kind in ["color", "depth"] {
        let file = folder.join(format!("intrinsic/intrinsic_{kind}.txt"));
        fs::rename(file, folder.join(format!("intrinsics_{kind}.txt"))).unwrap();
    }
    fs::remove_dir_all(folder.join("intrinsic")).unwrap();
    let scene = open(folder).unwrap();
    assert_eq!(scene.frames[0].camera.fx, 20.0);
    assert!(scene.warnings.is_empty() && scene.notes.is_empty());
    fs::remove_file(folder.join("intrinsics_color.txt")).unwrap();
    assert_refused(
        folder,
        &["intrinsics.txt", "intrinsic/intrinsic_color.txt", "fx fy cx cy"],
    );
    fs::write(folder.join("intrinsics.txt"), "21 22 12 8 24 16").unwrap();
    assert_eq!(open(folder).unwrap().frames[0].camera.fy, 22.0);
}

#[test]
fn images_that_were_resized_get_scaled_intrinsics_and_cropped_ones_are_refused() {
    let root = scan();
    let file = root.path().join("intrinsic/intrinsic_color.txt");
    fs::write(&file, intrinsic(1170.0, 646.3, 489.9)).unwrap();
    let calibration = Calibration::read(root.path(), "color", COLOR_SIZE)
        .unwrap()
        .unwrap();
    let own = calibration.camera(1296, 968).unwrap();
    assert_eq!((own.fx, own.cx, own.cy), (1170.0, 646.8, 490.4));
    let small = calibration.camera(640, 480).unwrap();
    assert!((small.fx - 1170.0 * 640.0 / 1296.0).abs() < 1e-3);
    assert!((small.fy - 1170.0 * 480.0 / 968.0).abs() < 1e-3);
    assert!((small.cy - 490.4 * 480.0 / 968.0).abs() < 1e-3);
    let reason = calibration.camera(968, 968).unwrap_err().to_string();
    assert!(reason.contains("646.3") && reason.contains("968x968"), "{reason}");
    assert_refused(root.path(), &["intrinsics.txt", "24x16", "cropped or resized"]);
}

#[test]
fn unusable_matrices_are_named() {
    let root = scan();
    let file = root.path().join("intrinsic/intrinsic_color.txt");
    for (text, part) in [
        ("20 0 11.5\n", "has 3 numbers"),
        ("0 0 11.5 0 20 7.5 0 0 1", "focal length"),
        ("f 0 11.5", "\"f\" is not a number"),
    ] {
        fs::write(&file, text).unwrap();
        assert_refused(root.path(), &["intrinsic_color.txt", part]);
    }
    fs::write(&file, "20 0 11.5 0 20 7.5 0 0 1").unwrap();
    assert_eq!(open(root.path()).unwrap().frames[0].camera.cx, 12.0);
    let moved = "1 0 0 0.03\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
    fs::write(root.path().join("intrinsic/extrinsic_depth.txt"), moved).unwrap();
    assert_warned(root.path(), 6, &["extrinsic_depth.txt", "not applied"]);
    fs::write(pose(root.path(), 20), "1 0 0 0\n0 1 0\n").unwrap();
    assert_refused(root.path(), &["20.txt", "line 2 has 3 numbers"]);
}
