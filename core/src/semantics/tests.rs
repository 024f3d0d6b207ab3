use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{Affine3A, Quat, Vec3};

use super::testing::{propagated, surface, truth};
use super::*;
use crate::features::COMPONENTS;
use crate::field::{Preset, Trainer, frame_rays};
use crate::labels::testing::{clicked, import_plain};
use crate::labels::{ClassId, History, ImportedMap, LabelSet, Stroke, Trust, VOID, rasterise};
use crate::scene::testing::{hide, wall, without_depth};
use crate::scene::{DepthMap, Frame, Scene};
use crate::session::sampling;

/// The classes of a wall, without labels.
fn halves() -> History {
    clicked(&["dark", "bright"], &[])
}

/// One click on each half of a wall.
fn two_clicks() -> History {
    clicked(&["dark", "bright"], &[(0, 1, [10, 20]), (4, 2, [50, 30])])
}

#[test]
fn labels_that_follow_others_spread_like_new_ones() {
    let scene = wall(5, 64, 48);
    let mut history = halves();
    let mut propagation = propagated(&scene, history.labels());
    let weigh = |propagation: &mut LabelPropagation| {
        let weights = (0..2 * propagation.surface().graph.len()).map(|index| 0.1 + (index % 7) as f32);
        propagation.set_prior(weights.collect());
    };
    weigh(&mut propagation);
    let mut follow = |labels: &LabelSet| {
        propagation.set_labels(&scene, labels);
        let mut anew = LabelPropagation::new(Arc::clone(propagation.surface()));
        anew.set_labels(&scene, labels);
        if anew.classes().len() == 2 {
            weigh(&mut anew);
        }
        assert!(propagation.posterior() == anew.posterior());
    };
    let clicks = [
        (0, 1, [10, 20]),
        (0, 1, [25, 30]),
        (4, 2, [50, 30]),
        (1, 2, [28, 8]),
        (2, VOID, [20, 20]),
        (0, 2, [10, 20]),
    ];
    for (frame, class, pixel) in clicks {
        history.add_stroke(Stroke::click(frame, class, pixel));
        follow(history.labels());
    }
    while history.undo().is_some() {
        follow(history.labels());
    }
}

#[test]
fn what_a_frame_shows_is_told_before_the_rest_of_the_scene_follows_and_stays() {
    for scene in [wall(5, 64, 48), without_depth(wall(5, 64, 48))] {
        let scene = Arc::new(scene);
        let mut history = clicked(&["dark", "bright"], &[(0, 1, [10, 20])]);
        let mut propagation = propagated(&Arc::new(wall(5, 64, 48)), history.labels());
        let mut in_turn = propagation.clone();
        for (frame, class, pixel) in [(4, 2, [50, 30]), (0, 1, [25, 30]), (1, 2, [28, 8])] {
            history.add_stroke(Stroke::click(frame, class, pixel));
            let (said, mut told) = ((&scene, history.labels()), None);
            let is_told = propagation.set_labels_seen_in(said, (2, 7), |map| {
                assert!(map.surface().is_none());
                told = Some(map);
            });
            in_turn.set_labels(&scene, history.labels());
            assert!(propagation.posterior() == in_turn.posterior());
            let (told, then) = (told.unwrap(), in_turn.map(&scene, 2, 7));
            assert!(is_told && told.is_looked_up());
            assert_eq!(told.labels(), then.labels());
            assert_eq!(told.entropy(), then.entropy());
            assert!(told.surface().unwrap().1 == then.surface().unwrap().1);
        }
    }
}

#[test]
fn the_order_of_the_class_list_changes_nothing() {
    let scene = wall(5, 64, 48);
    let mut history = two_clicks();
    history.add_class("other");
    let mut propagation = propagated(&scene, history.labels());
    let before = (propagation.classes().to_vec(), propagation.posterior().clone());
    history.move_class(3, 0).unwrap();
    propagation.set_labels(&scene, history.labels());
    assert!(before == (propagation.classes().to_vec(), propagation.posterior().clone()));
}

#[test]
fn doubt_is_the_mean_of_what_is_likely_with_a_pretrained_network_and_without() {
    let scene = wall(2, 64, 48);
    let labels = clicked(&["dark", "other"], &[(0, 1, [10, 20]), (0, 2, [20, 10])]);
    let plain = propagated(&scene, labels.labels());
    assert!(plain.doubted().is_none());
    // The network sees something else in each of the two regions.
    let mut surface = Surface::clone(plain.surface());
    let features = [0, 1].map(|region| (0..COMPONENTS).map(move |axis| f32::from(axis == region)));
    Arc::make_mut(&mut surface.look).features = Some(features.into_iter().flatten().collect());
    assert_eq!(surface.look.len(), 2);
    let mut seen = LabelPropagation::new(Arc::new(surface));
    seen.set_labels(&scene, labels.labels());
    let (likeness, posterior) = seen.doubted().unwrap();
    let evidence = seen.doubted_evidence(&likeness);
    let nodes = plain.surface().graph.len();
    assert!(posterior == Posterior::new(&evidence, nodes));
    assert!(posterior != *plain.posterior() && posterior != *seen.posterior());
    for node in 0..nodes {
        let [with, without] = [&seen, &plain].map(|one| one.evidence().probabilities(node)[0]);
        let doubted = evidence.probabilities(node)[0];
        assert!(
            (doubted - 0.5 * (with + without)).abs() < 1e-6,
            "{with} {without} {doubted}"
        );
    }
}

/// Asserts that a semantic field labels a view that no frame shows.
fn labels_an_unseen_view(scene: &Scene, trainer: &Trainer, semantics: &SemanticField) {
    let (field, occupancy) = (trainer.field(), trainer.occupancy());
    // Nearer than any frame, above their line, and turned.
    let mut view = scene.frames[4].clone();
    let turn = Quat::from_rotation_y(0.1);
    view.camera_to_world = Affine3A::from_rotation_translation(turn, Vec3::new(-0.1, 0.15, 0.3));
    let (camera, rays) = frame_rays(&view, 1);
    let probabilities = semantics
        .along_rays(field, occupancy, &rays, sampling(trainer, None))
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
    for (half, &label) in truth(scene, frame).into_iter().zip(map.labels().iter()) {
        counted[usize::from(half) - 1] += 1.0;
        with[usize::from(half) - 1] += f32::from(u8::from(label == class));
    }
    [with[0] / counted[0], with[1] / counted[1]]
}

#[test]
fn votes_decide_until_a_click_corrects_what_is_connected_with_it() {
    let scene = Arc::new(wall(5, 64, 48));
    let mut history = halves();
    let mut propagation = propagated(&scene, history.labels());
    import_plain(&mut history, 1, Trust::VOTES);
    let before = propagation.map(&scene, 4, 1);
    propagate(&mut propagation, &scene, history.labels());
    assert!(propagation.has_import_of(history.labels()));
    let after = propagation.map(&scene, 4, 1);
    let follow = [before, after].map(|map| map.has_import_of(history.labels()));
    assert_eq!(follow, [false, true]);
    let is_all = |propagation: &LabelPropagation, frame, class| {
        shares(propagation, &scene, frame, class)
            .iter()
            .all(|&share| share > 0.99)
    };
    assert!(is_all(&propagation, 4, 1), "also where no image is");
    let sure = propagation.map(&scene, 4, 1).looked_up().summary(None).unwrap();
    assert!(sure.mean_entropy < 0.3, "{}", sure.mean_entropy);

    history.add_stroke(Stroke::click(4, 2, [50, 30]));
    propagation.set_labels(&scene, history.labels());
    let [dark, bright] = shares(&propagation, &scene, 3, 2);
    assert!(bright > 0.95 && dark < 0.05, "{dark} {bright}");
    let map = propagation.map(&scene, 4, 1);
    assert_eq!((map.labels()[30 * 64 + 50], map.entropy()[30 * 64 + 50]), (2, 0));

    for class in [1, VOID] {
        history.undo().unwrap();
        propagation.set_labels(&scene, history.labels());
        assert!(is_all(&propagation, 3, class));
    }
    assert!(!propagation.has_import_of(history.labels()));
}

#[test]
fn images_none_of_whose_classes_are_left_say_nothing() {
    let scene = Arc::new(wall(5, 64, 48));
    let mut history = halves();
    import_plain(&mut history, 1, Trust::VOTES);
    history.delete_class(1).unwrap();
    history.add_stroke(Stroke::click(4, 2, [50, 30]));
    let mut propagation = propagated(&scene, history.labels());
    propagate(&mut propagation, &scene, history.labels());
    assert!(propagation.has_import_of(history.labels()));
    assert!(
        shares(&propagation, &scene, 3, 2)
            .iter()
            .all(|&share| share > 0.99)
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
    let propagation = propagated(&scene, two_clicks().labels());
    let (mut by_voxels, mut in_maps) = (0, 0);
    for frame in 0..5 {
        let nodes = propagation.surface().pixels[frame].unpack();
        let map = propagation.map(&scene, frame, 1);
        for (pixel, class) in truth(&scene, frame).into_iter().enumerate() {
            let of_voxel = propagation.posterior().labels[nodes[pixel] as usize];
            by_voxels += usize::from(of_voxel != class);
        }
        let labels = map.labels();
        let truth = truth(&scene, frame);
        let pairs = truth.iter().zip(labels.iter());
        in_maps += pairs.filter(|(class, label)| class != label).count();
    }
    assert!(by_voxels >= 48, "{by_voxels}");
    assert!(10 * in_maps < by_voxels, "{in_maps} {by_voxels}");
}

#[test]
fn where_depth_is_estimated_a_voxel_on_a_border_has_a_node_for_each_side_of_it() {
    let mut measured = wall(5, 64, 48);
    for frame in &mut measured.frames {
        frame.camera_to_world.translation.x += 0.06;
    }
    let lengths = |frame: &Frame| {
        let (camera, _) = frame_rays(frame, 4);
        let known = |at| frame.ray_length(frame.camera.middle_of_reduced(4, at));
        let lengths = (0..camera.pixels()).map(|at| known(at).unwrap()).collect();
        let (stride, width) = (4, camera.width);
        Some(Arc::new(FieldDepth {
            stride,
            width,
            lengths,
        }))
    };
    let estimated: Vec<_> = measured.frames.iter().map(lengths).collect();
    let has_both = |scene: &Scene, depth: &[Option<Arc<FieldDepth>>]| {
        let surface = Surface::build(scene, depth, 5.0).unwrap();
        let mut sides = vec![[false; 2]; surface.graph.len()];
        for frame in 0..5 {
            let nodes = surface.pixels[frame].unpack();
            for (&node, class) in nodes.iter().zip(truth(scene, frame)) {
                sides[node as usize][usize::from(class == 2)] = true;
            }
        }
        sides.iter().filter(|&&sides| sides == [true; 2]).count()
    };
    assert!(has_both(&measured, &[]) > 5);
    assert_eq!(has_both(&without_depth(measured), &estimated), 0);
}

#[test]
fn a_scribble_that_slips_over_an_edge_keeps_its_pixels_and_spreads_from_the_rest() {
    let scene = Arc::new(wall(5, 64, 48));
    let scribbled = |end: u32| {
        let mut history = halves();
        history.add_stroke(Stroke::drawn(2, 1, 1, vec![vec![[8, 20], [end, 20]]]));
        history.add_stroke(Stroke::click(2, 2, [58, 40]));
        let map = propagated(&scene, history.labels()).map(&scene, 2, 1);
        (history, map)
    };
    // The border of the middle frame is at column 32.
    let (history, map) = scribbled(35);
    let painted: BTreeMap<_, _> = rasterise(history.labels(), 2, 64, 48).into_iter().collect();
    for (pixel, class) in truth(&scene, 2).into_iter().enumerate() {
        let said = painted.get(&(pixel as u32)).map(|&(class, _)| class);
        assert_eq!(map.labels()[pixel], said.unwrap_or(class), "pixel {pixel}");
    }
    // Two halves of a scribble are both meant.
    assert_eq!(scribbled(56).1.labels()[22 * 64 + 40], 1);
}

#[test]
fn trusted_images_are_as_they_say_under_later_strokes() {
    let scene = Arc::new(wall(5, 64, 48));
    let mut history = halves();
    import_plain(&mut history, 1, Trust::RIGHT);
    history.add_stroke(Stroke::click(2, 2, [50, 30]));
    let mut propagation = LabelPropagation::new(surface(&scene));
    propagate(&mut propagation, &scene, history.labels());
    let map = propagation.map(&scene, 2, 1);
    for (pixel, (&label, &entropy)) in map.labels().iter().zip(map.entropy().iter()).enumerate() {
        let class = if pixel == 30 * 64 + 50 { 2 } else { 1 };
        assert_eq!((label, entropy), (class, 0));
    }
    // Frames without an image follow by shortest paths.
    let [dark, bright] = shares(&propagation, &scene, 4, 1);
    assert!(dark > 0.95 && bright > 0.8, "{dark} {bright}");
    // The images of a deleted class no longer count.
    history.delete_class(1).unwrap();
    assert!(!propagation.has_import_of(history.labels()));
    propagate(&mut propagation, &scene, history.labels());
    assert_eq!(shares(&propagation, &scene, 2, 1), [0.0, 0.0]);
}

#[test]
fn both_parts_of_a_semantic_field_label_a_view_that_no_frame_shows() {
    let scene = Arc::new(wall(9, 64, 48));
    let mut trainer = Trainer::new(Arc::clone(&scene), Preset::Fast, 3).unwrap();
    for _ in 0..120 {
        trainer.step().unwrap();
    }
    let history = clicked(&["dark", "bright"], &[(0, 1, [10, 20]), (8, 2, [50, 30])]);
    let propagation = propagated(&scene, history.labels());
    let (field, occupancy) = (trainer.field(), trainer.occupancy());
    for part in [SemanticPart::Appearance, SemanticPart::Residual] {
        let (classes, width) = (propagation.classes(), field.feature_width());
        let grid = trainer.capacity().semantic_grid();
        let mut semantics = SemanticField::new(classes, width, grid, None, 1).unwrap();
        for step in 0..150 {
            let (soft, rays) = match part {
                SemanticPart::Appearance => (propagation.soft_targets(256, step), RayTargets::default()),
                SemanticPart::Residual => (SoftTargets::default(), propagation.map_rays(&scene, 256, step)),
            };
            assert!(rays.rays.iter().all(|ray| ray.length.is_none()));
            semantics
                .step(part, (field, occupancy), &soft, &rays, sampling(&trainer, None))
                .unwrap();
        }
        labels_an_unseen_view(&scene, &trainer, &semantics);
    }
}

#[test]
fn voxels_grow_with_the_noise_of_the_depth_to_twice_their_side_and_the_depth_is_not_sharp() {
    let built = |noise: f32| {
        let mut scene = wall(3, 64, 48);
        for frame in &mut scene.frames {
            // Every second column is nearer: each is that far from the mean of its neighbours.
            let depths = (0..64 * 48)
                .map(|pixel| 2.0 - noise * (pixel % 2) as f32)
                .collect();
            frame.set_depth(Some(DepthMap::from_z_depths(&frame.camera, depths)));
        }
        let surface = Surface::build(&scene, &[], 5.0).unwrap();
        (surface.voxel, surface.is_sharp)
    };
    let (exact, is_sharp) = built(0.0);
    assert!((0.15..0.2).contains(&exact) && is_sharp, "{exact}");
    // Along the rays, which are up to 1.6 times as long as the depth.
    let (noisy, is_sharp) = built(0.012);
    assert!(
        (1.0..1.6).contains(&(noisy / (20.0 * 0.012))) && !is_sharp,
        "{noisy}"
    );
    assert!(noisy < 1.9 * exact);
    let (very_noisy, _) = built(0.05);
    assert!((very_noisy / (2.0 * exact) - 1.0).abs() < 0.05, "{very_noisy}");
}

#[test]
fn hidden_pixels_have_no_node_and_no_label_whatever_is_said_of_them() {
    let mut scene = wall(3, 64, 48);
    // The middle of the second frame, where its neighbours know the wall, and where depth was measured.
    let is_hidden = |index: usize| (20..40).contains(&(index % 64)) && (10..30).contains(&(index / 64));
    hide(&mut scene.frames[1], is_hidden);
    let scene = Arc::new(scene);
    let mut history = clicked(&["dark", "bright"], &[(0, 1, [10, 20]), (0, 2, [50, 30])]);
    let before = propagated(&scene, history.labels());
    history.add_stroke(Stroke::click(1, 1, [30, 20]));
    let propagation = propagated(&scene, history.labels());
    let all: Vec<u32> = (0..64 * 48).collect();
    for frame in 0..3 {
        let map = propagation.map(&scene, frame, 1);
        let (nodes, entropy) = (propagation.surface().nodes_at(frame, &all), map.entropy());
        let map_before = before.map(&scene, frame, 1);
        assert_eq!(map.labels(), map_before.labels(), "frame {frame}");
        for index in 0..64 * 48 {
            let hidden = frame == 1 && is_hidden(index);
            assert_eq!(nodes[index].is_none(), hidden, "{frame} {index}");
            assert_eq!(map.labels()[index] == VOID, hidden, "{frame} {index}");
            assert!(!hidden || entropy[index] == 0);
        }
        let exact = summaries_are_near(&map, None);
        assert!((map.summary(None).unwrap().coverage - exact.coverage).abs() < 1e-6);
    }
}

/// Asserts that the summary of a map by its nodes is near that of its pixels; returns the latter.
fn summaries_are_near(map: &FrameMap, imported: Option<&ImportedMap>) -> FrameSummary {
    let summary = map.summary(imported).unwrap();
    let exact = map.looked_up().summary(imported).unwrap();
    for (near, exact) in [
        (summary.mean_entropy, exact.mean_entropy),
        (summary.coverage, exact.coverage),
        (summary.unclear, exact.unclear),
        (summary.disagreeing, exact.disagreeing),
    ] {
        assert!((near - exact).abs() < 0.03, "{near} instead of {exact}");
    }
    exact
}

#[test]
fn a_summary_by_nodes_is_near_that_of_the_pixels() {
    let scene = Arc::new(wall(5, 64, 48));
    let propagation = propagated(&scene, two_clicks().labels());
    let imported = ImportedMap::new(2, &[1; 64 * 48]);
    for frame in 0..5 {
        let map = propagation.map(&scene, frame, 1);
        let exact = summaries_are_near(&map, Some(&imported));
        let share = |count: usize| count as f32 / (64.0 * 48.0);
        let bright = map.labels().iter().filter(|&&label| label == 2).count();
        let confidence = map.confidence().unwrap();
        let unclear = confidence.iter().filter(|&&p| p < CERTAIN / 2).count();
        let entropy: f32 = map.entropy().iter().map(|&entropy| f32::from(entropy)).sum();
        let labelled = map.labels().iter().filter(|&&label| label != VOID).count();
        assert!((exact.mean_entropy - entropy / (64.0 * 48.0) / ENTROPY_STEPS_PER_NAT).abs() < 1e-5);
        assert!((exact.coverage - share(labelled)).abs() < 1e-6);
        assert!((exact.disagreeing - share(bright)).abs() < 1e-6);
        assert!((exact.unclear - share(unclear)).abs() < 1e-6);
    }
}
