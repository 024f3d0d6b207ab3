//! What holds for captures that are right, and for those that are read the wrong way round.

use std::sync::LazyLock;

use glam::{Affine3A, Mat3A, Vec3A};

use super::*;
use crate::scene::testing::{on_threads, wall, without_depth, z_depth};
use crate::scene::{ColorImage, DepthMap, demo};

/// The demo room with depth.
static ROOM: LazyLock<Scene> = LazyLock::new(|| {
    let shot = demo::Shot::new(40, [320, 240]);
    shot.scene(&|_, _| {})
});

pub(super) fn room_without_depth() -> Scene {
    without_depth(ROOM.clone())
}

/// The scene with every pose changed.
fn posed(mut scene: Scene, change: impl Fn(&Affine3A) -> Affine3A) -> Scene {
    for frame in &mut scene.frames {
        frame.camera_to_world = change(&frame.camera_to_world);
    }
    scene
}

fn with_opposite_axes(pose: &Affine3A) -> Affine3A {
    *pose * Affine3A::from_mat3(glam::Mat3::from_diagonal(glam::Vec3::new(1.0, -1.0, -1.0)))
}

fn transposed(pose: &Affine3A) -> Affine3A {
    Affine3A {
        matrix3: pose.matrix3.transpose(),
        translation: pose.translation,
    }
}

/// The scene is suspicious, fits badly, and the one warning says all of `parts`.
#[track_caller]
fn assert_warned(scene: &Scene, parts: &[&str]) {
    let found = Agreement::of(scene);
    let corners = found.corners.unwrap();
    assert!(corners.errors.is_suspicious(), "{corners:?}");
    assert!(corners.within_2_px < 0.4, "{corners:?}");
    assert_eq!(found.warnings.len(), 1);
    let said = &found.warnings[0];
    for part in parts {
        assert!(said.contains(part), "\"{part}\" is not in: {said}");
    }
}

#[test]
fn a_capture_that_is_right_agrees_within_a_pixel_and_not_by_chance() {
    for (scene, lifted) in [(ROOM.clone(), true), (room_without_depth(), false)] {
        let found = Agreement::of(&scene);
        let corners = found.corners.unwrap();
        assert_eq!(corners.lifted_by_depth, lifted);
        assert!(corners.errors.median_px < 1.0, "{corners:?}");
        assert!(corners.within_2_px > 0.7, "{corners:?}");
        assert!(corners.within_2_px_by_chance < 0.3, "{corners:?}");
        assert!(found.warnings.is_empty(), "{:?}", found.warnings);
        assert_eq!(found.depth.is_some(), lifted);
    }
    let depth = Agreement::of(&ROOM).depth.unwrap();
    assert!(depth.median_relative_difference < 0.01, "{depth:?}");
    let by_chance = depth.median_colour_difference_by_chance.unwrap();
    assert!(
        3.0 * depth.median_colour_difference.unwrap() < by_chance,
        "{depth:?}"
    );
}

#[test]
fn a_wrong_convention_is_noticed_and_named() {
    for scene in [ROOM.clone(), room_without_depth()] {
        let scene = || scene.clone();
        assert_warned(&posed(scene(), with_opposite_axes), &["OpenGL", "the capture"]);
        let inverted = posed(scene(), Affine3A::inverse);
        assert_warned(&inverted, &["poses were inverted", "world-to-camera"]);
        let both = posed(scene(), |pose| with_opposite_axes(pose).inverse());
        assert_warned(&both, &["poses were inverted and", "OpenGL"]);
        assert_warned(&posed(scene(), transposed), &["rotations were transposed"]);
    }
}

#[test]
fn poses_that_have_nothing_to_do_with_the_images_fit_no_better_than_chance() {
    let mut scene = posed(ROOM.clone(), |pose| {
        let [x, y, _] = pose.translation.to_array();
        Affine3A {
            matrix3: Mat3A::IDENTITY,
            translation: Vec3A::new(y, 0.0, x),
        }
    });
    scene.format = crate::scene::tum::FORMAT.name;
    assert_warned(&scene, &["other frames' poses fit as well", "groundtruth.txt"]);
}

#[test]
fn the_scale_of_intrinsics_and_of_depth_is_named() {
    let mut scene = ROOM.clone();
    for frame in &mut scene.frames {
        let pixels = 0..frame.camera.pixels();
        let z: Vec<f32> = pixels.map(|index| z_depth(frame, index).unwrap_or(0.0)).collect();
        (frame.camera.fx, frame.camera.fy) = (2.0 * frame.camera.fx, 2.0 * frame.camera.fy);
        frame.set_depth(Some(DepthMap::from_z_depths(&frame.camera, z)));
    }
    assert_warned(&scene, &["focal lengths were about 0.5 times as long"]);
    let mut scene = ROOM.clone();
    for frame in &mut scene.frames {
        let depth = frame.depth().unwrap();
        let lengths: Vec<f32> = (0..depth.len())
            .map(|index| 5.0 * depth.ray_length(index).unwrap_or(0.0))
            .collect();
        frame.set_depth(Some(DepthMap::from_ray_lengths(frame.camera.width, &lengths)));
    }
    assert_warned(&scene, &["depth was 0.2 times as far"]);
}

#[test]
fn the_result_does_not_depend_on_the_number_of_threads() {
    let on = |threads| on_threads(threads, || Agreement::of(&ROOM));
    assert_eq!(on(1), on(3));
}

#[test]
fn plain_walls_and_single_frames_say_nothing() {
    let found = Agreement::of(&wall(3, 64, 48));
    assert_eq!(found.corners, None);
    assert!(found.depth.unwrap().median_relative_difference < 0.01);
    let mut alone = ROOM.clone();
    alone.frames.truncate(1);
    assert_eq!(Agreement::of(&alone), Agreement::default());
}

#[test]
fn a_shifted_image_is_found_again_between_the_pixels() {
    // Smooth noise: nothing in it comes twice.
    let lattice = |x: i32, y: i32| {
        let mixed = (x.wrapping_mul(374_761_393) ^ y.wrapping_mul(668_265_263)).wrapping_mul(1_274_126_177);
        (mixed as u32 >> 24) as f32
    };
    let noise = |x: f32, y: f32| {
        let (column, row) = ((x / 6.0).floor(), (y / 6.0).floor());
        let ease = |v: f32| v * v * (3.0 - 2.0 * v);
        let (u, v) = (ease(x / 6.0 - column), ease(y / 6.0 - row));
        let line = |row: i32| {
            let left = lattice(column as i32, row);
            left + u * (lattice(column as i32 + 1, row) - left)
        };
        let upper = line(row as i32);
        upper + v * (line(row as i32 + 1) - upper)
    };
    let frame = |shift: [f32; 2]| {
        let mut frame = wall(1, 160, 120).frames.remove(0);
        let rgb = (0..160 * 120).flat_map(|index| {
            let (x, y) = ((index % 160) as f32 - shift[0], (index / 160) as f32 - shift[1]);
            [noise(x, y) as u8; 3]
        });
        frame.set_color(ColorImage::new(160, 120, rgb.collect()).unwrap());
        Features::of(&frame, LONGEST)
    };
    let matches = corners::matches(&frame([0.0, 0.0]), &frame([3.3, -1.6]), |_, _| true);
    assert!(matches.len() > 10, "{}", matches.len());
    let apart = |found: &corners::Match| (found.second - found.first).distance(glam::DVec2::new(3.3, -1.6));
    let errors = PixelErrors::of(matches.iter().map(apart).collect()).unwrap();
    assert!(errors.median_px < 0.15 && errors.p90_px < 0.4, "{errors:?}");
}

#[test]
fn images_of_a_single_line_have_no_corners() {
    // Reduced, nothing of them is left.
    for [width, height] in [[2 * LONGEST as u32, 1], [1, 2 * LONGEST as u32], [40, 1], [1, 1]] {
        let frame = wall(1, width, height).frames.remove(0);
        assert!(
            Features::of(&frame, LONGEST).places().is_empty(),
            "{width} x {height}"
        );
    }
}

#[test]
fn the_share_of_sorted_values_is_counted_from_below() {
    let errors = PixelErrors::of((1..=10).rev().map(f64::from).collect()).unwrap();
    assert_eq!((errors.median_px, errors.p90_px, errors.count), (6.0, 10.0, 10));
    assert_eq!(PixelErrors::of(Vec::new()), None);
}

#[test]
fn a_frame_that_many_choose_is_in_few_pairs() {
    // The camera rests for most of the capture, then walks.
    let mut scene = wall(80, 16, 12);
    for (number, frame) in scene.frames.iter_mut().enumerate() {
        let along = match number {
            0..60 => 1e-4 * number as f32,
            _ => 0.02 * (number - 59) as f32,
        };
        frame.camera_to_world.translation = Vec3A::new(along, 0.0, 0.0);
    }
    let frames: Vec<usize> = (0..80).collect();
    let pairs = pairs::partners(&scene, &frames, 4);
    let count = |frame: usize| pairs.iter().filter(|pair| pair.contains(&frame)).count();
    let counts: Vec<usize> = (0..80).map(count).collect();
    assert_eq!(counts.iter().max(), Some(&12), "{counts:?}");
    assert!(pairs.is_sorted());
}
