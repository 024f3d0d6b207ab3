use std::sync::atomic::AtomicBool;

use super::*;
use crate::labels::Stroke;
use crate::labels::testing::{Click, clicked};
use crate::scene::Camera;
use crate::scene::testing::wall;
use crate::semantics::CERTAIN;
use crate::semantics::testing::propagated;

/// A click on each half of a wall.
const BOTH: [Click; 2] = [(0, 1, [10, 30]), (1, 2, [70, 30])];

/// A wall seen from so many frames, with propagated clicks of two classes.
fn labelled(frames: usize, clicks: &[Click]) -> (Scene, LabelPropagation) {
    let scene = wall(frames, 80, 60);
    let propagation = propagated(&scene, clicked(&["left", "right"], clicks).labels());
    (scene, propagation)
}

fn suggestions(clicks: &[Click]) -> (LabelPropagation, Vec<Suggestion>) {
    let (scene, propagation) = labelled(2, clicks);
    let suggestions = suggest(&scene, &propagation, None, &AtomicBool::default()).unwrap();
    (propagation, suggestions)
}

fn node_of(propagation: &LabelPropagation, suggestion: &Suggestion) -> u32 {
    let [x, y] = suggestion.pixel;
    let shown = &propagation.surface().pixels[suggestion.frame];
    shown.node((y * 80 + x) as usize).unwrap()
}

#[test]
fn the_first_suggestion_is_on_the_half_without_a_label() {
    let (_, found) = suggestions(&BOTH[..1]);
    let best = &found[0];
    let camera = Camera::with_horizontal_fov(80, 60, 90.0);
    let shift = if best.frame == 0 { -0.2 } else { 0.2 };
    let x = shift + 2.0 * camera.pixel_direction(best.pixel[0], best.pixel[1]).x;
    assert!(x > 0.0, "{best:?}");
}

#[test]
fn places_are_judged_as_if_no_class_were_part_of_the_room() {
    let scene = wall(2, 80, 60);
    let on_one_half = [(0, 1, [10, 30]), (0, 2, [20, 10])];
    let [of_room, other] = ["wall", "grass"].map(|name| {
        let propagation = propagated(&scene, clicked(&[name, "chair"], &on_one_half).labels());
        let found = suggest(&scene, &propagation, None, &AtomicBool::default()).unwrap();
        let places = found.into_iter().map(|place| (place.frame, place.pixel));
        (propagation, places.collect::<Vec<_>>())
    });
    assert!(of_room.0.posterior() != other.0.posterior());
    assert_eq!(of_room.1, other.1);
}

#[test]
fn a_likely_thing_comes_with_the_object_of_its_nearest_label() {
    let scene = wall(2, 80, 60);
    let mut history = clicked(&["chair", "table"], &BOTH[1..]);
    let (chair, _) = history.add_object(Stroke::click(0, 1, [10, 30]), &[]).unwrap();
    let propagation = propagated(&scene, history.labels());
    let found = suggest(&scene, &propagation, None, &AtomicBool::default()).unwrap();
    let likely = found.iter().flat_map(|place| &place.classes);
    let objects: Vec<_> = likely.map(|likely| (likely.class, likely.object)).collect();
    assert!(objects.contains(&(1, Some(chair))), "{objects:?}");
    assert!(
        objects
            .iter()
            .all(|&(class, object)| object.is_some() == (class == 1))
    );
}

#[test]
fn suggestions_are_apart_off_labels_inside_their_outlines_and_with_the_classes_of_the_maps() {
    let (propagation, found) = suggestions(&BOTH);
    assert!(!found.is_empty());
    let nodes = propagation.surface().graph.nodes();
    for (number, suggestion) in found.iter().enumerate() {
        let node = node_of(&propagation, suggestion);
        assert_eq!(suggestion.position, nodes[node as usize].position);
        let gap = |position: Vec3| position.distance(suggestion.position);
        let labels = propagation.said();
        assert!(
            labels
                .iter()
                .all(|&label| gap(nodes[label as usize].position) > 0.05)
        );
        assert!(found[..number].iter().all(|other| gap(other.position) >= APART));
        for axis in 0..2 {
            let around = suggestion.outline.iter().map(|corner| corner[axis]);
            let (low, high) = (around.clone().fold(99.0, f32::min), around.fold(0.0, f32::max));
            let middle = suggestion.pixel[axis] as f32 + 0.5;
            assert!(low <= middle && middle <= high, "{suggestion:?}");
        }
        let [first, second] = suggestion.classes[..] else {
            panic!("two classes are known: {suggestion:?}")
        };
        let confidence = f32::from(propagation.posterior().confidence[node as usize]) / f32::from(CERTAIN);
        assert!((first.probability - confidence).abs() < 1e-4, "{suggestion:?}");
        assert!((first.probability + second.probability - 1.0).abs() < 1e-4);
        assert!(first.probability >= second.probability);
    }
}

#[test]
fn the_border_between_two_settled_halves_is_no_suggestion() {
    let dense: Vec<Click> = (0..8)
        .flat_map(|k| [(0, 1, [4 + 4 * k, 30]), (1, 2, [44 + 4 * k, 30])])
        .collect();
    for suggestion in suggestions(&dense).1 {
        let is_off_the_border = suggestion.position.x.abs() > 0.08;
        assert!(is_off_the_border, "{suggestion:?}");
    }
}

#[test]
fn without_labels_there_are_places_in_every_frame_that_may_be_labelled_and_no_likely_classes() {
    let (scene, propagation) = labelled(4, &[]);
    for frame in 0..4 {
        let only = BTreeSet::from([frame]);
        let found = suggest(&scene, &propagation, Some(&only), &AtomicBool::default()).unwrap();
        assert!(!found.is_empty());
        let is_unknown = |one: &Suggestion| one.frame == frame && one.classes.is_empty();
        assert!(found.iter().all(is_unknown));
    }
}
