//! What holds for rooms in which such methods fail.

use inplace_core::scene::reprojection::Agreement;

use super::HardRoom::{Glass, Mirror, Plain, SameClassApart, SameColour, Thin};
use super::*;

const ROOMS: [HardRoom; 6] = [Thin, Plain, SameColour, SameClassApart, Mirror, Glass];

/// One round, small.
const SHOT: Shot = Shot::new(60, [160, 120]);

#[test]
fn frames_agree_on_depth_in_every_room() {
    for room in ROOMS {
        let agreement = Agreement::of(&room.scene(&SHOT));
        let depth = agreement.depth.unwrap();
        let agrees = depth.pixels > 300 && depth.median_relative_difference < 0.01;
        assert!(agrees, "{room:?}: {depth:?}");
    }
}

#[test]
fn every_class_of_a_room_is_seen_in_training_and_in_test_frames() {
    for room in ROOMS {
        let truth = room.ground_truth(&SHOT);
        for class in room.classes() {
            for held_out in [0, 1] {
                let shows =
                    |labels: &&Vec<ClassId>| labels.iter().filter(|&&own| own == class.id).count() >= 10;
                let seen = truth.iter().skip(held_out).step_by(2).filter(shows).count();
                assert!(seen >= 2, "{room:?} {}: {seen}", class.name);
            }
        }
    }
}

#[test]
fn an_annotator_clicks_two_of_eight_blocks() {
    let room = SameClassApart;
    let (truth, clickable) = (room.ground_truth(&SHOT), room.clickable(&SHOT));
    let pairs = || truth.iter().flatten().zip(clickable.iter().flatten());
    assert!(pairs().all(|(own, clicked)| own == clicked || (*own == FIRST && *clicked == VOID)));
    let blocks = pairs().filter(|(own, _)| **own == FIRST).count();
    let clicked = pairs().filter(|(_, clicked)| **clicked == FIRST).count();
    assert!(0 < clicked && 2 * clicked < blocks, "{clicked} of {blocks}");
}

#[test]
fn a_border_that_cannot_be_seen_is_void() {
    let truth = SameColour.ground_truth(&SHOT);
    for labels in &truth {
        for row in labels.chunks(SHOT.width as usize) {
            let touch = |pair: &[ClassId]| pair.contains(&FIRST) && pair.contains(&OWN[1]);
            assert!(!row.windows(2).any(touch));
        }
    }
    assert!(truth.iter().flatten().any(|&class| class == VOID));
}
