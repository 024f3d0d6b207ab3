use rustc_hash::FxHashMap;

use super::*;
use crate::scene::Camera;
use crate::scene::testing::wall;
use crate::semantics::Propagation;

fn suggestions(labels: &[(usize, Pixel, ClassId)]) -> (Scene, Surface, Vec<u32>, Vec<Suggestion>) {
    let scene = wall(2, 80, 60);
    let surface = Surface::build(&scene, &[], 5.0).unwrap();
    let mut seeds = FxHashMap::default();
    for &(frame, [x, y], class) in labels {
        seeds.insert(surface.pixels[frame].node((y * 80 + x) as usize).unwrap(), class);
    }
    let said: Vec<u32> = seeds.keys().copied().collect();
    let mut propagation = Propagation::default();
    propagation.update(&surface.graph, seeds);
    let posterior = Posterior::new(&propagation, &[1, 2], surface.graph.len(), None, None);
    let suggestions = suggest(&scene, &surface, &posterior, &said, None);
    (scene, surface, said, suggestions)
}

#[test]
fn the_first_suggestion_is_on_the_half_without_a_label() {
    let (_, _, _, found) = suggestions(&[(0, [10, 30], 1)]);
    let best = &found[0];
    let camera = Camera::with_horizontal_fov(80, 60, 90.0);
    let shift = if best.frame == 0 { -0.2 } else { 0.2 };
    let x = shift + 2.0 * camera.pixel_direction(best.pixel[0], best.pixel[1]).x;
    assert!(x > 0.0, "{best:?}");
    assert!((best.score - 1.0).abs() < 1e-6);
}

#[test]
fn suggestions_are_apart_and_never_on_a_label() {
    let (_, surface, said, found) = suggestions(&[(0, [10, 30], 1), (1, [70, 30], 2)]);
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
    let (_, surface, _, found) = suggestions(&dense);
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
    let (_, _, _, found) = suggestions(&[(0, [10, 30], 1), (1, [70, 30], 2)]);
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
    let scene = wall(4, 80, 60);
    let surface = Surface::build(&scene, &[], 5.0).unwrap();
    let posterior = Posterior::new(&Propagation::default(), &[1, 2], surface.graph.len(), None, None);
    for frame in 0..4 {
        let only = BTreeSet::from([frame]);
        let found = suggest(&scene, &surface, &posterior, &[], Some(&only));
        assert!(!found.is_empty() && found.iter().all(|s| s.frame == frame));
    }
}
