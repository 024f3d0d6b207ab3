use std::time::Duration;

use super::*;
use crate::field::Preset;
use crate::scene::testing::wall;
use crate::scene::{DepthMap, OpenOptions, SceneSource};
use crate::session::Size;

/// Options for a scene that is open already.
fn options(size: Size) -> SessionOptions {
    SessionOptions {
        source: SceneSource::Demo,
        open: OpenOptions::default(),
        preset: Preset::Fast,
        threads: 2,
        seed: 1,
        state: None,
        size,
    }
}

#[test]
fn a_session_of_another_size_has_another_field_and_another_surface() {
    let scene = Arc::new(wall(3, 64, 48));
    let sizes = |field, surface| {
        let (sender, _events) = crossbeam_channel::unbounded();
        let outbox = Outbox::new(sender, Arc::default(), Box::new(|| {}));
        let options = options(Size { field, surface });
        let mut worker = Worker::new(Arc::clone(&scene), &options, &outbox).unwrap();
        let end = Instant::now() + Duration::from_secs(60);
        while worker.spread.is_none() {
            worker.advance().unwrap();
            assert!(Instant::now() < end);
        }
        let spread = worker.spread.as_ref().unwrap();
        (worker.trainer.field().parameters(), spread.surface().graph.len())
    };
    let (chosen, smaller, coarser) = (sizes(1.0, 1.0), sizes(0.25, 1.0), sizes(1.0, 0.25));
    assert!(
        smaller.0 < chosen.0 && smaller.1 == chosen.1,
        "{chosen:?} {smaller:?}"
    );
    assert!(
        coarser.1 < chosen.1 && coarser.0 == chosen.0,
        "{chosen:?} {coarser:?}"
    );
}

#[test]
fn a_surface_that_becomes_ready_during_a_pause_waits_for_its_end() {
    let mut scene = wall(5, 64, 48);
    for frame in &mut scene.frames {
        // Without its upper half there is something to find out.
        let depths = [vec![0.0; 64 * 24], vec![2.0; 64 * 24]].concat();
        frame.set_depth(Some(DepthMap::from_z_depths(&frame.camera, depths)));
    }
    let (sender, _events) = crossbeam_channel::unbounded();
    let outbox = Outbox::new(sender, Arc::default(), Box::new(|| {}));
    let options = options(Size::default());
    let end = Instant::now() + Duration::from_secs(60);
    let surface = |worker: &Worker<'_>| {
        let spread = worker.spread.as_ref();
        spread.map(|spread| Arc::as_ptr(spread.surface()))
    };
    let mut worker = Worker::new(Arc::new(scene), &options, &outbox).unwrap();
    while worker.spread.is_none() {
        worker.advance().unwrap();
        assert!(Instant::now() < end);
    }
    let first = surface(&worker);
    assert_eq!(worker.survey.seconds_to_finish(), None);
    worker.obey(Command::Settle).unwrap();
    while worker.survey.is_rendering() {
        worker.advance().unwrap();
    }
    worker.obey(Command::Pause).unwrap();
    for _ in 0..100 {
        worker.advance().unwrap();
        std::thread::sleep(Duration::from_millis(10));
    }
    assert_eq!(surface(&worker), first);
    worker.obey(Command::Resume).unwrap();
    while surface(&worker) == first {
        worker.advance().unwrap();
        assert!(Instant::now() < end);
    }
    assert!(
        worker
            .survey
            .seconds_to_finish()
            .is_some_and(|seconds| seconds > 0.0)
    );
}
