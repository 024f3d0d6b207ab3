use std::sync::Arc;

use glam::{Affine3A, Quat, Vec3};
use rand::{Rng, SeedableRng, rngs::SmallRng};

use super::*;
use crate::field::{Preset, Sampling, Trainer, frame_rays};
use crate::labels::{
    ClassId, History, ImportedLabels, ImportedMap, LabelImages, LabelSet, Stroke, Trust, VOID, rasterise,
};
use crate::scene::testing::{hide, wall};
use crate::scene::{DepthMap, Scene};

#[test]
fn labels_that_follow_others_spread_like_new_ones() {
    let scene = wall(5, 64, 48);
    let surface = Arc::new(Surface::build(&scene, &[], 5.0).unwrap());
    let weights = |propagation: &LabelPropagation| -> Vec<f32> {
        let count = propagation.surface().graph.len() * propagation.classes().len();
        (0..count).map(|index| 0.1 + (index % 7) as f32).collect()
    };
    let mut history = History::default();
    for name in ["dark", "bright"] {
        history.add_class(name);
    }
    let mut propagation = LabelPropagation::new(Arc::clone(&surface));
    propagation.set_labels(&scene, history.labels());
    propagation.set_head(weights(&propagation));
    let clicks = [
        (0, 1, [10, 20]),
        (0, 1, [25, 30]),
        (4, 2, [50, 30]),
        (1, 2, [28, 8]),
    ];
    for (frame, class, pixel) in clicks.into_iter().chain([(2, 0, [20, 20]), (0, 2, [10, 20])]) {
        history.add_stroke(Stroke::click(frame, class, pixel));
        propagation.set_labels(&scene, history.labels());
        let mut anew = LabelPropagation::new(Arc::clone(&surface));
        anew.set_labels(&scene, history.labels());
        anew.set_head(weights(&anew));
        assert!(propagation.posterior() == anew.posterior());
    }
    while history.undo().is_some() {
        propagation.set_labels(&scene, history.labels());
        let mut anew = LabelPropagation::new(Arc::clone(&surface));
        anew.set_labels(&scene, history.labels());
        if anew.classes().len() == 2 {
            anew.set_head(weights(&anew));
        }
        assert!(propagation.posterior() == anew.posterior());
    }
}

#[test]
fn the_order_of_the_class_list_changes_nothing() {
    let scene = wall(5, 64, 48);
    let surface = Arc::new(Surface::build(&scene, &[], 5.0).unwrap());
    let mut history = History::default();
    for name in ["dark", "bright", "other"] {
        history.add_class(name);
    }
    history.add_stroke(Stroke::click(0, 1, [10, 20]));
    history.add_stroke(Stroke::click(4, 2, [50, 30]));
    let mut propagation = LabelPropagation::new(surface);
    propagation.set_labels(&scene, history.labels());
    let before = (propagation.classes().to_vec(), propagation.posterior().clone());
    history.move_class(3, 0).unwrap();
    propagation.set_labels(&scene, history.labels());
    assert!(before == (propagation.classes().to_vec(), propagation.posterior().clone()));
}

/// A wall whose halves are clicked once each, and a field that knows it.
fn clicked() -> (Arc<Scene>, Trainer, LabelPropagation) {
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
    let mut propagation = LabelPropagation::new(Arc::new(surface));
    propagation.set_labels(&scene, history.labels());

    (scene, trainer, propagation)
}

fn sampling(trainer: &Trainer) -> Sampling {
    Sampling {
        step: trainer.render_step(),
        held_back: 0.0,
        free: 2,
        near_surface: 8,
        jitter: None,
    }
}

/// Asserts that a head labels a view that no frame shows.
fn labels_an_unseen_view(scene: &Scene, trainer: &Trainer, head: &SemanticHead) {
    let (field, occupancy) = (trainer.field(), trainer.occupancy());
    // Nearer than any frame, above their line, and turned.
    let mut view = scene.frames[4].clone();
    let turn = Quat::from_rotation_y(0.1);
    view.camera_to_world = Affine3A::from_rotation_translation(turn, Vec3::new(-0.1, 0.15, 0.3));
    let (camera, rays) = frame_rays(&view, 1);
    let probabilities = head
        .along_rays(field, occupancy, &rays, sampling(trainer))
        .unwrap();
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

/// Imports an image that says the same of every pixel of the first three frames.
fn import(history: &mut History, class: ClassId, trust: Trust) {
    let maps = (0..3)
        .map(|frame| ImportedMap::new(frame, &[class; 64 * 48]))
        .collect();
    history.import(LabelImages {
        labels: ImportedLabels { maps, trust },
        classes: Vec::new(),
        unmatched: 0,
    });
}

fn propagate(propagation: &mut LabelPropagation, scene: &Scene, labels: &LabelSet) {
    propagation.set_labels(scene, labels);
    if let Some(import) = SurfaceImport::new(propagation.surface(), labels) {
        propagation.set_import(import);
    }
}

/// Shares of the dark and of the bright pixels of a frame that have this class.
fn shares(propagation: &LabelPropagation, scene: &Arc<Scene>, frame: usize, class: ClassId) -> [f32; 2] {
    let map = propagation.map(scene, frame, 1);
    let (mut counted, mut with) = ([0.0; 2], [0.0; 2]);
    for (pixel, &label) in map.labels().iter().enumerate() {
        let side = usize::from(scene.frames[frame].color().pixel(pixel)[0] > 128);
        counted[side] += 1.0;
        with[side] += f32::from(u8::from(label == class));
    }
    [with[0] / counted[0], with[1] / counted[1]]
}

#[test]
fn votes_decide_until_a_click_corrects_what_is_connected_with_it() {
    let scene = Arc::new(wall(5, 64, 48));
    let mut propagation = LabelPropagation::new(Arc::new(Surface::build(&scene, &[], 5.0).unwrap()));
    let mut history = History::default();
    history.add_class("dark");
    history.add_class("bright");
    import(&mut history, 1, Trust::VOTES);
    propagate(&mut propagation, &scene, history.labels());
    assert!(propagation.has_import_of(history.labels()));
    // Also where no image is.
    assert!(
        shares(&propagation, &scene, 4, 1)
            .iter()
            .all(|&share| share > 0.99)
    );
    let sure = propagation.map(&scene, 4, 1).mean_entropy();
    assert!(sure < 0.3, "{sure}");

    history.add_stroke(Stroke::click(4, 2, [50, 30]));
    propagation.set_labels(&scene, history.labels());
    let [dark, bright] = shares(&propagation, &scene, 3, 2);
    assert!(bright > 0.95 && dark < 0.05, "{dark} {bright}");
    let map = propagation.map(&scene, 4, 1);
    assert_eq!((map.labels()[30 * 64 + 50], map.entropy()[30 * 64 + 50]), (2, 0));

    history.undo().unwrap();
    propagation.set_labels(&scene, history.labels());
    assert!(
        shares(&propagation, &scene, 3, 1)
            .iter()
            .all(|&share| share > 0.99)
    );
    history.undo().unwrap();
    propagation.set_labels(&scene, history.labels());
    assert!(!propagation.has_import_of(history.labels()));
    assert!(
        shares(&propagation, &scene, 3, VOID)
            .iter()
            .all(|&share| share == 1.0)
    );
}

#[test]
fn maps_have_the_borders_of_the_image_where_voxels_lie_across() {
    let mut scene = wall(5, 64, 48);
    // The border is at x = 0, where voxels end, and comes to lie within some.
    for frame in &mut scene.frames {
        frame.camera_to_world.translation.x += 0.06;
    }
    let scene = Arc::new(scene);
    let mut propagation = LabelPropagation::new(Arc::new(Surface::build(&scene, &[], 5.0).unwrap()));
    let mut history = History::default();
    history.add_class("dark");
    history.add_class("bright");
    history.add_stroke(Stroke::click(0, 1, [10, 20]));
    history.add_stroke(Stroke::click(4, 2, [50, 30]));
    propagation.set_labels(&scene, history.labels());
    let (mut by_voxels, mut in_maps) = (0, 0);
    for (number, frame) in scene.frames.iter().enumerate() {
        let color = frame.color();
        let class = |pixel: usize| if color.pixel(pixel)[0] > 128 { 2 } else { 1 };
        let nodes = propagation.surface().pixels[number].unpack();
        let of_voxel = |pixel: usize| propagation.posterior().labels[nodes[pixel] as usize];
        let map = propagation.map(&scene, number, 1);
        by_voxels += (0..nodes.len())
            .filter(|&pixel| of_voxel(pixel) != class(pixel))
            .count();
        let labels = map.labels();
        in_maps += (0..nodes.len())
            .filter(|&pixel| labels[pixel] != class(pixel))
            .count();
    }
    assert!(by_voxels >= 48, "{by_voxels}");
    assert!(10 * in_maps < by_voxels, "{in_maps} {by_voxels}");
}

#[test]
fn a_scribble_that_slips_over_an_edge_keeps_its_pixels_and_spreads_from_the_rest() {
    let scene = Arc::new(wall(5, 64, 48));
    let mut propagation = LabelPropagation::new(Arc::new(Surface::build(&scene, &[], 5.0).unwrap()));
    let mut history = History::default();
    history.add_class("dark");
    history.add_class("bright");
    // The border of the middle frame is at column 32.
    history.add_stroke(Stroke {
        lines: vec![vec![[8, 20], [35, 20]]],
        radius: 1,
        ..Stroke::click(2, 1, [8, 20])
    });
    history.add_stroke(Stroke::click(2, 2, [58, 40]));
    propagation.set_labels(&scene, history.labels());
    let color = scene.frames[2].color();
    let class = |pixel: usize| if color.pixel(pixel)[0] > 128 { 2 } else { 1 };
    let map = propagation.map(&scene, 2, 1);
    let painted = rasterise(history.labels(), 2, 64, 48);
    for (pixel, &label) in map.labels().iter().enumerate() {
        let said = painted.get(&(pixel as u32)).map(|&(class, _)| class);
        assert_eq!(label, said.unwrap_or(class(pixel)), "pixel {pixel}");
    }
    // Two halves of a scribble are both meant.
    history.undo().unwrap();
    history.undo().unwrap();
    history.add_stroke(Stroke {
        lines: vec![vec![[8, 20], [56, 20]]],
        radius: 1,
        ..Stroke::click(2, 1, [8, 20])
    });
    history.add_stroke(Stroke::click(2, 2, [58, 40]));
    propagation.set_labels(&scene, history.labels());
    assert_eq!(propagation.map(&scene, 2, 2).labels()[22 * 64 + 40], 1);
}

#[test]
fn trusted_images_are_as_they_say_under_later_strokes() {
    let scene = Arc::new(wall(5, 64, 48));
    let mut propagation = LabelPropagation::new(Arc::new(Surface::build(&scene, &[], 5.0).unwrap()));
    let mut history = History::default();
    history.add_class("one");
    history.add_class("two");
    import(&mut history, 1, Trust::RIGHT);
    history.add_stroke(Stroke::click(2, 2, [50, 30]));
    propagate(&mut propagation, &scene, history.labels());
    let map = propagation.map(&scene, 2, 1);
    for (pixel, (&label, &entropy)) in map.labels().iter().zip(map.entropy().iter()).enumerate() {
        let class = if pixel == 30 * 64 + 50 { 2 } else { 1 };
        assert_eq!((label, entropy), (class, 0));
    }
    // Frames without an image follow by shortest paths.
    let [dark, bright] = shares(&propagation, &scene, 4, 1);
    assert!(dark > 0.95 && bright > 0.8, "{dark} {bright}");
    // A class that is gone says nothing any more.
    history.delete_class(1).unwrap();
    assert!(!propagation.has_import_of(history.labels()));
    propagate(&mut propagation, &scene, history.labels());
    assert!(
        shares(&propagation, &scene, 2, 1)
            .iter()
            .all(|&share| share == 0.0)
    );
}

#[test]
fn the_composited_head_labels_a_view_that_no_frame_shows() {
    let (scene, trainer, propagation) = clicked();
    let field = trainer.field();
    let mut head = SemanticHead::new(propagation.classes(), field.feature_width(), None, None, 1).unwrap();
    for step in 0..150 {
        let soft = propagation.soft_targets(256, step);
        let nobody = RayTargets::default();
        head.step(field, trainer.occupancy(), &soft, &nobody, sampling(&trainer))
            .unwrap();
    }
    labels_an_unseen_view(&scene, &trainer, &head);
}

#[test]
fn a_semantic_field_that_is_taught_by_rays_alone_labels_such_a_view_too() {
    let (scene, trainer, propagation) = clicked();
    let field = trainer.field();
    let own = Some(trainer.capacity().semantic_grid());
    let mut head = SemanticHead::new(propagation.classes(), field.feature_width(), own, None, 1).unwrap();
    for step in 0..150 {
        let nowhere = SoftTargets::default();
        let rays = propagation.map_rays(&scene, 256, step);
        assert!(rays.rays.iter().all(|ray| ray.length.is_none()));
        head.step(field, trainer.occupancy(), &nowhere, &rays, sampling(&trainer))
            .unwrap();
    }
    labels_an_unseen_view(&scene, &trainer, &head);
}

#[test]
fn votes_of_which_most_are_wrong_teach_a_semantic_field_the_truth() {
    let (scene, trainer, propagation) = clicked();
    let classes = [1, 2, 3, 4];
    let mut rng = SmallRng::seed_from_u64(2);
    let mut noisy = |frame: usize| {
        let mut labels = propagation.map(&scene, frame, 0).labels().into_owned();
        for label in &mut labels {
            if rng.random_bool(0.8) {
                *label = rng.random_range(1..=4);
            }
        }
        ImportedMap::new(frame, &labels)
    };
    let labels = ImportedLabels {
        maps: (0..scene.frames.len()).map(&mut noisy).collect(),
        trust: Trust::VOTES,
    };
    let votes = NodeVotes::count(propagation.surface(), &classes, &labels);
    let field = trainer.field();
    let own = Some(trainer.capacity().semantic_grid());
    let mut head = SemanticHead::new(&classes, field.feature_width(), own, None, 1).unwrap();
    let frames: Vec<usize> = (0..scene.frames.len()).collect();
    for step in 0..60 {
        let soft = votes.targets(propagation.surface(), 512, step);
        let rays = votes.rays(propagation.surface(), &scene, &frames, 64, step);
        head.step(field, trainer.occupancy(), &soft, &rays, sampling(&trainer))
            .unwrap();
    }
    let nodes = propagation.surface().graph.nodes();
    let positions: Vec<Vec3> = nodes.iter().map(|node| node.position).collect();
    let probabilities = head.at_points(field, &positions).unwrap();
    let truth = &propagation.posterior().labels;
    let right = probabilities.chunks_exact(4).zip(truth).filter(|(p, truth)| {
        let best = (0..4).max_by(|&a, &b| p[a].total_cmp(&p[b])).unwrap();
        classes[best] == **truth
    });
    let right = right.count();
    let majority = votes.majority();
    let by_majority = (0..nodes.len()).filter(|&node| majority.get(&(node as u32)) == Some(&truth[node]));
    assert!(
        right as f32 > 0.97 * nodes.len() as f32,
        "{right} of {}",
        nodes.len()
    );
    assert!(by_majority.count() < right);
}

#[test]
fn voxels_grow_with_the_noise_of_the_depth_to_twice_their_side() {
    let voxel = |noise: f32| {
        let mut scene = wall(3, 64, 48);
        for frame in &mut scene.frames {
            // Every second column is nearer: each is that far from the mean of its neighbours.
            let depths = (0..64 * 48)
                .map(|pixel| 2.0 - noise * (pixel % 2) as f32)
                .collect();
            frame.set_depth(Some(DepthMap::from_z_depths(&frame.camera, depths)));
        }
        Surface::build(&scene, &[], 5.0).unwrap().voxel
    };
    let exact = voxel(0.0);
    assert!((0.15..0.2).contains(&exact), "{exact}");
    // Along the rays, which are up to 1.6 times as long as the depth.
    let noisy = voxel(0.012);
    assert!((1.0..1.6).contains(&(noisy / (20.0 * 0.012))), "{noisy}");
    assert!(noisy < 1.9 * exact);
    let very_noisy = voxel(0.05);
    assert!((very_noisy / (2.0 * exact) - 1.0).abs() < 0.05, "{very_noisy}");
}

#[test]
fn four_times_the_voxels_have_half_the_side() {
    let scene = wall(3, 320, 240);
    let chosen = Surface::build(&scene, &[], 5.0).unwrap();
    assert_eq!(
        Surface::build_scaled(&scene, &[], 5.0, 1.0).unwrap().graph.len(),
        chosen.graph.len()
    );
    for (size, tolerance) in [(0.25, 0.3), (4.0, 0.2)] {
        let scaled = Surface::build_scaled(&scene, &[], 5.0, size).unwrap();
        assert!((scaled.voxel - chosen.voxel / size.sqrt()).abs() < 1e-6);
        let share = scaled.graph.len() as f32 / chosen.graph.len() as f32;
        assert!((share / size - 1.0).abs() < tolerance, "{size}: {share}");
        assert_eq!(scaled.graph.bytes() > chosen.graph.bytes(), size > 1.0);
    }
}

#[test]
fn hidden_pixels_have_no_node_and_no_label_whatever_is_said_of_them() {
    let mut scene = wall(3, 64, 48);
    // The middle of the second frame, where its neighbours know the wall, and where depth was measured.
    let is_hidden = |index: usize| (20..40).contains(&(index % 64)) && (10..30).contains(&(index / 64));
    hide(&mut scene.frames[1], is_hidden);
    let scene = Arc::new(scene);
    let surface = Arc::new(Surface::build(&scene, &[], 5.0).unwrap());
    let mut history = History::default();
    history.add_class("dark");
    history.add_class("bright");
    history.add_stroke(Stroke::click(0, 1, [10, 20]));
    history.add_stroke(Stroke::click(0, 2, [50, 30]));
    let mut propagation = LabelPropagation::new(Arc::clone(&surface));
    propagation.set_labels(&scene, history.labels());
    let before: Vec<_> = (0..3)
        .map(|frame| propagation.map(&scene, frame, 1).labels().into_owned())
        .collect();
    history.add_stroke(Stroke::click(1, 1, [30, 20]));
    propagation.set_labels(&scene, history.labels());
    for (frame, before) in before.iter().enumerate() {
        let map = propagation.map(&scene, frame, 2);
        assert_eq!(
            &map.labels()[..],
            &before[..],
            "a stroke on hidden pixels says nothing"
        );
        let (nodes, entropy) = (
            surface.nodes_at(frame, &(0..64 * 48).collect::<Vec<u32>>()),
            map.entropy(),
        );
        for index in 0..64 * 48 {
            let hidden = frame == 1 && is_hidden(index);
            assert_eq!(nodes[index].is_none(), hidden, "{frame} {index}");
            assert_eq!(map.labels()[index] == VOID, hidden, "{frame} {index}");
            assert!(!hidden || entropy[index] == 0);
        }
        let (summary, exact) = (map.summary(None).unwrap(), map.looked_up().summary(None).unwrap());
        assert!((summary.coverage - exact.coverage).abs() < 1e-6);
        assert!((summary.mean_entropy - exact.mean_entropy).abs() < 0.03);
        assert!((summary.unclear - exact.unclear).abs() < 0.03);
    }
}

#[test]
fn a_summary_by_nodes_is_near_that_of_the_pixels() {
    let scene = Arc::new(wall(5, 64, 48));
    let surface = Arc::new(Surface::build(&scene, &[], 5.0).unwrap());
    let mut history = History::default();
    history.add_class("dark");
    history.add_class("bright");
    history.add_stroke(Stroke::click(0, 1, [10, 20]));
    history.add_stroke(Stroke::click(4, 2, [50, 30]));
    let mut propagation = LabelPropagation::new(surface);
    propagation.set_labels(&scene, history.labels());
    let imported = ImportedMap::new(2, &[1; 64 * 48]);
    for frame in 0..5 {
        let map = propagation.map(&scene, frame, 1);
        let summary = map.summary(Some(&imported)).unwrap();
        let exact = map.looked_up().summary(Some(&imported)).unwrap();
        assert!((exact.mean_entropy - map.mean_entropy()).abs() < 1e-5);
        assert!((exact.coverage - map.coverage()).abs() < 1e-6);
        let bright = map.labels().iter().filter(|&&label| label == 2).count() as f32;
        assert!((exact.disagreeing - bright / (64.0 * 48.0)).abs() < 1e-6);
        let confidence = map.confidence().unwrap();
        let unclear = confidence.iter().filter(|&&p| p < CERTAIN / 2).count() as f32;
        assert!((exact.unclear - unclear / (64.0 * 48.0)).abs() < 1e-6);
        for (near, exact) in [
            (summary.mean_entropy, exact.mean_entropy),
            (summary.coverage, exact.coverage),
            (summary.unclear, exact.unclear),
            (summary.disagreeing, exact.disagreeing),
        ] {
            assert!((near - exact).abs() < 0.03, "{near} instead of {exact}");
        }
    }
}
