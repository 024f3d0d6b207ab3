use std::sync::Arc;

use super::*;
use crate::labels::{Class, LabelSet, Stroke, StrokeId};
use crate::scene::Camera;
use crate::scene::testing::wall;
use crate::semantics::{CERTAIN, Surface};

/// A wall seen from so many frames, with clicks of two classes spread over it.
fn spread(frames: usize, clicks: &[(usize, Pixel, ClassId)]) -> (Scene, LabelPropagation) {
    let scene = wall(frames, 80, 60);
    let mut propagation = LabelPropagation::new(Arc::new(Surface::build(&scene, &[], 5.0).unwrap()));
    let strokes = clicks.iter().enumerate().map(|(number, &(frame, pixel, class))| {
        let stroke = Stroke::click(frame, class, pixel);
        (StrokeId(number as u64), Arc::new(stroke))
    });
    let labels = LabelSet {
        classes: vec![Class::new(1, "left"), Class::new(2, "right")],
        strokes: strokes.collect(),
        ..LabelSet::default()
    };
    propagation.set_labels(&scene, &labels);
    (scene, propagation)
}

fn suggestions(clicks: &[(usize, Pixel, ClassId)]) -> (Arc<Surface>, Vec<u32>, Vec<Suggestion>) {
    let (scene, propagation) = spread(2, clicks);
    let suggestions = suggest(&scene, &propagation, None);
    (Arc::clone(propagation.surface()), propagation.said(), suggestions)
}

#[test]
fn the_first_suggestion_is_on_the_half_without_a_label() {
    let (_, _, found) = suggestions(&[(0, [10, 30], 1)]);
    let best = &found[0];
    let camera = Camera::with_horizontal_fov(80, 60, 90.0);
    let shift = if best.frame == 0 { -0.2 } else { 0.2 };
    let x = shift + 2.0 * camera.pixel_direction(best.pixel[0], best.pixel[1]).x;
    assert!(x > 0.0, "{best:?}");
    assert!((best.score - 1.0).abs() < 1e-6);
}

#[test]
fn suggestions_are_apart_and_never_on_a_label() {
    let (surface, said, found) = suggestions(&[(0, [10, 30], 1), (1, [70, 30], 2)]);
    let places: Vec<u32> = found
        .iter()
        .map(|s| {
            surface.pixels[s.frame]
                .node((s.pixel[1] * 80 + s.pixel[0]) as usize)
                .unwrap()
        })
        .collect();
    assert!(!places.is_empty());
    for (number, &a) in places.iter().enumerate() {
        let position = |node: u32| surface.graph.nodes()[node as usize].position;
        assert!(
            said.iter()
                .all(|&label| position(label).distance(position(a)) > 0.05)
        );
        for &b in &places[..number] {
            assert!(position(a).distance(position(b)) >= APART);
        }
    }
}

#[test]
fn the_border_between_two_settled_halves_is_no_suggestion() {
    let dense: Vec<_> = (0..8)
        .flat_map(|k| [(0, [4 + 4 * k, 30], 1), (1, [44 + 4 * k, 30], 2)])
        .collect();
    let (surface, _, found) = suggestions(&dense);
    for s in &found {
        let node = surface.pixels[s.frame]
            .node((s.pixel[1] * 80 + s.pixel[0]) as usize)
            .unwrap();
        let x = surface.graph.nodes()[node as usize].position.x;
        assert!(x.abs() > 0.08, "on the border: {s:?}");
    }
}

#[test]
fn outlines_surround_their_pixel() {
    let (_, _, found) = suggestions(&[(0, [10, 30], 1), (1, [70, 30], 2)]);
    for s in &found {
        let xs = || s.outline.iter().map(|p| p[0]);
        let ys = || s.outline.iter().map(|p| p[1]);
        let within = |v: u32, low: f32, high: f32| low <= v as f32 + 0.5 && v as f32 + 0.5 <= high;
        assert!(within(
            s.pixel[0],
            xs().fold(99.0, f32::min),
            xs().fold(0.0, f32::max)
        ));
        assert!(within(
            s.pixel[1],
            ys().fold(99.0, f32::min),
            ys().fold(0.0, f32::max)
        ));
    }
}

#[test]
fn suggestions_keep_to_the_frames_that_may_be_labelled() {
    let (scene, propagation) = spread(4, &[]);
    for frame in 0..4 {
        let only = BTreeSet::from([frame]);
        let found = suggest(&scene, &propagation, Some(&only));
        assert!(!found.is_empty() && found.iter().all(|s| s.frame == frame));
    }
}

#[test]
fn the_likely_classes_have_the_probabilities_of_the_maps() {
    let (scene, propagation) = spread(2, &[(0, [10, 30], 1), (1, [70, 30], 2)]);
    for suggestion in suggest(&scene, &propagation, None) {
        let pixel = (suggestion.pixel[1] * 80 + suggestion.pixel[0]) as usize;
        let node = propagation.surface().pixels[suggestion.frame]
            .node(pixel)
            .unwrap();
        let [first, second] = suggestion.classes[..] else {
            panic!("two classes are known: {suggestion:?}")
        };
        let confidence = f32::from(propagation.posterior().confidence[node as usize]) / f32::from(CERTAIN);
        assert!((first.probability - confidence).abs() < 1e-4, "{suggestion:?}");
        assert!((first.probability + second.probability - 1.0).abs() < 1e-4);
        assert!(first.probability >= second.probability);
        assert_eq!(
            suggestion.position,
            propagation.surface().graph.nodes()[node as usize].position
        );
    }
}

#[test]
fn without_labels_there_are_places_and_no_likely_classes() {
    let (scene, propagation) = spread(2, &[]);
    let found = suggest(&scene, &propagation, None);
    assert!(!found.is_empty() && found.iter().all(|suggestion| suggestion.classes.is_empty()));
}
