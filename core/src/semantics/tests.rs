use std::sync::Arc;

use glam::{Affine3A, Quat, Vec3};

use super::*;
use crate::field::{Preset, Sampling, Trainer, frame_rays};
use crate::labels::{History, Stroke};
use crate::scene::testing::wall;

#[test]
fn labels_that_follow_others_spread_like_new_ones() {
    let scene = wall(5, 64, 48);
    let surface = Arc::new(Surface::build(&scene, &[], 5.0).unwrap());
    let weights = |spread: &Spread| -> Vec<f32> {
        let count = spread.surface().graph.len() * spread.classes().len();
        (0..count).map(|index| 0.1 + (index % 7) as f32).collect()
    };
    let mut history = History::default();
    for name in ["dark", "bright"] {
        history.add_class(name);
    }
    let mut spread = Spread::new(Arc::clone(&surface));
    spread.set_labels(&scene, history.labels());
    spread.set_head(weights(&spread));
    let clicks = [
        (0, 1, [10, 20]),
        (0, 1, [25, 30]),
        (4, 2, [50, 30]),
        (1, 2, [28, 8]),
    ];
    for (frame, class, pixel) in clicks.into_iter().chain([(2, 0, [20, 20]), (0, 2, [10, 20])]) {
        history.add_stroke(Stroke::click(frame, class, pixel));
        spread.set_labels(&scene, history.labels());
        let mut anew = Spread::new(Arc::clone(&surface));
        anew.set_labels(&scene, history.labels());
        anew.set_head(weights(&anew));
        assert!(spread.posterior() == anew.posterior());
    }
    while history.undo().is_some() {
        spread.set_labels(&scene, history.labels());
        let mut anew = Spread::new(Arc::clone(&surface));
        anew.set_labels(&scene, history.labels());
        if anew.classes().len() == 2 {
            anew.set_head(weights(&anew));
        }
        assert!(spread.posterior() == anew.posterior());
    }
}

#[test]
fn the_composited_head_labels_a_view_that_no_frame_shows() {
    let scene = Arc::new(wall(9, 64, 48));
    let mut trainer = Trainer::new(Arc::clone(&scene), Preset::Fast, 3).unwrap();
    for _ in 0..120 {
        trainer.step().unwrap();
    }
    let surface = Surface::build(&scene, &[], trainer.field().volume().side).unwrap();
    let mut history = History::default();
    history.add_class("dark");
    history.add_class("bright");
    history.add_stroke(Stroke::click(0, 1, [10, 20]));
    history.add_stroke(Stroke::click(8, 2, [50, 30]));
    let mut spread = Spread::new(Arc::new(surface));
    spread.set_labels(&scene, history.labels());

    let (field, occupancy) = (trainer.field(), trainer.occupancy());
    let sampling = Sampling {
        step: trainer.render_step(),
        free: 2,
        near_surface: 8,
        jitter: None,
    };
    let mut head = SemanticHead::new(spread.classes(), field.feature_width(), None, 1).unwrap();
    let nobody = RayTargets {
        rays: Vec::new(),
        classes: Vec::new(),
    };
    for step in 0..150 {
        let soft = spread.soft_targets(256, step);
        head.step(field, occupancy, &soft, &nobody, sampling).unwrap();
    }

    // Nearer than any frame, above their line, and turned.
    let mut view = scene.frames[4].clone();
    let turn = Quat::from_rotation_y(0.1);
    view.camera_to_world = Affine3A::from_rotation_translation(turn, Vec3::new(-0.1, 0.15, 0.3));
    let (camera, rays) = frame_rays(&view, 1);
    let probabilities = head.along_rays(field, occupancy, &rays, sampling).unwrap();
    let (mut right, mut counted) = (0, 0);
    for (ray, p) in rays.iter().zip(probabilities.chunks_exact(2)) {
        assert!((p[0] + p[1] - 1.0).abs() < 1e-4);
        let distance = (2.0 - ray.origin.z) / ray.direction.z;
        let hit = ray.origin + distance * ray.direction;
        // On the part of the wall that the frames show, off the border.
        if hit.x.abs() > 0.15 && hit.x.abs() < 1.6 && hit.y.abs() < 1.2 {
            counted += 1;
            right += usize::from((p[1] > p[0]) == (hit.x > 0.0));
        }
    }
    assert!(counted > camera.pixels() / 3);
    assert!(right as f32 > 0.97 * counted as f32, "{right} of {counted}");
}
