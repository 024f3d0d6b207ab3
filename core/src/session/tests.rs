use std::path::Path;
use std::time::{Duration, Instant};

use super::*;
use crate::field::Preset;
use crate::labels::{ClassId, History, ImportedLabels, ImportedMap, LabelImages, LabelSet, Stroke, Trust};
use crate::scene::testing::wall;
use crate::scene::{OpenOptions, SceneSource, write_replica};

/// How long anything may take on a slow, busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

fn capture() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    write_replica(&wall(9, 64, 48), &folder.path().join("wall"), None).unwrap();
    folder
}

fn options(folder: &Path) -> SessionOptions {
    SessionOptions {
        source: SceneSource::Folder(folder.join("wall")),
        open: OpenOptions::default(),
        preset: Preset::Fast,
        threads: 2,
        seed: 1,
        state: None,
        size: Size::default(),
    }
}

/// Waits for an event that `pick` takes; an error event fails the test.
fn wait<T>(session: &Session, mut pick: impl FnMut(&Event) -> Option<T>) -> T {
    let end = Instant::now() + PATIENCE;
    while let Ok(event) = session.events().recv_deadline(end) {
        if let Event::Error(reason) = &event {
            panic!("{reason}");
        }
        if let Some(found) = pick(&event) {
            return found;
        }
    }
    panic!("nothing came in {PATIENCE:?}");
}

fn all_maps(session: &Session, generation: u64) -> Vec<Arc<FrameMap>> {
    wait(session, |event| {
        matches!(event, Event::AllMaps { generation: g } if *g == generation).then_some(())
    });
    (0..session.maps().len())
        .map(|frame| session.maps().get(frame).unwrap())
        .collect()
}

fn send_labels(session: &Session, labels: &LabelSet, generation: u64) {
    session.send(Command::Labels {
        labels: labels.clone(),
        generation,
    });
}

/// Dark wall clicked on the first frame, bright wall on the last.
fn two_clicks() -> History {
    let mut history = History::default();
    let (dark, _) = history.add_class("dark");
    let (bright, _) = history.add_class("bright");
    history.add_stroke(Stroke::click(0, dark, [10, 20]));
    history.add_stroke(Stroke::click(8, bright, [50, 30]));
    history
}

#[test]
fn imported_votes_label_every_frame_and_a_click_among_them_wins_its_surroundings() {
    let folder = capture();
    let session = Session::start(options(folder.path()), || {});
    let mut history = History::default();
    history.add_class("dark");
    history.add_class("bright");
    let maps = (0..3)
        .map(|frame| ImportedMap::new(frame, &[1; 64 * 48]))
        .collect();
    history.import(LabelImages {
        labels: ImportedLabels {
            maps,
            trust: Trust::VOTES,
        },
        classes: Vec::new(),
        unmatched: 0,
    });
    let label_of = |frame: usize, pixel: usize| {
        let map = session.maps().get(frame);
        map.map_or(0, |map| map.labels()[pixel])
    };
    // Votes come beside the other work, so the first maps may be without them.
    let until = |generation: u64, pixel: usize, class: u16| {
        wait(&session, |event| {
            let of = matches!(event, Event::AllMaps { generation: g } if *g == generation);
            (of && label_of(7, pixel) == class).then_some(())
        });
    };
    send_labels(&session, history.labels(), 1);
    until(1, 24 * 64 + 60, 1);
    history.add_stroke(Stroke::click(8, 2, [50, 30]));
    send_labels(&session, history.labels(), 2);
    until(2, 24 * 64 + 60, 2);
    assert_eq!(label_of(7, 24 * 64 + 4), 1);
    history.undo();
    history.undo();
    send_labels(&session, history.labels(), 3);
    let maps = all_maps(&session, 3);
    assert!(
        maps.iter()
            .all(|map| map.labels().iter().all(|&label| label == 0))
    );
}

#[test]
fn strokes_on_frames_that_are_no_keyframes_label_every_frame() {
    let folder = capture();
    let mut options = options(folder.path());
    // Four of the nine frames fit, each with three bytes of colour and two of depth a pixel.
    options.open.image_bytes = 4 * 64 * 48 * 5;
    let session = Session::start(options, || {});
    let scene = wait(&session, |event| match event {
        Event::Opened(scene) => Some(Arc::clone(scene)),
        _ => None,
    });
    let others: Vec<usize> = (0..9)
        .filter(|&frame| !scene.frames[frame].is_keyframe())
        .collect();
    assert_eq!(others.len(), 5);
    let mut history = History::default();
    let (dark, _) = history.add_class("dark");
    let (bright, _) = history.add_class("bright");
    history.add_stroke(Stroke::click(others[0], dark, [10, 20]));
    history.add_stroke(Stroke::click(others[4], bright, [50, 30]));
    send_labels(&session, history.labels(), 1);
    for map in all_maps(&session, 1) {
        let labels = map.labels();
        assert_eq!(
            (labels[24 * 64 + 4], labels[24 * 64 + 60]),
            (dark, bright),
            "{}",
            map.frame
        );
        assert_eq!(map.summary(None).is_some(), scene.frames[map.frame].is_keyframe());
    }
}

#[test]
fn two_clicks_label_every_frame_on_both_sides_of_the_border() {
    let folder = capture();
    let session = Session::start(options(folder.path()), || {});
    send_labels(&session, two_clicks().labels(), 1);
    let maps = all_maps(&session, 1);
    assert_eq!(maps.len(), 9);
    for map in maps {
        // Well away from the border, which runs near the middle of every frame.
        assert_eq!(map.labels()[24 * 64 + 4], 1);
        assert_eq!(map.labels()[24 * 64 + 60], 2);
        assert!(map.mean_entropy() < 0.5);
    }
}

#[test]
fn undo_restores_the_maps_of_before_while_paused() {
    let folder = capture();
    let session = Session::start(options(folder.path()), || {});
    session.send(Command::Pause);
    let mut history = two_clicks();
    send_labels(&session, history.labels(), 1);
    let before = all_maps(&session, 1);
    history.add_stroke(Stroke::click(4, 1, [60, 10]));
    send_labels(&session, history.labels(), 2);
    let between = all_maps(&session, 2);
    history.undo();
    send_labels(&session, history.labels(), 3);
    let after = all_maps(&session, 3);
    assert_ne!(pixels(&before), pixels(&between));
    assert_eq!(pixels(&before), pixels(&after));
}

/// Class and entropy of every pixel of all maps.
fn pixels(maps: &[Arc<FrameMap>]) -> Vec<(Vec<ClassId>, Vec<u16>)> {
    maps.iter()
        .map(|map| (map.labels().into_owned(), map.entropy().into_owned()))
        .collect()
}

#[test]
fn every_undo_restores_its_maps_when_the_head_had_a_say_before_the_pause() {
    let folder = capture();
    let session = Session::start(options(folder.path()), || {});
    // Both on the dark half, so that the graph is in doubt and the head has something to say.
    let mut history = History::default();
    for (name, pixel) in [("left", [6, 20]), ("right", [28, 30])] {
        let (class, _) = history.add_class(name);
        history.add_stroke(Stroke::click(0, class, pixel));
    }
    send_labels(&session, history.labels(), 1);
    let of_the_graph = pixels(&all_maps(&session, 1));
    // All maps again: the head has been looked at.
    all_maps(&session, 1);
    session.send(Command::Pause);
    wait(&session, |event| {
        matches!(event, Event::Status(status) if status.phase == Phase::Paused).then_some(())
    });

    let mut generation = 1;
    let mut maps_of = |history: &History| {
        generation += 1;
        send_labels(&session, history.labels(), generation);
        pixels(&all_maps(&session, generation))
    };
    let mut before = vec![maps_of(&history)];
    assert!(before[0] != of_the_graph);
    let edits: [fn(&mut History); 5] = [
        |history| drop(history.add_stroke(Stroke::click(4, 1, [60, 10]))),
        |history| drop(history.add_stroke(Stroke::click(2, 0, [5, 5]))),
        |history| drop(history.add_class("third")),
        |history| drop(history.add_stroke(Stroke::click(6, 3, [30, 40]))),
        |history| drop(history.delete_class(1)),
    ];
    for edit in edits {
        edit(&mut history);
        before.push(maps_of(&history));
    }
    for (edit, before) in before.iter().enumerate().rev().skip(1) {
        history.undo();
        assert!(maps_of(&history) == *before, "after the undo of edit {edit}");
    }
    for (edit, before) in before.iter().enumerate().skip(1) {
        history.redo();
        assert!(maps_of(&history) == *before, "after the redo of edit {edit}");
    }
}

#[test]
fn painted_pixels_show_what_the_person_said_and_void_is_void() {
    let folder = capture();
    let session = Session::start(options(folder.path()), || {});
    session.send(Command::Pause);
    let mut history = two_clicks();
    // Against all evidence, one bright pixel is said to be dark, and a patch to be nothing.
    history.add_stroke(Stroke::click(3, 1, [61, 40]));
    history.add_stroke(Stroke {
        radius: 3,
        ..Stroke::click(3, 0, [20, 20])
    });
    send_labels(&session, history.labels(), 1);
    let maps = all_maps(&session, 1);
    assert_eq!(maps[3].labels()[40 * 64 + 61], 1);
    assert_eq!(maps[3].labels()[20 * 64 + 20], 0);
    assert_eq!(maps[3].labels()[20 * 64 + 26], 1);
}

#[test]
fn pausing_stops_the_steps_and_resuming_goes_on() {
    let folder = capture();
    let session = Session::start(options(folder.path()), || {});
    let steps_when = |phase: Phase| {
        wait(&session, |event| match event {
            Event::Status(status) if status.phase == phase => Some(status.steps),
            _ => None,
        })
    };
    steps_when(Phase::Training);
    session.send(Command::Pause);
    let paused_at = steps_when(Phase::Paused);
    std::thread::sleep(Duration::from_millis(600));
    while let Ok(event) = session.events().try_recv() {
        let Event::Status(status) = event else { continue };
        assert_eq!(status.steps, paused_at);
    }
    session.send(Command::Resume);
    wait(&session, |event| match event {
        Event::Status(status) if status.steps > paused_at => Some(()),
        _ => None,
    });
}

#[test]
fn a_saved_state_goes_on_where_it_stopped() {
    let folder = capture();
    let session = Session::start(options(folder.path()), || {});
    wait(&session, |event| match event {
        Event::Status(status) if status.steps >= 20 => Some(()),
        _ => None,
    });
    session.send(Command::Pause);
    session.send(Command::Save);
    let state = wait(&session, |event| match event {
        Event::State(state) => Some(Arc::clone(state)),
        _ => None,
    });
    drop(session);
    assert!(state.steps >= 20);
    let again = SessionOptions {
        state: Some(Arc::clone(&state)),
        ..options(folder.path())
    };
    let session = Session::start(again, || {});
    wait(&session, |event| match event {
        Event::Status(status) => (status.steps >= state.steps).then_some(()),
        _ => None,
    });
}

#[test]
fn a_foreign_state_is_left_out_with_a_sentence() {
    let folder = capture();
    let foreign = SessionOptions {
        state: Some(Arc::new(ModelState {
            steps: 5,
            tensors: vec![1, 2, 3],
        })),
        ..options(folder.path())
    };
    let session = Session::start(foreign, || {});
    let sentence = loop {
        match session.events().recv_timeout(PATIENCE).unwrap() {
            Event::Warning(sentence) => break sentence,
            Event::Stopped => panic!("stopped"),
            _ => {}
        }
    };
    assert!(sentence.contains("training starts anew"), "{sentence}");
    wait(&session, |event| {
        matches!(event, Event::Status(status) if status.steps > 0).then_some(())
    });
}

#[test]
fn a_missing_scene_is_an_error_and_the_end() {
    let folder = tempfile::tempdir().unwrap();
    let session = Session::start(options(folder.path()), || {});
    let mut events = session.events().iter();
    assert!(matches!(events.next(), Some(Event::Error(reason)) if reason.contains("no such folder")));
    assert!(matches!(events.next(), Some(Event::Stopped)));
}

#[test]
fn suggestions_follow_the_maps() {
    let folder = capture();
    let session = Session::start(options(folder.path()), || {});
    let mut history = History::default();
    let (dark, _) = history.add_class("dark");
    history.add_class("bright");
    history.add_stroke(Stroke::click(0, dark, [10, 20]));
    send_labels(&session, history.labels(), 7);
    let suggestions = wait(&session, |event| match event {
        Event::Suggestions {
            generation: 7,
            suggestions,
        } => Some(suggestions.clone()),
        _ => None,
    });
    assert!(!suggestions.is_empty());
}

#[test]
fn strokes_are_checked_after_every_change_once_somebody_asked() {
    let folder = capture();
    let session = Session::start(options(folder.path()), || {});
    let mut history = two_clicks();
    let mut unasked = 0;
    send_labels(&session, history.labels(), 1);
    wait(&session, |event| {
        unasked += usize::from(matches!(event, Event::StrokeChecks { .. }));
        matches!(event, Event::Suggestions { .. }).then_some(())
    });
    assert_eq!(unasked, 0);
    session.send(Command::CheckStrokes);
    let checks = |wanted: u64| {
        wait(&session, |event| match event {
            Event::StrokeChecks {
                generation,
                checks,
                accuracy,
            } if *generation == wanted => Some((checks.clone(), *accuracy)),
            _ => None,
        })
    };
    // Each is alone in its class.
    assert_eq!(checks(1), (Vec::new(), None));
    history.add_stroke(Stroke::click(1, 1, [12, 30]));
    history.add_stroke(Stroke::click(7, 2, [8, 24]));
    send_labels(&session, history.labels(), 3);
    let (checks, accuracy) = checks(3);
    assert_eq!(checks.len(), 4);
    assert!(accuracy.is_some_and(|accuracy| accuracy < 1.0), "{checks:?}");
}

fn reference(folder: &Path) -> SessionOptions {
    SessionOptions {
        preset: Preset::Reference,
        ..options(folder)
    }
}

#[test]
fn the_reference_maps_every_frame_when_it_is_asked_to_settle() {
    let folder = capture();
    let session = Session::start(reference(folder.path()), || {});
    let mut history = two_clicks();
    history.add_stroke(Stroke::click(3, 0, [20, 20]));
    send_labels(&session, history.labels(), 1);
    session.send(Command::Settle);
    let maps = all_maps(&session, 1);
    assert_eq!(maps.len(), 9);
    for map in &maps {
        let void = map.labels().iter().filter(|&&label| label == 0).count();
        assert_eq!(void, usize::from(map.frame == 3));
        assert!(map.mean_entropy() > 0.0);
    }
    assert_eq!(
        (maps[0].labels()[20 * 64 + 10], maps[8].labels()[30 * 64 + 50]),
        (1, 2)
    );
    // Finer and finer, with what is known told.
    let status = wait(&session, |event| match event {
        Event::Status(status) if status.map_stride == Some(32) => Some(status.clone()),
        _ => None,
    });
    assert!(status.mean_entropy.is_some() && status.held_out_psnr.is_some() && !status.settled);
    assert_eq!(status.surface_nodes, 0);
}

#[test]
fn the_reference_stops_in_the_middle_of_a_step() {
    let folder = capture();
    let session = Session::start(reference(folder.path()), || {});
    send_labels(&session, two_clicks().labels(), 1);
    wait(&session, |event| match event {
        Event::Status(status) if status.geometry_seconds > 0.0 => Some(()),
        _ => None,
    });
    session.send(Command::Pause);
    let steps = wait(&session, |event| match event {
        Event::Status(status) if status.phase == Phase::Paused => Some(status.steps),
        _ => None,
    });
    assert_eq!(steps, 0, "a whole step takes far longer");
    session.send(Command::Stop);
    wait(&session, |event| matches!(event, Event::Stopped).then_some(()));
}

#[test]
fn a_view_of_the_field_is_rendered_during_a_pause_and_has_the_depth_of_the_wall() {
    let folder = capture();
    let session = Session::start(options(folder.path()), || {});
    wait(&session, |event| {
        matches!(event, Event::Status(status) if status.steps >= 200).then_some(())
    });
    session.send(Command::Pause);
    session.send(Command::Render { frame: 4 });
    let view = wait(&session, |event| match event {
        Event::Rendered(view) if view.is_last => Some(Arc::clone(view)),
        _ => None,
    });
    assert_eq!((view.frame, view.color.width(), view.color.height()), (4, 64, 48));
    let depth = view.depth_at([32, 24]).unwrap();
    assert!((depth - 2.0).abs() < 0.2, "{depth} m");
}
