//! What holds for the demo room.

use std::sync::LazyLock;

use super::*;

static SCENE: LazyLock<Scene> = LazyLock::new(|| scene(&|_, _| {}));
static TRUTH: LazyLock<Vec<Vec<ClassId>>> = LazyLock::new(ground_truth);

#[test]
fn every_class_is_well_visible_in_at_least_three_training_and_three_test_frames() {
    let held_out = held_out();
    assert!(classes().len() >= 14);
    for class in classes() {
        let seen = |test: bool| {
            let frames = TRUTH.iter().enumerate();
            frames
                .filter(|(frame, _)| held_out.contains(frame) == test)
                .filter(|(_, labels)| labels.iter().filter(|&&id| id == class.id).count() >= 100)
                .count()
        };
        assert!(seen(true) >= 3 && seen(false) >= 3, "{}", class.name);
    }
}

#[test]
fn every_pixel_has_a_class_and_a_depth() {
    let ids: Vec<ClassId> = classes().iter().map(|class| class.id).collect();
    assert!(TRUTH.iter().flatten().all(|id| ids.contains(id)));
    assert_eq!(SCENE.frames.len(), TRUTH.len());
    for frame in &SCENE.frames {
        assert_eq!(frame.depth().unwrap().coverage(), 1.0);
    }
}

#[test]
fn cameras_keep_their_distance_from_everything() {
    for frame in &SCENE.frames {
        let depth = frame.depth().unwrap();
        let nearest = (0..depth.len())
            .filter_map(|i| depth.ray_length(i))
            .fold(f32::INFINITY, f32::min);
        assert!(nearest > 0.25, "{}: {nearest}", frame.stem);
    }
    let room = room::room();
    let coarse = Shot {
        frames: 1000,
        width: 16,
        height: 12,
    };
    for frame in 0..coarse.frames {
        let eye = path::pose(frame).translation.as_vec3a();
        assert!(!room.caster.buried(eye, usize::MAX), "frame {frame}");
        let view = coarse.view(&room, frame);
        let nearest = (0..view.camera.pixels())
            .map(|index| view.hit(index).distance)
            .fold(f32::INFINITY, f32::min);
        assert!(nearest > 0.25, "frame {frame}: {nearest}");
    }
}

#[test]
fn a_larger_shot_shows_the_same_places_and_is_clicked_there() {
    let large = Shot {
        frames: 20,
        width: 640,
        height: 480,
    };
    let clicks = large.clicks();
    assert!(clicks.strokes.len() > 5);
    let room = room::room();
    for stroke in clicks.strokes.values() {
        assert!(stroke.frame < large.frames);
        let [x, y] = stroke.first_point().unwrap();
        let hit = large
            .view(&room, stroke.frame)
            .hit((y * large.width + x) as usize);
        assert_eq!(room.caster.solids[hit.solid].class, stroke.class);
    }
    assert_eq!(Shot::default().clicks(), super::clicks());
}

#[test]
fn neighbouring_frames_see_the_same_surface() {
    for (a, b) in [(0, 2), (14, 17), (31, 30), (58, 3)] {
        let (from, to) = (&SCENE.frames[a], &SCENE.frames[b]);
        let (mut shared, mut agreeing) = (0, 0);
        for index in (0..from.camera.pixels()).step_by(7) {
            let length = from.depth().unwrap().ray_length(index).unwrap();
            let point = from.center() + length * from.ray_direction(index);
            let Some((x, y, length)) = to.project(point) else {
                continue;
            };
            let other = y as usize * to.camera.width as usize + x as usize;
            let seen = to.depth().unwrap().ray_length(other).unwrap();
            // Half a pixel of a slanted surface, at most.
            let tolerance = 0.03 * length;
            if seen < length - tolerance {
                continue;
            }
            shared += 1;
            agreeing += usize::from((seen - length).abs() < tolerance);
        }
        assert!(shared > 2000, "{a} {b}: {shared}");
        assert!(
            agreeing as f32 > 0.97 * shared as f32,
            "{a} {b}: {agreeing} of {shared}"
        );
    }
}

#[test]
fn every_rendering_is_the_same() {
    let room = room::room();
    let light = LightMap::new(&room.caster, &room.panes, &room.bulbs);
    for index in [7, 40] {
        let again = Shot::default().pixels(&room, &light, index);
        assert_eq!(again, SCENE.frames[index].pixels().unwrap());
    }
    assert_eq!(clicks(), clicks());
}

#[test]
fn clicks_tell_the_truth_sparingly_and_only_on_training_frames() {
    let clicks = clicks();
    assert_eq!(clicks.classes, classes());
    for class in classes() {
        let own: Vec<_> = clicks
            .strokes
            .values()
            .filter(|stroke| stroke.class == class.id)
            .collect();
        assert!((1..=3).contains(&own.len()), "{}: {}", class.name, own.len());
        for stroke in own {
            let [x, y] = stroke.first_point().unwrap();
            assert_eq!(
                (stroke.radius, stroke.lines.len(), stroke.lines[0].len()),
                (0, 1, 1)
            );
            assert!(!held_out().contains(&stroke.frame));
            assert_eq!(
                TRUTH[stroke.frame][(y * Shot::default().width + x) as usize],
                class.id
            );
        }
    }
}

#[test]
fn frames_are_neither_dark_nor_washed_out() {
    for frame in &SCENE.frames {
        let color = frame.color();
        let bytes = color.bytes();
        let mean = bytes.iter().map(|&v| f32::from(v)).sum::<f32>() / bytes.len() as f32;
        assert!((80.0..200.0).contains(&mean), "{}: {mean}", frame.stem);
    }
}
