use glam::{Affine3A, Quat, Vec3};

use super::filling::{self, Seed, fill};
use super::view::{View, Warp};
use super::*;
use crate::scene::DepthMap;
use crate::scene::testing::{frame, on_threads, scene};

const SIZE: [u32; 2] = [96, 72];

/// Brightness of a place on a surface with a pattern that repeats nowhere.
fn pattern(x: f32, y: f32, phase: f32) -> u8 {
    let waves = [
        (23.0, 11.0, 45.0),
        (-17.0, 37.0, 35.0),
        (51.0, 29.0, 25.0),
        (7.0, -5.0, 20.0),
    ];
    let wave = |(a, b, height): (f32, f32, f32)| height * (a * x + b * y + phase).sin();
    (127.0 + waves.map(wave).iter().sum::<f32>()) as u8
}

/// World z and brightness of what a ray meets: a wall two metres away, or where there is one, a board at 1.25 m.
fn surface(center: Vec3, direction: Vec3, board: bool) -> (f32, u8) {
    let at = |z: f32| center + direction * (z - center.z) / direction.z;
    let near = at(1.25);
    if board && near.x.abs() < 0.35 && near.y.abs() < 0.25 {
        return (1.25, pattern(near.x, near.y, 2.0));
    }
    let far = at(2.0);
    (2.0, pattern(far.x, far.y, 0.0))
}

/// Seven cameras in an arc, and the z-depths that they see of a wall, and of a board before it where there is one.
pub(crate) fn capture(board: bool) -> (Scene, Vec<Vec<f32>>) {
    let camera = Camera::with_horizontal_fov(SIZE[0], SIZE[1], 70.0);
    let view = |number: i32| {
        let center = Vec3::new(0.12 * number as f32, 0.02 * (number * number) as f32, 0.0);
        let turn = Quat::from_rotation_y(-0.05 * number as f32);
        let mut depths = Vec::new();
        let mut rgb = Vec::new();
        for index in 0..camera.pixels() {
            let local = camera.direction_at(index);
            let (z, grey) = surface(center, turn * local, board);
            let place = center + turn * local * ((z - center.z) / (turn * local).z);
            depths.push((turn.inverse() * (place - center)).z);
            rgb.extend([grey; 3]);
        }
        let mut frame = frame(&format!("rgb_{number}"), camera, rgb, None);
        frame.camera_to_world = Affine3A::from_rotation_translation(turn, center);
        (frame, depths)
    };
    let (frames, depths) = (-3..=3).map(view).unzip();
    (scene(frames), depths)
}

fn depth(scene: &Scene) -> Vec<StereoDepth> {
    estimate(scene, None, &|_| true).unwrap()
}

/// Relative errors of all pixels that have depth and are wanted.
fn errors(
    scene: &Scene,
    maps: &[StereoDepth],
    truth: &[Vec<f32>],
    wanted: impl Fn(&StereoDepth, usize) -> bool,
) -> Vec<f32> {
    let of_map = |map: &StereoDepth| {
        let camera = &scene.frames[map.frame].camera;
        let error = |index: usize| {
            let truth = truth[map.frame][camera.middle_of_reduced(map.stride, index)];
            Some((map.z_depth(index)? / truth - 1.0).abs())
        };
        let pixels = (0..map.camera.pixels()).filter(|&index| wanted(map, index));
        pixels.filter_map(error).collect::<Vec<f32>>()
    };
    maps.iter().flat_map(of_map).collect()
}

fn share(values: &[f32], most: f32) -> f32 {
    values.iter().filter(|&&value| value <= most).count() as f32 / values.len() as f32
}

#[test]
fn a_wall_is_found_at_its_depth_in_images_of_half_the_size() {
    let (scene, truth) = capture(false);
    let maps = depth(&scene);
    let errors = errors(&scene, &maps, &truth, |_, _| true);
    assert_eq!(errors.len(), 7 * scene.frames[0].camera.pixels() / 4);
    assert!(share(&errors, 0.01) > 0.9, "{}", share(&errors, 0.01));
    let half = maps[3].camera;
    assert_eq!([half.width, half.height], SIZE.map(|side| side / 2));
}

#[test]
fn a_camera_that_is_lost_far_away_changes_nothing_for_the_others() {
    let (mut scene, mut truth) = capture(false);
    for _ in 0..2 {
        scene.frames.extend_from_within(..);
        truth.extend_from_within(..);
    }
    scene.frames[27].camera_to_world.translation.x += 500.0;
    let maps = depth(&scene);
    let errors = errors(&scene, &maps[..27], &truth, |_, _| true);
    assert_eq!(errors.len(), 27 * scene.frames[0].camera.pixels() / 4);
    assert!(share(&errors, 0.02) > 0.9, "{}", share(&errors, 0.02));
}

#[test]
fn depth_changes_where_a_thing_ends() {
    let (scene, truth) = capture(true);
    let maps = depth(&scene);
    let confident = errors(&scene, &maps, &truth, StereoDepth::is_confident);
    let all = errors(&scene, &maps, &truth, |_, _| true);
    assert!(share(&confident, 0.03) > 0.97, "{}", share(&confident, 0.03));
    assert!(share(&all, 0.03) > 0.93, "{}", share(&all, 0.03));
}

#[test]
fn measured_depth_is_not_looked_at_and_threads_do_not_matter() {
    let (mut scene, truth) = capture(true);
    let steps = |scene: &Scene, threads: usize| {
        let maps = on_threads(threads, || depth(scene)).into_iter();
        maps.map(|map| (map.steps, map.is_confident)).collect::<Vec<_>>()
    };
    let one = steps(&scene, 1);
    for (frame, truth) in scene.frames.iter_mut().zip(truth) {
        let wrong = truth.iter().map(|z| 0.5 * z).collect();
        frame.set_depth(Some(DepthMap::from_z_depths(&frame.camera, wrong)));
    }
    assert!(one == steps(&scene, 3));
}

#[test]
fn without_parallax_or_when_told_to_it_stops() {
    let (mut scene, _) = capture(false);
    // Either at once, while images are read, or after a part of the work.
    for goes_on in [|share: f32| share > 0.0, |share: f32| share == 0.0] {
        let stopped = estimate(&scene, None, &goes_on);
        assert!(matches!(stopped, Err(StereoError::Stopped)), "{stopped:?}");
    }
    for frame in &mut scene.frames {
        frame.camera_to_world.translation = Vec3::ONE.into();
    }
    let error = estimate(&scene, None, &|_| true).unwrap_err();
    assert!(matches!(error, StereoError::NoParallax), "{error}");
}

#[test]
fn planes_continue_up_to_an_edge_of_the_image() {
    // Dark on the left and bright on the right, each a plane of its own, known along two columns of each.
    let camera = Camera::with_horizontal_fov(40, 30, 60.0);
    let rgb = (0..camera.pixels())
        .flat_map(|index| [if index % 40 < 20 { 30 } else { 220 }; 3])
        .collect();
    let frame = frame("rgb_0", camera, rgb, None);
    let view = View::new(&frame, &frame.color(), 1);
    let plane = |index: usize| {
        let (x, y) = ((index % 40) as f32, (index / 40) as f32);
        if x < 20.0 {
            0.5 + 0.004 * x + 0.002 * y
        } else {
            1.0 - 0.003 * y
        }
    };
    let seed = |index: usize| Seed {
        weight: f32::from([3, 15, 24, 36].contains(&(index % 40))),
        inverse: plane(index),
    };
    let seeds: Vec<Seed> = (0..camera.pixels()).map(seed).collect();
    let filled = fill(&view, &seeds, 1e-3, &mut filling::Workspace::default());
    let pairs = filled.iter().enumerate();
    let off = pairs.map(|(index, &own)| (own / plane(index) - 1.0).abs());
    let worst = off.fold(0.0, f32::max);
    assert!(worst < 0.03, "{worst}");
}

#[test]
fn a_pixel_lies_in_another_view_where_its_place_projects_to() {
    let (scene, _) = capture(false);
    let [from, to] = [0, 5].map(|number| View::new(&scene.frames[number], &scene.frames[number].color(), 1));
    let place = from.place(30.5, 40.5, 0.5);
    let (x, y, inverse) = Warp::new(&from, &to).apply((30.5, 40.5), 0.5).unwrap();
    let frame = &scene.frames[5];
    let (expected_x, expected_y, length) = frame.project(place).unwrap();
    assert!((x - expected_x).abs() < 1e-3 && (y - expected_y).abs() < 1e-3);
    assert!((1.0 / inverse - to.local(place).z).abs() < 1e-4);
    assert!((length - place.distance(frame.center())).abs() < 1e-4);
    assert_eq!(frame.project(2.0 * frame.center() - place), None, "behind it");
}
