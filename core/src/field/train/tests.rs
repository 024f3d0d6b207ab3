use candle_core::DType;

use super::*;
use crate::field::RenderedRay;
use crate::scene::testing::{hide, wall, without_depth};
use crate::scene::{OpenOptions, SceneSource};

fn error(trainer: &Trainer) -> HeldOut {
    trainer.evaluate().unwrap().unwrap()
}

/// A trainer of a small wall after some steps.
fn trained(backend: Backend, depth: bool, steps: u64) -> Trainer {
    let measured = wall(9, 24, 18);
    let scene = Arc::new(if depth { measured } else { without_depth(measured) });
    let preset = (Preset::Fast, 1.0);
    let mut trainer = Trainer::on(backend, scene, preset, Recipe::default(), 3).unwrap();
    for _ in 0..steps {
        trainer.step().unwrap();
    }
    trainer
}

#[test]
fn plain_ops_train_a_scene_as_the_fused_kernels_do() {
    for (depth, steps) in [(true, 10), (false, 4)] {
        let plain = error(&trained(Backend::Plain, depth, steps));
        let start = error(&trained(Backend::default(), depth, 0));
        let fused = error(&trained(Backend::default(), depth, steps));
        assert!(fused.psnr > start.psnr + 0.2, "{start:?} {fused:?}");
        assert!((plain.psnr - fused.psnr).abs() < 0.1, "{plain:?} {fused:?}");
        assert_eq!(plain.depth_error.is_some(), depth);
        if let (Some(plain), Some(fused)) = (plain.depth_error, fused.depth_error) {
            // Infinite on both where nothing is opaque yet.
            assert!(plain == fused || (plain - fused).abs() < 0.02, "{plain} {fused}");
        }
    }
}

#[test]
fn a_state_saved_on_one_path_goes_on_training_on_the_other() {
    let plain = trained(Backend::Plain, true, 5);
    let mut fused = trained(Backend::default(), true, 0);
    fused.restore(&plain.state().unwrap(), plain.steps()).unwrap();
    assert!((error(&plain).psnr - error(&fused).psnr).abs() < 1e-3);
    fused.step().unwrap();
    assert_eq!((fused.steps(), fused.skipped()), (6, 0));
}

#[test]
fn two_halves_make_a_step_and_a_state_is_one_between_steps() {
    let (mut whole, mut halved) = (
        trained(Backend::default(), true, 2),
        trained(Backend::default(), true, 1),
    );
    assert!(!halved.half_step().unwrap());
    assert_eq!(halved.steps(), 1);
    let begun = halved.state().unwrap();
    assert!(halved.half_step().unwrap());
    assert_eq!((halved.steps(), error(&halved)), (2, error(&whole)));
    // What was begun before a state is taken over is not learnt from after it.
    whole.half_step().unwrap();
    whole.restore(&begun, 1).unwrap();
    assert_eq!(error(&whole), error(&trained(Backend::default(), true, 1)));
    assert!(!whole.half_step().unwrap());
}

#[test]
fn growing_changes_nothing_that_is_rendered_and_a_grown_state_is_taken_over() {
    for backend in [Backend::Plain, Backend::default()] {
        let mut grown = trained(backend, true, 3);
        let before = error(&grown);
        grown.capacity.most_log2 = grown.capacity.table_log2 + 1;
        grown.grow().unwrap();
        assert!(grown.field.parameters() > trained(backend, true, 0).field.parameters());
        assert_eq!(error(&grown), before);
        for _ in 0..3 {
            grown.step().unwrap();
        }
        let mut other = trained(backend, true, 0);
        assert!(other.restore(&grown.state().unwrap(), grown.steps()).is_err());
        other.capacity.most_log2 = grown.capacity.table_log2;
        other.restore(&grown.state().unwrap(), grown.steps()).unwrap();
        assert_eq!(other.capacity.table_log2, grown.capacity.table_log2);
        assert_eq!(error(&other), error(&grown));
    }
}

#[test]
fn a_collapsed_field_comes_back_and_goes_on_more_slowly() {
    let mut trainer = trained(Backend::default(), true, 250);
    let good = error(&trainer);
    for _ in 0..250 {
        // Whatever it learns is wiped out: the collapse lasts until it is noticed.
        let zeros = trainer.field.weights().zeros_like().unwrap();
        trainer.field.weights().set(&zeros).unwrap();
        trainer.step().unwrap();
    }
    let back = error(&trainer);
    assert_eq!((trainer.undone(), trainer.rate_scale), (1, 0.5));
    assert!((back.psnr - good.psnr).abs() < 1e-3, "{good:?} {back:?}");
}

#[test]
fn steps_that_are_not_finite_change_nothing_and_are_undone_when_they_repeat() {
    let mut trainer = trained(Backend::default(), true, 2);
    let weights = trainer.field.weights().clone();
    let broken = (weights.as_tensor() * f64::NAN).unwrap();
    weights.set(&broken).unwrap();
    for _ in 0..u64::from(PATIENCE) {
        trainer.step().unwrap();
    }
    assert_eq!((trainer.skipped(), trainer.undone()), (u64::from(PATIENCE), 1));
    let values: Vec<f32> = weights.to_vec1().unwrap();
    assert!(values.iter().all(|value| value.is_finite()));
}

#[test]
fn the_error_of_colours_that_are_no_numbers_is_none() {
    let scene = wall(9, 24, 18);
    let (held_out, _) = HeldOutPixels::split(&scene, 3);
    let broken = RenderedRay {
        color: glam::Vec3::NAN,
        ..RenderedRay::default()
    };
    let rendered = vec![broken; held_out.rays(&scene).len()];
    assert!(held_out.error(&rendered, &scene).unwrap().psnr.is_nan());
}

#[test]
fn a_frame_whose_camera_is_lost_is_neither_trained_on_nor_held_out() {
    let mut scene = wall(40, 24, 18);
    let (held_out, _) = HeldOutPixels::split(&scene, 3);
    assert_eq!(held_out.rays(&scene)[0].origin, scene.frames[10].center());
    scene.frames[10].camera_to_world.translation.x += 500.0;
    let (held_out, trained_on) = HeldOutPixels::split(&scene, 3);
    assert!(trained_on.len() == 38 && !trained_on.contains(&10));
    assert!(held_out.rays(&scene).iter().all(|ray| ray.origin.x < 1.0));
}

#[test]
fn a_batch_whose_pixels_are_all_hidden_spoils_nothing() {
    let mut scene = wall(3, 24, 18);
    scene.frames.iter_mut().for_each(|frame| hide(frame, |_| true));
    let preset = (Preset::Fast, 1.0);
    let mut trainer = Trainer::on(Backend::Plain, Arc::new(scene), preset, Recipe::default(), 3).unwrap();
    trainer.step().unwrap();
    assert!(trainer.samples_per_ray().is_finite());
}

#[test]
fn a_spoilt_state_is_refused_and_changes_nothing() {
    let mut trainer = trained(Backend::Plain, true, 0);
    trainer.capacity.most_log2 = trainer.capacity.table_log2 + 1;
    let mut grown = trained(Backend::Plain, true, 0);
    grown.capacity.most_log2 = grown.capacity.table_log2 + 1;
    grown.grow().unwrap();
    let zeros = |shape: &[usize], kind| Tensor::zeros(shape, kind, &Device::Cpu).unwrap();
    let weights = grown.field.weights().dims();
    for (name, spoilt) in [
        ("field.table", zeros(&[], DType::F32)),
        ("field.table", zeros(&[0, 0], DType::F32)),
        (
            "field.table",
            zeros(&[grown.field.table().dims()[0], 3], DType::F32),
        ),
        ("field.table", zeros(grown.field.table().dims(), DType::F64)),
        ("field.weights", zeros(&[3], DType::F32)),
        ("field.weights", zeros(weights, DType::U32)),
        ("occupancy", zeros(&[4], DType::U8)),
        ("volume", zeros(&[4], DType::F32)),
    ] {
        let mut state = grown.state().unwrap();
        state.insert(name.to_owned(), spoilt);
        let weights_of = |trainer: &Trainer| trainer.field.weights().to_vec1::<f32>().unwrap();
        let before = (trainer.capacity, weights_of(&trainer));
        assert!(trainer.restore(&state, 5).is_err(), "{name}");
        assert!(before == (trainer.capacity, weights_of(&trainer)), "{name}");
        assert_eq!(trainer.steps(), 0, "{name}");
    }
    trainer.restore(&grown.state().unwrap(), 5).unwrap();
    assert_eq!(trainer.capacity.table_log2, grown.capacity.table_log2);
}

#[test]
fn no_picture_before_each_camera_takes_the_place_of_the_scene() {
    let open = |depth| {
        let options = OpenOptions {
            depth,
            ..OpenOptions::default()
        };
        Arc::new(Scene::open(&SceneSource::Demo, options, &|_, _| {}).unwrap())
    };
    let (truth, scene) = (open(true), open(false));
    // Fields of these seeds did so when rays were sampled up to their cameras from the first step on.
    for (preset, seed) in [(Preset::Auto, 8), (Preset::Accurate, 0)] {
        let mut trainer = Trainer::new(Arc::clone(&scene), preset, seed).unwrap();
        for _ in 0..150 {
            trainer.step().unwrap();
        }
        let error = trainer.evaluate_against(&truth).unwrap().unwrap();
        assert!(error.relative_depth_error.unwrap() < 0.5, "{preset:?}: {error:?}");
    }
}

#[test]
fn a_field_that_ended_before_its_time_has_ended_when_it_is_taken_up_again() {
    let mut trainer = trained(Backend::default(), true, 2);
    trainer.schedule.restore((100, 0.5));
    trainer.steps = 700;
    assert!(trainer.settled());
    let (state, mut again) = (trainer.state().unwrap(), trained(Backend::default(), true, 0));
    again.restore(&state, 700).unwrap();
    assert!(again.settled());
    let mut without = state.clone();
    without.remove("cooling");
    let mut other = trained(Backend::default(), true, 0);
    other.restore(&without, 700).unwrap();
    assert!(!other.settled());
}
