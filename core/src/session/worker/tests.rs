use std::time::{Duration, Instant};

use super::*;
use crate::labels::testing::clicked;
use crate::labels::{ImportedLabels, ImportedMap, Trust};
use crate::scene::DepthMap;
use crate::scene::testing::wall;
use crate::session::serve::serve;
use crate::session::tests::options;

/// A wall whose upper half has no depth: there is something to find out.
fn half_measured() -> Scene {
    let mut scene = wall(5, 64, 48);
    for frame in &mut scene.frames {
        let depths = [vec![0.0; 64 * 24], vec![2.0; 64 * 24]].concat();
        frame.set_depth(Some(DepthMap::from_z_depths(&frame.camera, depths)));
    }
    scene
}

/// An outbox that nobody reads.
fn outbox() -> Outbox {
    let (sender, _) = crossbeam_channel::unbounded();
    Outbox::new(sender, Arc::default(), Box::new(|| {}))
}

fn surface(worker: &Worker<'_>) -> Option<*const crate::semantics::Surface> {
    let propagation = worker.propagation.as_ref();
    propagation.map(|propagation| Arc::as_ptr(propagation.surface()))
}

/// A worker on a scene that has its first surface.
fn with_surface<'a>(scene: &Arc<Scene>, options: &'a SessionOptions, outbox: &'a Outbox) -> Worker<'a> {
    let mut worker = Worker::new(Arc::clone(scene).into(), None, options, outbox).unwrap();
    advance_until(&mut worker, |worker| worker.propagation.is_some());
    worker
}

/// The surface stays as long as the pause lasts, and no longer.
fn assert_waits_for_the_end_of_the_pause(worker: &mut Worker<'_>) {
    let first = surface(worker);
    for _ in 0..100 {
        worker.advance().unwrap();
        std::thread::sleep(Duration::from_millis(10));
    }
    assert_eq!(surface(worker), first);
    worker.handle(Command::Resume).unwrap();
    advance_until(worker, |worker| surface(worker) != first);
}

fn advance_until(worker: &mut Worker<'_>, is_it: impl Fn(&Worker<'_>) -> bool) {
    let end = Instant::now() + Duration::from_secs(60);
    while !is_it(worker) {
        worker.advance().unwrap();
        assert!(Instant::now() < end);
    }
}

#[test]
fn training_waits_for_the_first_surface() {
    let (outbox, options) = (outbox(), options());
    let mut worker = Worker::new(Arc::new(half_measured()).into(), None, &options, &outbox).unwrap();
    advance_until(&mut worker, |worker| {
        assert!(worker.propagation.is_some() || worker.trainer.steps() == 0);
        worker.propagation.is_some()
    });
    advance_until(&mut worker, |worker| worker.trainer.steps() > 0);
}

#[test]
fn a_surface_that_becomes_ready_during_a_pause_waits_for_its_end() {
    let scene = Arc::new(half_measured());
    let (outbox, options) = (outbox(), options());
    let mut worker = with_surface(&scene, &options, &outbox);
    worker.handle(Command::Pause).unwrap();
    // It begins with another surface.
    worker.refiner = SurfaceRefiner::new(&scene, &worker.trainer, 1.0, 2);
    assert_waits_for_the_end_of_the_pause(&mut worker);
}

#[test]
fn a_surface_that_waits_for_imported_images_waits_for_the_end_of_a_pause_too() {
    let scene = Arc::new(half_measured());
    let (outbox, options) = (outbox(), options());
    let mut worker = with_surface(&scene, &options, &outbox);
    let image = ImportedMap::new(4, &[1; 64 * 48]);
    let imported = ImportedLabels::new(vec![image], Trust::new(0.5).unwrap());
    let imported = Some(Arc::new(imported));
    let history = clicked(&["dark", "bright"], &[(0, 1, [10, 30])]);
    let clicks = history.labels().clone();
    let labels = LabelSet { imported, ..clicks };
    let generation = 1;
    worker.handle(Command::Labels { labels, generation }).unwrap();
    advance_until(&mut worker, |worker| worker.importing.is_none());
    worker.refiner = SurfaceRefiner::new(&scene, &worker.trainer, 1.0, 2);
    let newer = loop {
        if let Some(newer) = worker.new_propagation().unwrap() {
            break newer;
        }
        std::thread::yield_now();
    };
    worker.importing = Some(worker.import_onto(newer.surface()));
    worker.waiting = Some(newer);
    worker.handle(Command::Pause).unwrap();
    // Nothing waits, so that other images that are imported during the pause are taken over.
    assert!(worker.importing.is_none() && worker.waiting.is_none());
    assert_waits_for_the_end_of_the_pause(&mut worker);
}

#[test]
fn a_field_that_has_seen_next_to_nothing_does_not_fill_holes_of_measured_depth() {
    let (outbox, options) = (outbox(), options());
    let mut worker = with_surface(&Arc::new(half_measured()), &options, &outbox);
    worker.handle(Command::Settle).unwrap();
    assert!(!worker.refiner.is_rendering() && worker.refiner.is_done());
}

#[test]
fn a_click_that_was_asked_about_is_answered_by_the_map_that_was_foreseen() {
    let (outbox, options) = (outbox(), options());
    outbox.reset_maps(5);
    let mut worker = with_surface(&Arc::new(wall(5, 64, 48)), &options, &outbox);
    let mut history = clicked(&["dark", "bright"], &[(0, 1, [10, 20])]);
    let mut generation = 0;
    for asked in [[50, 30], [20, 10]] {
        generation += 1;
        let labels = history.labels().clone();
        worker.handle(Command::Labels { labels, generation }).unwrap();
        advance_until(&mut worker, |worker| worker.stale.is_empty());
        let click = Stroke::click(4, 2, [50, 30]);
        let question = Stroke::click(4, 2, asked);
        worker.handle(Command::Preview(question)).unwrap();
        advance_until(&mut worker, |worker| worker.foreseen.is_some());
        history.add_stroke(click);
        generation += 1;
        let labels = history.labels().clone();
        worker.handle(Command::Labels { labels, generation }).unwrap();
        // Otherwise the frame in view comes first.
        let foreseen = asked == [50, 30];
        assert_eq!(worker.seen, Some(if foreseen { 4 } else { 0 }));
        let told = outbox.map(worker.seen.unwrap()).unwrap();
        let propagation = worker.propagation.as_ref().unwrap();
        assert!(*told == propagation.map(&worker.scene, told.frame, generation));
        history.undo();
    }
}

#[test]
fn of_labels_that_wait_the_newest_alone_are_followed() {
    let (sender, events) = crossbeam_channel::unbounded();
    let (outbox, options) = (Outbox::new(sender, Arc::default(), Box::new(|| {})), options());
    outbox.reset_maps(5);
    let mut worker = with_surface(&Arc::new(half_measured()), &options, &outbox);
    let mut history = clicked(&["dark", "bright"], &[(0, 1, [10, 30])]);
    let mut labels = |generation: u64| {
        history.add_stroke(Stroke::click(1, 2, [50, 30 + generation as u32]));
        let labels = history.labels().clone();
        Command::Labels { labels, generation }
    };
    worker.handle(labels(1)).unwrap();
    let (commands, waiting) = crossbeam_channel::unbounded();
    for command in [labels(2), labels(3), Command::Stop] {
        commands.send(command).unwrap();
    }
    events.try_iter().for_each(drop);
    serve(&mut worker, Vec::new(), &waiting).unwrap();
    let told = events.try_iter().filter_map(|event| match event {
        Event::Map { generation, .. } => Some(generation),
        _ => None,
    });
    assert_eq!(told.collect::<Vec<_>>(), [3]);
}

#[test]
fn training_waits_for_suggestions_where_they_are_wanted() {
    let (scene, outbox, options) = (Arc::new(half_measured()), outbox(), options());
    let mut worker = with_surface(&scene, &options, &outbox);
    advance_until(&mut worker, |worker| worker.stale.is_empty());
    let (end, waiting) = crossbeam_channel::bounded::<()>(0);
    worker.suggesting = Some(Background::start("inplace-test", 1, 0, move |_| {
        waiting.recv().ok()?;
        None
    }));
    let steps = worker.trainer.steps();
    for _ in 0..20 {
        worker.advance().unwrap();
    }
    assert_eq!(worker.trainer.steps(), steps);
    drop(end);
    advance_until(&mut worker, |worker| worker.trainer.steps() > steps);
    assert!(worker.suggesting.is_none(), "nobody has asked for places");
    worker.handle(Command::Suggest { only: None }).unwrap();
    worker.advance().unwrap();
    assert!(worker.suggesting.is_some());
}

#[test]
fn a_session_that_settles_without_a_surface_ends_with_an_error() {
    let (outbox, options) = (outbox(), options());
    let mut worker = Worker::new(Arc::new(half_measured()).into(), None, &options, &outbox).unwrap();
    // Images of depth in which nothing was measured.
    let mut empty = half_measured();
    for frame in &mut empty.frames {
        let depths = vec![0.0; 64 * 48];
        frame.set_depth(Some(DepthMap::from_z_depths(&frame.camera, depths)));
    }
    worker.refiner = SurfaceRefiner::new(&Arc::new(empty), &worker.trainer, 1.0, 2);
    worker.handle(Command::Settle).unwrap();
    let end = Instant::now() + Duration::from_secs(60);
    let error = loop {
        if let Err(error) = worker.advance() {
            break error;
        }
        assert!(Instant::now() < end);
    };
    assert!(error.to_string().contains("no surface was found"), "{error}");
}

#[test]
fn suggestions_and_checks_that_panic_end_with_an_empty_answer_and_a_warning() {
    let (sender, events) = crossbeam_channel::unbounded();
    let (outbox, options) = (Outbox::new(sender, Arc::default(), Box::new(|| {})), options());
    let mut worker = Worker::new(Arc::new(half_measured()).into(), None, &options, &outbox).unwrap();
    worker.suggesting = Some(Background::start("inplace-test", 1, 7, |_| panic!("on purpose")));
    worker.checking = Some(Background::start("inplace-test", 1, 7, |_| panic!("on purpose")));
    let end = Instant::now() + Duration::from_secs(60);
    while worker.suggesting.is_some() || worker.checking.is_some() {
        worker.suggest();
        worker.check();
        assert!(Instant::now() < end);
    }
    let events: Vec<Event> = events.try_iter().collect();
    let warnings = events.iter().filter(|event| matches!(event, Event::Warning(_)));
    assert_eq!(warnings.count(), 2);
    assert!(events.iter().any(|event| matches!(
        event,
        Event::Suggestions { generation: 7, suggestions } if suggestions.is_empty()
    )));
    assert!(events.iter().any(|event| matches!(
        event,
        Event::StrokeChecks { generation: 7, checks, accuracy: None } if checks.is_empty()
    )));
}
