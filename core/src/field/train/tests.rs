use super::*;
use crate::field::kernels::Dispatch;
use crate::scene::testing::wall;

/// A trainer of a small wall after some steps.
fn trained(path: &Path, depth: bool, steps: u64) -> Trainer {
    let mut scene = wall(9, 24, 18);
    if !depth {
        for frame in &mut scene.frames {
            frame.depth = None;
        }
    }
    let mut trainer = Trainer::on(path, Arc::new(scene), Preset::Fast, 3).unwrap();
    for _ in 0..steps {
        trainer.step().unwrap();
    }
    trainer
}

#[test]
fn plain_ops_train_a_scene_as_the_fused_kernels_do() {
    for (depth, steps) in [(true, 10), (false, 4)] {
        let plain = trained(&Path::Plain(Device::Cpu), depth, steps);
        let fused = trained(&Path::Fused(Dispatch::detect()), depth, steps);
        let (plain, fused) = (
            plain.evaluate().unwrap().unwrap(),
            fused.evaluate().unwrap().unwrap(),
        );
        let start = trained(&Path::Fused(Dispatch::detect()), depth, 0);
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
    let plain = trained(&Path::Plain(Device::Cpu), true, 5);
    let mut fused = trained(&Path::Fused(Dispatch::detect()), true, 0);
    fused.restore(&plain.state().unwrap(), plain.steps()).unwrap();
    let (a, b) = (
        plain.evaluate().unwrap().unwrap(),
        fused.evaluate().unwrap().unwrap(),
    );
    assert!((a.psnr - b.psnr).abs() < 1e-3);
    fused.step().unwrap();
    assert_eq!((fused.steps(), fused.skipped()), (6, 0));
}
