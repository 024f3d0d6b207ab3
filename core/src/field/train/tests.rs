use super::*;
use crate::field::kernels::Dispatch;
use crate::scene::testing::wall;
use crate::scene::{OpenOptions, SceneSource};

/// A trainer of a small wall after some steps.
fn trained(backend: &Backend, depth: bool, steps: u64) -> Trainer {
    let mut scene = wall(9, 24, 18);
    if !depth {
        for frame in &mut scene.frames {
            frame.set_depth(None);
        }
    }
    let mut trainer = Trainer::on(backend, Arc::new(scene), Preset::Fast, Recipe::default(), 3).unwrap();
    for _ in 0..steps {
        trainer.step().unwrap();
    }
    trainer
}

#[test]
fn plain_ops_train_a_scene_as_the_fused_kernels_do() {
    for (depth, steps) in [(true, 10), (false, 4)] {
        let plain = trained(&Backend::Plain(Device::Cpu), depth, steps);
        let fused = trained(&Backend::Fused(Dispatch::detect()), depth, steps);
        let (plain, fused) = (
            plain.evaluate().unwrap().unwrap(),
            fused.evaluate().unwrap().unwrap(),
        );
        let start = trained(&Backend::Fused(Dispatch::detect()), depth, 0);
        let start = start.evaluate().unwrap().unwrap();
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
    let plain = trained(&Backend::Plain(Device::Cpu), true, 5);
    let mut fused = trained(&Backend::Fused(Dispatch::detect()), true, 0);
    fused.restore(&plain.state().unwrap(), plain.steps()).unwrap();
    let (a, b) = (
        plain.evaluate().unwrap().unwrap(),
        fused.evaluate().unwrap().unwrap(),
    );
    assert!((a.psnr - b.psnr).abs() < 1e-3);
    fused.step().unwrap();
    assert_eq!((fused.steps(), fused.skipped()), (6, 0));
}

#[test]
fn growing_changes_nothing_that_is_rendered_and_a_grown_state_is_taken_over() {
    for backend in [Backend::Plain(Device::Cpu), Backend::Fused(Dispatch::detect())] {
        let mut grown = trained(&backend, true, 3);
        let before = grown.evaluate().unwrap().unwrap();
        grown.capacity.most_log2 = grown.capacity.table_log2 + 1;
        grown.grow().unwrap();
        assert!(grown.field.parameters() > trained(&backend, true, 0).field.parameters());
        assert_eq!(grown.evaluate().unwrap().unwrap(), before);
        for _ in 0..3 {
            grown.step().unwrap();
        }
        let mut other = trained(&backend, true, 0);
        assert!(other.restore(&grown.state().unwrap(), grown.steps()).is_err());
        other.capacity.most_log2 = grown.capacity.table_log2;
        other.restore(&grown.state().unwrap(), grown.steps()).unwrap();
        assert_eq!(other.capacity.table_log2, grown.capacity.table_log2);
        assert_eq!(other.evaluate().unwrap(), grown.evaluate().unwrap());
    }
}

#[test]
fn a_collapsed_field_comes_back_and_goes_on_more_slowly() {
    let mut trainer = trained(&Backend::Fused(Dispatch::detect()), true, 250);
    let good = trainer.evaluate().unwrap().unwrap();
    trainer
        .field
        .weights()
        .set(&trainer.field.weights().zeros_like().unwrap())
        .unwrap();
    for _ in 0..250 {
        trainer.step().unwrap();
        // Whatever it learns meanwhile is wiped out: the collapse lasts until it is noticed.
        if trainer.steps() < 500 {
            let zeros = trainer.field.weights().zeros_like().unwrap();
            trainer.field.weights().set(&zeros).unwrap();
        }
    }
    let back = trainer.evaluate().unwrap().unwrap();
    assert_eq!((trainer.undone(), trainer.rate_scale), (1, 0.5));
    assert!((back.psnr - good.psnr).abs() < 1e-3, "{good:?} {back:?}");
}

#[test]
fn steps_that_are_not_finite_change_nothing_and_are_undone_when_they_repeat() {
    let mut trainer = trained(&Backend::Fused(Dispatch::detect()), true, 2);
    let weights = trainer.field.weights().clone();
    let broken = (weights.as_tensor() * f64::NAN).unwrap();
    weights.set(&broken).unwrap();
    for _ in 0..u64::from(PATIENCE) {
        trainer.step().unwrap();
    }
    assert_eq!((trainer.skipped(), trainer.undone()), (u64::from(PATIENCE), 1));
    let sum = weights
        .sqr()
        .unwrap()
        .sum_all()
        .unwrap()
        .to_scalar::<f32>()
        .unwrap();
    assert!(sum.is_finite());
}

#[test]
fn a_spoilt_state_is_refused_and_changes_nothing() {
    let mut trainer = trained(&Backend::Plain(Device::Cpu), true, 0);
    trainer.capacity.most_log2 = trainer.capacity.table_log2 + 1;
    let mut grown = trained(&Backend::Plain(Device::Cpu), true, 0);
    grown.capacity.most_log2 = grown.capacity.table_log2 + 1;
    grown.grow().unwrap();
    let numbers = |value: f32, shape: &[usize]| Tensor::full(value, shape, &Device::Cpu).unwrap();
    let weights = grown.field.weights().dims().to_vec();
    let double = grown.field.table().to_dtype(candle_core::DType::F64).unwrap();
    for (name, spoilt) in [
        ("field.table", numbers(0.5, &[])),
        ("field.table", numbers(0.5, &[0, 0])),
        ("field.table", double),
        ("field.weights", numbers(0.5, &[3])),
        (
            "field.weights",
            Tensor::zeros(weights, candle_core::DType::U32, &Device::Cpu).unwrap(),
        ),
        (
            "occupancy",
            Tensor::zeros(4, candle_core::DType::U8, &Device::Cpu).unwrap(),
        ),
    ] {
        let mut state = grown.state().unwrap();
        state.insert(name.to_owned(), spoilt);
        let before = (
            trainer.capacity,
            trainer.field.weights().to_vec1::<f32>().unwrap(),
        );
        assert!(trainer.restore(&state, 5).is_err(), "{name}");
        let after = (
            trainer.capacity,
            trainer.field.weights().to_vec1::<f32>().unwrap(),
        );
        assert!(before == after && trainer.steps() == 0, "{name}");
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
