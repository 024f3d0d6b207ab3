//! What holds for rooms in which such methods fail.

use super::super::tests::SeenTwice;
use super::*;

/// One round, small.
const SHOT: Shot = Shot {
    rooms: 1,
    frames: 60,
    width: 160,
    height: 120,
};

#[test]
fn frames_agree_on_depth_and_class_in_every_room() {
    for room in HardRoom::ALL {
        let (scene, truth) = (room.scene(&SHOT), room.ground_truth(&SHOT));
        // A rod is a pixel wide, and may be missed by half of one.
        let least = if room == HardRoom::Thin { 0.9 } else { 0.95 };
        for (a, b) in [(0, 1), (9, 10), (16, 15), (25, 26)] {
            let seen = SeenTwice::of((&scene.frames[a], &truth[a]), (&scene.frames[b], &truth[b]));
            assert!(seen.shared > 300, "{room:?} {a} {b}: {seen:?}");
            assert!(seen.depth() > least, "{room:?} {a} {b}: {seen:?}");
            assert!(seen.class() > 0.97, "{room:?} {a} {b}: {seen:?}");
        }
    }
}

#[test]
fn every_class_of_a_room_is_seen_in_training_and_in_test_frames() {
    for room in HardRoom::ALL {
        let truth = room.ground_truth(&SHOT);
        for class in room.classes() {
            for held_out in [0, 1] {
                let frames = truth.iter().skip(held_out).step_by(2);
                let seen = frames
                    .filter(|labels| labels.iter().filter(|&&own| own == class.id).count() >= 10)
                    .count();
                assert!(seen >= 2, "{room:?} {}: {seen}", class.name);
            }
        }
    }
}

#[test]
fn depth_goes_on_beyond_glass_and_behind_a_mirror() {
    for (room, class) in [(HardRoom::Mirror, "mirror"), (HardRoom::Glass, "glass")] {
        let id = room.classes().iter().find(|own| own.name == class).unwrap().id;
        let (house, scene) = (room.house(true), room.scene(&SHOT));
        let mut pixels = 0;
        for (index, frame) in scene.frames.iter().enumerate() {
            let view = SHOT.view(&house, index);
            for (pixel, class) in view.labels().into_iter().enumerate() {
                let (length, surface) = (
                    frame.depth().unwrap().ray_length(pixel).unwrap(),
                    view.hit(pixel).distance,
                );
                if class != id {
                    assert!((length - surface).abs() < 0.01, "{room:?} {length} {surface}");
                    continue;
                }
                pixels += 1;
                assert!(length > surface, "{room:?} {length} {surface}");
                if room == HardRoom::Mirror {
                    // The room behind the wall is that in front of it, mirrored at x = 2 cm.
                    let point = frame.center() + length * frame.ray_direction(pixel);
                    assert!((-4.97..0.05).contains(&point.x), "{point}");
                }
            }
        }
        assert!(pixels > 3000, "{room:?}: {pixels}");
    }
}

#[test]
fn an_annotator_clicks_two_of_eight_blocks() {
    let (truth, clickable) = (
        HardRoom::SameClassApart.ground_truth(&SHOT),
        HardRoom::SameClassApart.clickable(&SHOT),
    );
    let pairs = || truth.iter().flatten().zip(clickable.iter().flatten());
    assert!(pairs().all(|(own, clicked)| own == clicked || (*own == FIRST && *clicked == VOID)));
    let blocks = pairs().filter(|(own, _)| **own == FIRST).count();
    let clicked = pairs().filter(|(_, clicked)| **clicked == FIRST).count();
    assert!(0 < clicked && 2 * clicked < blocks, "{clicked} of {blocks}");
}

#[test]
fn a_border_that_cannot_be_seen_is_void() {
    let truth = HardRoom::SameColour.ground_truth(&SHOT);
    for labels in &truth {
        for row in labels.chunks(SHOT.width as usize) {
            let touch = |pair: &[ClassId]| pair.contains(&FIRST) && pair.contains(&SECOND);
            assert!(!row.windows(2).any(touch));
        }
    }
    assert!(truth.iter().flatten().any(|&class| class == VOID));
}
