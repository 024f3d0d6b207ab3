//! What becomes of poses that are right, of such that are off, and of captures that say nothing about them.

use std::sync::LazyLock;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{Quat, Vec3};
use rand::rngs::SmallRng;
use rand::{Rng, SeedableRng};

use super::*;
use crate::scene::SparsePoint;
use crate::scene::reprojection::tests::room_without_depth;
use crate::scene::testing::{on_threads, wall};

/// The demo room without depth.
static ROOM: LazyLock<Scene> = LazyLock::new(room_without_depth);

/// The room with every camera turned and shifted by up to so many degrees and metres about and along each axis.
fn shaken(degrees: f32, metres: f32) -> Scene {
    let mut rng = SmallRng::seed_from_u64(3);
    let mut vector = |most: f32| Vec3::from_array(std::array::from_fn(|_| rng.random_range(-most..most)));
    let mut scene = ROOM.clone();
    for frame in &mut scene.frames {
        let turn = Quat::from_scaled_axis(vector(degrees.to_radians()));
        let pose = &mut frame.camera_to_world;
        pose.translation += glam::Vec3A::from(vector(metres));
        pose.matrix3 = glam::Mat3A::from_quat(turn) * pose.matrix3;
    }
    scene
}

fn refined(scene: &Scene) -> Result<RefinedPoses, Unrefined> {
    refine(scene, &|| true)
}

#[test]
fn poses_that_are_off_come_nearer_to_the_right_ones() {
    let mut scene = shaken(0.6, 0.02);
    // Median turn from where the room's own poses are, in radians, and shift, in metres.
    let off = |scene: &Scene| {
        let pairs = || scene.frames.iter().zip(&ROOM.frames);
        let turns = pairs().map(|(frame, own)| {
            let turn = frame.camera_to_world.matrix3 * own.camera_to_world.matrix3.transpose();
            f64::from(Quat::from_mat3a(&turn).to_scaled_axis().length())
        });
        let shifts = pairs().map(|(frame, own)| f64::from(frame.center().distance(own.center())));
        [median(turns).unwrap(), median(shifts).unwrap()]
    };
    let [turned, shifted] = off(&scene);
    let found = refined(&scene).unwrap();
    let summary = found.summary;
    assert!(summary.error_px < 0.3 * summary.error_before_px, "{summary:?}");
    assert!(summary.moved_px > 1.0, "{summary:?}");
    assert!(summary.most_moved_px < 15.0, "{summary:?}");
    assert!((0.005..0.04).contains(&summary.moved_m), "{summary:?}");
    found.apply(&mut scene);
    assert_eq!(scene.pose_refinement, Some(summary));
    let [turned_now, shifted_now] = off(&scene);
    assert!(turned_now < 0.6 * turned, "{turned_now} {turned}");
    assert!(shifted_now < 0.7 * shifted, "{shifted_now} {shifted}");
    // What is left is not worth another time.
    assert!(matches!(refined(&scene), Err(Unrefined::NoGain { .. })));
}

#[test]
fn poses_that_are_right_are_used_as_they_are() {
    let Err(Unrefined::NoGain {
        error_before_px,
        error_px,
    }) = refined(&ROOM)
    else {
        panic!("moved");
    };
    assert!(error_before_px < 0.6 && error_px < 1.1 * error_before_px);
}

#[test]
fn frames_between_keyframes_move_along() {
    let turned = |angle: f64, at: f64| {
        DAffine3::from_rotation_translation(
            glam::DQuat::from_rotation_y(angle),
            glam::DVec3::new(at, 0.0, 0.0),
        )
    };
    let moved = moved_like(&turned(0.1, 1.0), &turned(0.3, 1.5), &turned(0.4, 2.0));
    assert!(moved.abs_diff_eq(turned(0.6, 2.5), 1e-12));
}

#[test]
fn what_says_nothing_about_poses_leaves_them() {
    assert_eq!(refined(&wall(5, 64, 48)).unwrap_err(), Unrefined::TooFewCorners);
    let mut in_one_place = ROOM.clone();
    for frame in &mut in_one_place.frames {
        frame.camera_to_world.translation = glam::Vec3A::ZERO;
    }
    assert_eq!(refined(&in_one_place).unwrap_err(), Unrefined::TooFewCorners);
    for frames in [0, 1, 2] {
        let mut few = ROOM.clone();
        few.frames.truncate(frames);
        assert_eq!(refined(&few).unwrap_err(), Unrefined::TooFewCorners);
    }
    let mut with_points = ROOM.clone();
    with_points.frames[7].points.push(SparsePoint {
        pixel: 0,
        length: 2.0,
        error: 0.1,
        by_stereo: false,
    });
    assert_eq!(refined(&with_points).unwrap_err(), Unrefined::StructureFromMotion);
    // It stops at the first image.
    let asked = AtomicUsize::new(0);
    let stop = || {
        asked.fetch_add(1, Ordering::Relaxed);
        false
    };
    let stopped = on_threads(1, || refine(&ROOM, &stop)).unwrap_err();
    assert_eq!((stopped, asked.into_inner()), (Unrefined::Stopped, 1));
}

#[test]
fn the_result_does_not_depend_on_the_number_of_threads() {
    let scene = shaken(0.6, 0.02);
    let on = |threads: usize| {
        let found = on_threads(threads, || refined(&scene)).unwrap();
        (found.camera_to_world, found.summary)
    };
    assert_eq!(on(1), on(3));
}
