use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use rand::{Rng, SeedableRng, rngs::SmallRng};

use super::*;
use crate::labels::testing::{Click, clicked};
use crate::labels::{LabelSet, rasterise};
use crate::scene::testing::wall;
use crate::semantics::LabelPropagation;
use crate::semantics::testing::{propagated, surface};

/// The classes that labels spread from.
fn sources(propagation: &LabelPropagation, scene: &Scene) -> BTreeSet<ClassId> {
    let validation = propagation.cross_validation(&Arc::new(scene.clone()));
    let seeds = validation.geodesics.seeds().values();
    seeds.map(|label| label.class).collect()
}

/// What the strokes say of one by spreading the others anew: its class by them, and the share that contradicts it.
fn naively(
    scene: &Scene,
    propagation: &LabelPropagation,
    labels: &LabelSet,
    id: StrokeId,
) -> Option<(ClassId, f32)> {
    let stroke = &labels.strokes[&id];
    let mut others = labels.clone();
    others.strokes.remove(&id);
    let mut anew = LabelPropagation::new(Arc::clone(propagation.surface()));
    anew.set_labels(scene, &others);
    let camera = &scene.frames[stroke.frame].camera;
    let visible = rasterise(labels, stroke.frame, camera.width, camera.height);
    let own = visible.iter().filter(|(_, (_, top))| *top == id);
    let own: Vec<u32> = own.map(|&(pixel, _)| pixel).collect();
    let nodes = propagation.surface().nodes_at(stroke.frame, &own);
    let said = nodes.into_iter().flatten();
    let said = said.map(|node| anew.posterior().labels[node as usize]);
    let said: Vec<ClassId> = said.filter(|&class| class != VOID).collect();
    // Its class is in no other label.
    let known = sources(&anew, scene).contains(&stroke.class);
    if said.is_empty() || !known || stroke.class == VOID {
        return None;
    }
    let other = said.iter().filter(|&&class| class != stroke.class);
    let share = other.clone().count() as f32 / said.len() as f32;
    let most = other.max_by_key(|&&class| {
        let count = said.iter().filter(|&&c| c == class).count();
        (count, std::cmp::Reverse(class))
    });
    let class = if share > 0.5 { *most.unwrap() } else { stroke.class };
    Some((class, share))
}

#[test]
fn strokes_are_checked_as_if_the_others_were_spread_without_them() {
    let scene = Arc::new(wall(5, 64, 48));
    let surface = surface(&scene);
    let mut rng = SmallRng::seed_from_u64(3);
    let (mut contradicted, mut checked) = (0, 0);
    for _ in 0..12 {
        let mut history = clicked(&["dark", "bright", "rest"], &[]);
        let point = |rng: &mut SmallRng| [rng.random_range(4..60), rng.random_range(4..44)];
        for _ in 0..rng.random_range(2..14) {
            // Near each other and wide, so that they cover each other's pixels and voxels.
            history.add_stroke(Stroke {
                frame: rng.random_range(0..3),
                class: rng.random_range(0..4),
                object: None,
                radius: rng.random_range(0..4),
                lines: vec![vec![point(&mut rng), point(&mut rng)]],
            });
        }
        let labels = history.labels();
        let mut propagation = LabelPropagation::new(Arc::clone(&surface));
        propagation.set_labels(&scene, labels);
        let validation = propagation.cross_validation(&scene);
        let checks = validation.run(&AtomicBool::new(false)).unwrap();
        if sources(&propagation, &scene).len() < 2 {
            assert!(checks.strokes.is_empty());
            continue;
        }
        let naive: Vec<StrokeCheck> = labels
            .strokes
            .keys()
            .filter_map(|&stroke| {
                let (class, contradicting) = naively(&scene, &propagation, labels, stroke)?;
                Some(StrokeCheck {
                    stroke,
                    class,
                    contradicting,
                })
            })
            .collect();
        assert_eq!(checks.strokes, naive);
        contradicted += naive.iter().filter(|check| check.is_contradicted()).count();
        checked += naive.len();
    }
    // The cases say something: there is some of both.
    let has_both = contradicted > 5 && checked - contradicted > 5;
    assert!(has_both, "{contradicted} of {checked}");
}

#[test]
fn a_stroke_alone_in_its_class_is_not_checked_and_a_wrong_one_is_found() {
    let scene = Arc::new(wall(5, 64, 48));
    let mut clicks: Vec<Click> = vec![
        (0, 1, [8, 10]),
        (0, 1, [10, 30]),
        (4, 2, [55, 30]),
        (4, 2, [52, 26]),
        (4, 3, [50, 6]),
    ];
    let check = |clicks: &[Click]| {
        let history = clicked(&["dark", "bright", "lamp"], clicks);
        let propagation = propagated(&scene, history.labels());
        let validation = propagation.cross_validation(&scene);
        assert_eq!(validation.clone().run(&AtomicBool::new(true)), None);
        validation.run(&AtomicBool::new(false)).unwrap()
    };
    let checks = check(&clicks);
    assert_eq!(checks.accuracy, Some(1.0));
    let checked: Vec<u64> = checks.strokes.iter().map(|check| check.stroke.0).collect();
    assert_eq!(checked, [1, 2, 3, 4]);
    // Among the dark ones, and called bright.
    clicks.push((0, 2, [9, 20]));
    let checks = check(&clicks);
    let wrong = checks.strokes.iter().find(|check| check.stroke == StrokeId(6));
    let said = wrong.map(|check| (check.class, check.contradicting));
    assert_eq!(said, Some((1, 1.0)));
    // The mean over the classes: all dark ones are right or not, two of three bright ones are.
    let right = |ids: [u64; 2]| {
        let strokes = checks.strokes.iter();
        let of = strokes.filter(|check| ids.contains(&check.stroke.0));
        of.filter(|check| !check.is_contradicted()).count() as f32
    };
    let expected = 0.5 * (right([1, 2]) / 2.0 + right([3, 4]) / 3.0);
    assert!((checks.accuracy.unwrap() - expected).abs() < 1e-6);
}
