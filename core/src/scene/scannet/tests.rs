//! What holds for scans in this layout, good and bad.

use std::fs;

use glam::Vec3;
use tempfile::TempDir;

use super::*;
use crate::scene::testing::{
    assert_refused, change_files, check_changes, opened, opened_without_depth, stems, z_depth,
};
use crate::scene::{Camera, Frame};

/// Numbers of the frames, as they are left where a scan was thinned.
const NUMBERS: [usize; 6] = [0, 2, 10, 20, 100, 1005];
const COLOR: (u32, u32) = (24, 16);
const DEPTH: (u32, u32) = (16, 12);

fn intrinsic(focal: f64, cx: f64, cy: f64) -> String {
    format!("{focal} 0 {cx} 0\n0 {focal} {cy} 0\n0 0 1 0\n0 0 0 1\n")
}

/// A scan whose depth image is less of a close-up than its colour image; the depth of column k is 1000 + 100 k
/// millimetres.
fn scan() -> (TempDir, PathBuf) {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().to_path_buf();
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
        fs::write(folder.join(format!("pose/{number}.txt")), matrix).unwrap();
    }
    let file = |name: &str, text: String| fs::write(folder.join("intrinsic").join(name), text).unwrap();
    file("intrinsic_color.txt", intrinsic(20.0, 11.5, 7.5));
    file("intrinsic_depth.txt", intrinsic(10.0, 7.5, 5.5));
    for kind in ["color", "depth"] {
        let identity = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n".to_owned();
        file(&format!("extrinsic_{kind}.txt"), identity);
    }
    (root, folder)
}

/// Depth of a frame's pixel along the camera's z axis, in metres.
fn z(frame: &Frame, column: u32, row: u32) -> Option<f32> {
    z_depth(frame, (row * frame.camera.width + column) as usize)
}

#[test]
fn frames_are_posed_in_the_order_of_their_numbers_with_the_depth_of_another_camera() {
    let (_root, folder) = scan();
    let scene = opened(&folder);
    assert_eq!(scene.format, "ScanNet");
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);
    assert_eq!(stems(&scene), ["0", "2", "10", "20", "100", "1005"]);
    let frame = &scene.frames[3];
    assert_eq!(frame.color().pixel(5), [120; 3]);
    assert!(frame.center().distance(Vec3::new(0.3, 0.5, -3.0)) < 1e-6);
    // Principal points in the files count pixel centres from 0.
    assert_eq!(frame.camera, Camera::new([24, 16], [20.0, 20.0, 12.0, 8.0]));
    let ahead = frame.ray_direction(8 * 24 + 12);
    assert!(ahead.x > 0.99, "{ahead}");
    // Depth is brought to the colour images by the two intrinsics.
    for row in 0..16 {
        for column in 0..24 {
            let seen = 10.0 * (column as f32 + 0.5 - 12.0) / 20.0 + 8.0;
            let expected = 1.0 + 0.1 * seen.floor();
            let depth = z(frame, column, row).unwrap();
            assert!((depth - expected).abs() < 1e-3, "{column} {row}");
        }
    }
    // A depth camera that sees a part of what the colour camera sees: nothing is known around it.
    let close_up = intrinsic(40.0, 7.5, 5.5);
    fs::write(folder.join("intrinsic/intrinsic_depth.txt"), close_up).unwrap();
    let frame = &opened(&folder).frames[1];
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
    let (_root, folder) = scan();
    change_files(&folder, "remove intrinsic/intrinsic_depth.txt");
    assert_refused(&folder, &["0.png", "16x12", "24x16"]);
    opened_without_depth(&folder);
    for number in NUMBERS {
        let depth = image::ImageBuffer::from_pixel(12, 8, image::Luma([2000_u16]));
        depth.save(folder.join(format!("depth/{number}.png"))).unwrap();
    }
    let scene = opened(&folder);
    assert!((z(&scene.frames[0], 3, 3).unwrap() - 2.0).abs() < 1e-3);
    let note = &scene.notes[0];
    assert!(note.contains("intrinsic_depth.txt"), "{note}");
}

/// What opening the scan says after changes to its files. INF is a pose of four such rows: tracking was lost.
const CHANGES: &str = r#"
pose/{2,10,1005}.txt = INF               | 3 | tracking was lost (3 in all) & 2.txt & 10.txt & 1005.txt
pose/{0,2,10,1005}.txt = INF             | refused | pose & 4 of 6 poses & 0.txt
pose/20.txt = 1 0 0 0\n0 1 0\n           | refused | 20.txt & line 2 has 3 numbers
remove pose/100.txt                      | 5 | no file in pose/ & (1 in all) & 100.jpg
remove pose                              | refused | pose: cannot be read & check that it is there
remove color/2.jpg                       | 5 | (1 in all) & 2.txt
remove pose/{0,2,10,20}.txt              | refused | 4 images in color/ & 0.jpg
remove color/{0,2,10,20,100,1005}.jpg    | refused | color & holds no JPEG
intrinsic/intrinsic_color.txt = 1170 0 646.3 0 1170 489.9 0 0 1 | refused | intrinsics.txt & 24x16 & cropped or resized
intrinsic/intrinsic_depth.txt = 1170 0 646.3 0 1170 489.9 0 0 1 | refused | 6 of 6 depth images & 0.png (the principal point & intrinsic_depth.txt & 16x12
intrinsic/intrinsic_color.txt = 20 0 11.5\n | refused | intrinsic_color.txt & has 3 numbers
intrinsic/intrinsic_color.txt = 0 0 11.5 0 20 7.5 0 0 1 | refused | intrinsic_color.txt & focal length
intrinsic/intrinsic_color.txt = f 0 11.5 | refused | intrinsic_color.txt & "f" is not a number
intrinsic/extrinsic_depth.txt = 1 0 0 0.03\n0 1 0 0\n0 0 1 0\n0 0 0 1\n | 6 | extrinsic_depth.txt & not applied
"#;

#[test]
fn faults_are_warned_of_where_they_are_few_and_refused_by_the_file_otherwise() {
    let lost = "-inf -inf -inf -inf\\n".repeat(4);
    check_changes(scan, change_files, &CHANGES.replace("INF", &lost));
}

#[test]
fn the_selected_frames_name_their_intrinsics_otherwise() {
    let (_root, folder) = scan();
    for kind in ["color", "depth"] {
        let file = folder.join(format!("intrinsic/intrinsic_{kind}.txt"));
        fs::rename(file, folder.join(format!("intrinsics_{kind}.txt"))).unwrap();
    }
    change_files(&folder, "remove intrinsic");
    let scene = opened(&folder);
    assert_eq!(scene.frames[0].camera.fx, 20.0);
    assert!(scene.notes.is_empty());
    change_files(&folder, "remove intrinsics_color.txt");
    assert_refused(
        &folder,
        &["intrinsics.txt", "intrinsic/intrinsic_color.txt", "fx fy cx cy"],
    );
    change_files(&folder, "intrinsics.txt = 21 22 12 8 24 16");
    assert_eq!(opened(&folder).frames[0].camera.fy, 22.0);
}

#[test]
fn intrinsics_of_nine_numbers_are_scaled_with_the_images_but_not_for_cropped_ones() {
    let (_root, folder) = scan();
    let steps = "intrinsic/intrinsic_color.txt = 1170 0 646.3 0 1170 489.9 0 0 1";
    change_files(&folder, steps);
    let calibration = Calibration::read(&folder, "color", COLOR_SIZE).unwrap().unwrap();
    let own = calibration.camera(1296, 968).unwrap();
    assert_eq!((own.fx, own.cx, own.cy), (1170.0, 646.8, 490.4));
    let small = calibration.camera(640, 480).unwrap();
    assert!((small.fx - 1170.0 * 640.0 / 1296.0).abs() < 1e-3);
    assert!((small.fy - 1170.0 * 480.0 / 968.0).abs() < 1e-3);
    assert!((small.cy - 490.4 * 480.0 / 968.0).abs() < 1e-3);
    // Where both readings are about in the middle, the one that is nearer.
    let resized = calibration.camera(1024, 768).unwrap();
    assert!((resized.fx - 1170.0 * 1024.0 / 1296.0).abs() < 1e-3);
    let reason = calibration.camera(968, 968).unwrap_err().to_string();
    assert!(reason.contains("646.3") && reason.contains("968x968"), "{reason}");
}
