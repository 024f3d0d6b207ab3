use std::sync::Arc;

use candle_core::{Device, Tensor, Var};
use candle_nn::ops::softmax;

use super::*;
use crate::field::{Ray, RenderedRay};
use crate::labels::LabelSet;
use crate::labels::testing::clicked;
use crate::scene::Scene;
use crate::scene::testing::{on_threads, wall};

const CPU: Device = Device::Cpu;

fn tensor(values: &[f32], shape: impl Into<candle_core::Shape>) -> Tensor {
    Tensor::from_slice(values, shape, &CPU).unwrap()
}

fn flat(tensor: &Tensor) -> Vec<f32> {
    tensor.flatten_all().unwrap().to_vec1().unwrap()
}

#[track_caller]
fn assert_close(values: &[f32], expected: &[f32]) {
    assert_eq!(values.len(), expected.len());
    for (value, expected) in values.iter().zip(expected) {
        assert!((value - expected).abs() < 1e-5, "{values:?}");
    }
}

/// Small enough to learn something in a moment.
const SMALL: ReferenceSettings = ReferenceSettings {
    layers: 4,
    width: 32,
    skip: 1,
    coarse_samples: 16,
    fine_samples: 16,
    rays: 64,
    slice: 64,
    chunk: 32,
    labelled_rays: 16,
    learning_rate: 5e-3,
    position_frequencies: 6,
    ..ReferenceSettings::PUBLISHED
};

fn two_clicks() -> LabelSet {
    let history = clicked(&["dark", "bright"], &[(0, 1, [10, 20]), (8, 2, [50, 30])]);
    history.labels().clone()
}

fn trainer(scene: &Arc<Scene>, settings: ReferenceSettings, labels: &LabelSet) -> ReferenceTrainer {
    let labels = PixelLabels::new(scene, labels);
    ReferenceTrainer::new(Arc::clone(scene), labels, settings, &CPU, 1).unwrap()
}

fn step(trainer: &mut ReferenceTrainer) {
    while !trainer.advance().unwrap() {}
}

fn parameters(trainer: &ReferenceTrainer) -> Vec<f32> {
    let named = trainer.field().named();
    named.iter().flat_map(|(_, var)| flat(var)).collect()
}

#[test]
fn the_encoding_is_the_input_then_sines_and_cosines_of_octaves() {
    let input = [0.5_f32, -1.0, 2.0];
    let encoded = positional_encoding(&tensor(&input, (1, 3)), 2).unwrap();
    let mut expected = input.to_vec();
    for octave in [1.0, 2.0] {
        expected.extend(input.map(|x| (octave * x).sin()));
        expected.extend(input.map(|x| (octave * x).cos()));
    }
    assert_close(&flat(&encoded), &expected);
}

#[test]
fn the_published_network_has_the_published_layers() {
    let network = ReferenceNetwork::new(&ReferenceSettings::PUBLISHED, 28, &CPU, 1).unwrap();
    let named = network.named();
    // Weights are kept in parts, cut along the outputs.
    let shape = |name: &str| {
        let parts = named.iter().filter(|(known, _)| known.starts_with(name));
        let shapes: Vec<&[usize]> = parts.map(|(_, var)| var.dims()).collect();
        [shapes[0][0], shapes.iter().map(|shape| shape[1]).sum()]
    };
    for (name, expected) in [
        ("trunk.0.weight", [63, 256]),
        ("trunk.4.weight", [256, 256]),
        ("trunk.5.weight", [256 + 63, 256]),
        ("trunk.7.weight", [256, 256]),
        ("density.weight", [256, 1]),
        ("feature.weight", [256, 256]),
        ("view.weight", [256 + 27, 128]),
        ("color.weight", [128, 3]),
        ("semantic.0.weight", [256, 128]),
        ("semantic.1.weight", [128, 28]),
    ] {
        assert_eq!(shape(name), expected, "{name}");
    }
    assert!(!named.iter().any(|(name, _)| name.starts_with("trunk.8")));
    assert_eq!(ReferenceSettings::PUBLISHED.evaluations_per_ray(), 64 + 64 + 128);
}

#[test]
fn density_and_classes_do_not_depend_on_the_direction_and_colour_does() {
    let network = ReferenceNetwork::new(&SMALL, 3, &CPU, 1).unwrap();
    let encode = |x: &[f32], frequencies| positional_encoding(&tensor(x, (1, 3)), frequencies).unwrap();
    let position = encode(&[0.1, 0.2, 0.3], SMALL.position_frequencies);
    let said = |direction: &[f32]| {
        let direction = encode(direction, SMALL.direction_frequencies);
        network.forward(&position, &direction, false).unwrap()
    };
    let (a, b) = (said(&[1.0, 0.0, 0.0]), said(&[0.0, 1.0, 0.0]));
    assert_eq!(flat(&a.raw_density), flat(&b.raw_density));
    assert_eq!(flat(&a.logits.unwrap()), flat(&b.logits.unwrap()));
    assert_ne!(flat(&a.color), flat(&b.color));
}

#[test]
fn weights_are_transmittance_times_alpha_with_finite_gradients() {
    // sigma delta = 0.5, 1 and far more than anything passes.
    let density = Var::from_tensor(&tensor(&[1.0, 4.0, 2.0], (1, 3))).unwrap();
    let deltas = tensor(&[0.5, 0.25, 1e10], (1, 3));
    let weights = ray_weights(&density, &deltas).unwrap();
    let passed = [1.0, (-0.5_f32).exp(), (-1.5_f32).exp(), 0.0];
    let expected: Vec<f32> = passed.windows(2).map(|pair| pair[0] - pair[1]).collect();
    assert_close(&flat(&weights), &expected);
    // Also where the endless last sample is empty.
    density.set(&tensor(&[0.0, 5.0, 0.0], (1, 3))).unwrap();
    let weights = ray_weights(&density, &deltas).unwrap();
    let gradients = weights.sqr().unwrap().sum_all().unwrap().backward().unwrap();
    let gradient = flat(gradients.get(&density).unwrap());
    assert!(gradient.iter().all(|g| g.is_finite()), "{gradient:?}");
}

#[test]
fn colours_and_logits_are_composited_before_the_softmax() {
    let weights = tensor(&[0.25, 0.5], (1, 2));
    let colors = tensor(&[1.0, 0.0, 0.4, 0.2, 1.0, 0.0], (1, 2, 3));
    assert_close(&flat(&composite(&weights, &colors).unwrap()), &[0.35, 0.5, 0.1]);

    let logits = tensor(&[4.0, 0.0, 0.0, 2.0], (1, 2, 2));
    let composited = composite(&weights, &logits).unwrap();
    assert_close(&flat(&composited), &[1.0, 1.0]);
    // The softmax of each sample, composited, would favour the second class.
    assert_close(&flat(&softmax(&composited, 1).unwrap()), &[0.5, 0.5]);
}

#[test]
fn entropy_is_in_nats() {
    let logits = tensor(
        &[7.0, 7.0, 7.0, 0.0, 0.0, 100.0, 0.0, (3.0_f32).ln(), -100.0],
        (3, 3),
    );
    let quarter = -(0.25_f32 * 0.25_f32.ln() + 0.75 * 0.75_f32.ln());
    assert_close(&flat(&entropy(&logits).unwrap()), &[3.0_f32.ln(), 0.0, quarter]);
}

#[test]
fn the_photometric_loss_of_chunks_adds_up_to_the_mean_squared_error() {
    let color = tensor(&[0.5, 0.5, 0.5, 1.0, 0.0, 0.0], (2, 3));
    let truth = tensor(&[0.0, 0.5, 1.0, 1.0, 1.0, 0.0], (2, 3));
    let share = |from: usize, count: usize| {
        let [color, truth] = [&color, &truth].map(|t| t.narrow(0, from, count).unwrap());
        flat(&photometric(&color, &truth, 2).unwrap())[0]
    };
    assert_close(&[share(0, 2)], &[1.5 / 6.0]);
    assert_close(&[share(0, 1) + share(1, 1)], &[1.5 / 6.0]);
}

#[test]
fn rays_without_a_label_do_not_count_in_the_semantic_loss() {
    let logits = tensor(&[0.0, (3.0_f32).ln(), 50.0, -50.0, 0.0, 0.0], (3, 2));
    let loss = |classes: &[Option<u32>], labelled| {
        semantic(&logits, classes, labelled)
            .unwrap()
            .map(|loss| flat(&loss)[0])
    };
    let expected = 0.5 * (-(0.75_f32.ln()) - 0.5_f32.ln());
    assert_close(&[loss(&[Some(1), None, Some(0)], 2).unwrap()], &[expected]);
    // As shares of a batch in which one more ray is labelled.
    assert_close(
        &[loss(&[Some(1), None, Some(0)], 3).unwrap()],
        &[2.0 / 3.0 * expected],
    );
    assert!(loss(&[None, None, None], 0).is_none());
}

#[test]
fn the_inverse_cdf_follows_a_known_histogram() {
    let edges = [0.0, 1.0, 2.0, 4.0];
    let weights = [1.0, 0.0, 3.0];
    let quantiles = [0.0, 0.125, 0.25 + 0.75 / 2.0, 1.0];
    let samples = inverse_cdf(&edges, &weights, quantiles.into_iter());
    for (sample, expected) in samples.iter().zip([0.0, 0.5, 3.0, 4.0]) {
        assert!((sample - expected).abs() < 1e-4, "{samples:?}");
    }
    // An empty one is sampled evenly.
    let samples = inverse_cdf(&[0.0, 1.0, 2.0], &[0.0, 0.0], [0.0, 0.25, 0.5, 0.75].into_iter());
    for (sample, expected) in samples.iter().zip([0.0, 0.5, 1.0, 1.5]) {
        assert!((sample - expected).abs() < 1e-4, "{samples:?}");
    }
    // Many quantiles: a quarter in the first bin, the rest in the last.
    let many = inverse_cdf(&edges, &weights, (0..1000).map(|k| (k as f32 + 0.5) / 1000.0));
    let first = many.iter().filter(|&&t| t < 1.0).count();
    assert!((249..=251).contains(&first), "{first}");
    assert!(many.iter().filter(|&&t| (1.001..1.999).contains(&t)).count() <= 1);
}

#[test]
fn stratified_samples_stay_between_the_middles_of_their_neighbours() {
    assert_close(&stratified(1.0, 3.0, 3, None), &[1.0, 2.0, 3.0]);
    let mut low = || 0.0;
    assert_close(&stratified(1.0, 3.0, 3, Some(&mut low)), &[1.0, 1.5, 2.5]);
    let mut half = || 0.5;
    assert_close(&stratified(1.0, 3.0, 3, Some(&mut half)), &[1.25, 2.0, 2.75]);
}

#[test]
fn the_fine_network_sees_the_coarse_samples_and_its_own() {
    let scene = Arc::new(wall(9, 64, 48));
    let field = ReferenceField::new(&scene, SMALL, 2, &CPU, 1).unwrap();
    let ray = Ray::through(&scene.frames[0], 7);
    let [coarse, fine] = field.forward(&[ray], None).unwrap();
    assert_eq!(coarse.t.len(), 16);
    assert_eq!(fine.t.len(), 32);
    assert!(fine.t.windows(2).all(|pair| pair[0] <= pair[1]));
    assert!(coarse.t.iter().all(|t| fine.t.contains(t)));
    assert_eq!(fine.logits.unwrap().dims(), [1, 2]);
    assert_close(&[coarse.t[0], coarse.t[15]], &[0.1, field.far()]);
}

#[test]
fn a_step_does_not_depend_on_how_it_is_cut_nor_on_the_number_of_threads() {
    let scene = Arc::new(wall(9, 64, 48));
    let after = |slice, chunk| {
        let settings = ReferenceSettings {
            slice,
            chunk,
            ..SMALL
        };
        let mut trainer = trainer(&scene, settings, &two_clicks());
        step(&mut trainer);
        parameters(&trainer)
    };
    let (whole, small) = (after(64, 64), after(7, 2));
    let before = parameters(&trainer(&scene, SMALL, &two_clicks()));
    let far = |a: &[f32], b: &[f32], gap: f32| a.iter().zip(b).filter(|(a, b)| (*a - *b).abs() > gap).count();
    assert!(far(&whole, &before, 1e-3) > 0);
    // Adam's first step has the sign of the gradient: where that is as good as zero, rounding decides.
    let differ = far(&whole, &small, 1e-4);
    assert!(differ * 100 < whole.len(), "{differ} of {}", whole.len());
    assert_eq!(whole, on_threads(1, || after(64, 64)));
}

#[test]
fn a_small_network_learns_the_colours_and_the_classes_of_a_wall() {
    let scene = Arc::new(wall(9, 64, 48));
    let mut trainer = trainer(&scene, SMALL, &two_clicks());
    let error = |trainer: &ReferenceTrainer| {
        let pixels = trainer.held_out().fewer(128);
        let rendered = trainer.field().render(&pixels.rays(&scene)).unwrap();
        let seen: Vec<RenderedRay> = rendered.iter().map(|ray| ray.seen).collect();
        pixels.error(&seen, &scene).unwrap().psnr
    };
    let before = error(&trainer);
    for _ in 0..150 {
        step(&mut trainer);
    }
    let after = error(&trainer);
    assert!(after > before + 6.0 && after > 15.0, "{before} dB to {after} dB");
    // The two clicked pixels, and two far from the border in a frame without clicks.
    let cases = [
        (0, 20 * 64 + 10, 0),
        (8, 30 * 64 + 50, 1),
        (4, 24 * 64 + 10, 0),
        (4, 24 * 64 + 52, 1),
    ];
    for (frame, pixel, class) in cases {
        let ray = Ray::through(&scene.frames[frame], pixel);
        let said = &trainer.field().render(&[ray]).unwrap()[0];
        assert!(said.probabilities[class] > 0.8, "{said:?}");
        assert!(said.entropy < 0.5, "{said:?}");
    }
}

#[test]
fn a_saved_state_comes_back_and_a_foreign_one_changes_nothing() {
    let scene = Arc::new(wall(9, 64, 48));
    let mut first = trainer(&scene, SMALL, &two_clicks());
    step(&mut first);
    let state = first.state().unwrap();
    let mut second = trainer(&scene, SMALL, &two_clicks());
    second.restore(&state, 1).unwrap();
    assert_eq!(parameters(&first), parameters(&second));
    assert_eq!(second.steps(), 1);

    let mut without_classes = trainer(&scene, SMALL, &LabelSet::default());
    let before = parameters(&without_classes);
    let mut wider = trainer(&scene, ReferenceSettings { width: 16, ..SMALL }, &two_clicks());
    assert!(wider.restore(&state, 1).is_err());
    without_classes.restore(&state, 1).unwrap();
    assert_ne!(before, parameters(&without_classes));
}
