use std::collections::BTreeMap;

use clap::Parser;

use super::*;
use crate::arguments::Arguments;
use crate::testing::parsed;
use inplace_core::scene::demo::Shot;

#[test]
fn an_exponent_is_that_of_the_upper_half_where_that_varies() {
    let powers = |floor: f64| -> Vec<(f64, f64)> {
        let power = |x: f64| (x, (2.0 * x.powf(1.5)).max(floor));
        [10.0, 100.0, 1e3, 1e4, 1e5].map(power).to_vec()
    };
    let fitted = fit(powers(0.0)).unwrap();
    assert!((fitted.0 - 1.5).abs() < 1e-12, "{fitted:?}");
    assert_eq!((fitted.1, fitted.2), ([1e3, 1e5], 3));
    // Whatever is fixed below.
    assert_eq!(fit(powers(2.0 * 1e3_f64.powf(1.5))), Some(fitted));

    assert_eq!(fit(vec![]), None);
    assert_eq!(fit(vec![(2.0, 1.0), (2.0, 3.0)]), None);
    let without_logarithm = vec![(1.0, 2.0), (0.0, 5.0), (4.0, f64::NAN), (4.0, 8.0), (9.0, 0.0)];
    let fitted = fit(without_logarithm).unwrap();
    assert!((fitted.0 - 1.0).abs() < 1e-12 && fitted.2 == 2, "{fitted:?}");
}

#[test]
fn a_sweep_changes_one_thing() {
    let words = "--out x --frames 200,100,200 --sizes 160x120 --rooms 1,4 --classes 2,200 --strokes 1";
    let values = parsed(words);
    let of = |sweep: Sweep| Vec::from_iter(sweep.settings(USUAL, &values));
    let with = |frames| Setting { frames, ..USUAL };
    assert_eq!(of(Sweep::Frames), [with(100), with(200)]);
    let (width, height) = (160, 120);
    assert_eq!(
        of(Sweep::Size),
        [Setting {
            width,
            height,
            ..USUAL
        }]
    );
    // Each of the most classes has a stroke, with the fewest classes too.
    let counts = of(Sweep::Classes)
        .into_iter()
        .map(|own| (own.classes, own.strokes));
    assert_eq!(Vec::from_iter(counts), [(2, 200), (200, 200)]);
    let unknown = Arguments::try_parse_from("lab bench scale --out x --sweep walls".split(' '));
    let error = unknown.unwrap_err().to_string();
    assert!(error.contains("frames, size, rooms, classes, strokes"), "{error}");
}

#[test]
fn strokes_are_random_true_pixels_with_one_of_every_class_first() {
    let shot = Shot::new(6, [64, 48]);
    let scene = shot.scene(&|_, _| {});
    let truth = shot.labels();
    let labels = scattered(&scene, &truth, 12, 40, 3).unwrap();
    assert_eq!((labels.classes.len(), labels.strokes.len()), (12, 40));
    let clicks: Vec<_> = labels.strokes.values().collect();
    let first: BTreeSet<_> = clicks[..12].iter().map(|stroke| stroke.class).collect();
    assert_eq!(first, (1..=12).collect());
    let places = clicks.iter().map(|stroke| (stroke.frame, stroke.first_point()));
    assert_eq!(places.collect::<BTreeSet<_>>().len(), 40, "no pixel twice");

    // Whatever is in one cell and of one true class is of one class.
    let mut class_of = BTreeMap::new();
    for stroke in scattered(&scene, &truth, 12, 4000, 4).unwrap().strokes.values() {
        let frame = &scene.frames[stroke.frame];
        let [x, y] = stroke.first_point().unwrap();
        let at = (y * 64 + x) as usize;
        let place = frame.center() + frame.ray_length(at).unwrap() * frame.ray_direction(at);
        let cell = ((place + 0.17) / 0.5).floor().to_array().map(|cell| cell as i32);
        let piece = (truth(stroke.frame)[at], cell);
        let class = class_of.entry(piece).or_insert(stroke.class);
        assert_eq!(*class, stroke.class, "{cell:?}");
    }
    assert!(class_of.len() > 100);
    assert_eq!(scattered(&scene, &truth, 12, 40, 3).unwrap(), labels);
    assert_ne!(scattered(&scene, &truth, 12, 40, 4).unwrap(), labels);
}

#[test]
fn a_scene_that_shows_too_little_is_refused_with_a_sentence() {
    let shot = Shot::new(2, [16, 16]);
    let scene = shot.scene(&|_, _| {});
    for (classes, strokes) in [(5000, 10), (2, 100_000)] {
        let refused = scattered(&scene, &shot.labels(), classes, strokes, 0).unwrap_err();
        assert!(refused.to_string().contains("there are too few "), "{refused}");
    }
}
