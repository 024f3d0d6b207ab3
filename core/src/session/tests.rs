use std::path::Path;
use std::time::{Duration, Instant};

use glam::{Affine3A, Vec3};

use super::*;
use crate::features::write_untrained;
use crate::field::Preset;
use crate::labels::testing::clicked;
use crate::labels::{ClassId, History, ImportedLabels, ImportedMap, LabelSet, Stroke, Trust};
use crate::scene::testing::{wall, without_depth};
use crate::scene::{Camera, OpenOptions, SceneSource, SparsePoint, Viewpoint, write_replica};
use crate::stereo::tests::capture;

/// How long anything may take on a slow, busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// Options that tests share.
pub(super) fn options() -> SessionOptions {
    SessionOptions {
        source: SceneSource::Demo,
        open: OpenOptions::default(),
        preset: Preset::Fast,
        threads: 2,
        seed: 1,
        views: true,
        first_look: false,
        features: None,
        state: None,
    }
}

/// A session on a wall in nine frames.
fn start() -> Client {
    start_with(options())
}

fn start_with(options: SessionOptions) -> Client {
    on(wall(9, 64, 48), options)
}

fn on(scene: Scene, options: SessionOptions) -> Client {
    Client::observing(Session::on(Arc::new(scene), options, || {}), |_| {})
}

/// Bytes of the images of four of the wall's frames: three of colour and two of depth a pixel.
const FOUR_FRAMES: u64 = 4 * 64 * 48 * 5;

/// A session on a capture in a folder, with so many bytes of memory for its images.
fn start_on(folder: &Path, image_bytes: u64) -> Client {
    let mut options = options();
    options.source = SceneSource::Folder(folder.to_path_buf());
    options.open.image_bytes = image_bytes;
    Client::start(options)
}

/// Waits for an event that `pick` takes; an error event fails the test.
fn wait<T>(client: &mut Client, mut pick: impl FnMut(&Event) -> Option<T>) -> T {
    let mut found = None;
    let is_it = |event: &Event| {
        found = pick(event);
        found.is_some()
    };
    client.wait_until(Some(Instant::now() + PATIENCE), is_it).unwrap();
    found.unwrap()
}

fn wait_for_status(client: &mut Client, is_it: impl Fn(&Status) -> bool) -> Status {
    wait(client, |event| match event {
        Event::Status(status) => Some(status.clone()).filter(&is_it),
        _ => None,
    })
}

fn rendered(client: &mut Client, is_it: impl Fn(&RenderedView) -> bool) -> Arc<RenderedView> {
    wait(client, |event| match event {
        Event::Rendered(view) => Some(Arc::clone(view)).filter(|view| is_it(view)),
        _ => None,
    })
}

/// The maps of all frames once they follow these labels.
fn maps_of(client: &mut Client, history: &History, generation: u64) -> Vec<Arc<FrameMap>> {
    client.label(history.labels().clone(), generation);
    all_maps(client, generation)
}

fn all_maps(client: &mut Client, generation: u64) -> Vec<Arc<FrameMap>> {
    client.mapped(generation).unwrap();
    client.all_maps(generation).unwrap()
}

/// Dark wall clicked on the first frame, bright wall on the last.
fn two_clicks() -> History {
    clicked(&["dark", "bright"], &[(0, 1, [10, 20]), (8, 2, [50, 30])])
}

#[test]
fn two_clicks_label_every_frame_on_both_sides_of_the_border_be_it_a_keyframe_or_not() {
    let folder = tempfile::tempdir().unwrap();
    let capture = folder.path().join("wall");
    write_replica(&wall(9, 64, 48), &capture, None).unwrap();
    for (image_bytes, keyframes) in [(u64::MAX, 9), (FOUR_FRAMES, 4)] {
        let mut client = start_on(&capture, image_bytes);
        let scene = client.opened().unwrap();
        assert_eq!(scene.keyframes().len(), keyframes);
        let others = (0..9).filter(|&frame| scene.frames[frame].is_keyframe() == (keyframes == 9));
        let others: Vec<usize> = others.collect();
        let clicks = [(others[0], 1, [10, 20]), (others[4], 2, [50, 30])];
        let maps = maps_of(&mut client, &clicked(&["dark", "bright"], &clicks), 1);
        assert_eq!(maps.len(), 9);
        for map in maps {
            // Well away from the border, which runs near the middle of every frame.
            let labels = map.labels();
            let sides = (labels[24 * 64 + 4], labels[24 * 64 + 60]);
            assert_eq!(sides, (1, 2), "{}", map.frame);
            assert!(map.looked_up().summary(None).unwrap().mean_entropy < 0.5);
            assert_eq!(map.summary(None).is_some(), scene.frames[map.frame].is_keyframe());
        }
    }
}

#[test]
fn colours_alone_give_a_surface_before_the_first_training_step() {
    let (scene, depths) = capture(true);
    let mut client = on(scene, options());
    client.send(Command::Pause);
    let opened = client.opened().unwrap();
    assert!(!opened.has_depth());
    for (frame, truth) in opened.frames.iter().zip(&depths) {
        let error = |point: &SparsePoint| {
            let pixel = point.pixel as usize;
            let length = truth[pixel] * frame.camera.direction_at(pixel).length();
            (point.length / length - 1.0).abs()
        };
        let mut errors: Vec<f32> = frame.points.iter().map(error).collect();
        errors.sort_by(f32::total_cmp);
        assert!(errors[errors.len() / 2] < 0.02, "{}", frame.stem);
    }
    let status = wait_for_status(&mut client, |status| status.surface_nodes > 0);
    assert_eq!(status.steps, 0);
}

#[test]
fn labels_spread_over_a_first_look_at_the_depth_while_it_is_estimated_better() {
    let start = || {
        let options = SessionOptions {
            first_look: true,
            views: false,
            ..options()
        };
        let mut client = on(capture(true).0, options);
        // Of the board and of the wall behind it.
        let clicks = [(3, 1, [48, 36]), (3, 2, [5, 5])];
        client.label(clicked(&["board", "wall"], &clicks).labels().clone(), 1);
        let opened = client.opened().unwrap();
        assert!(opened.frames.iter().all(|frame| frame.points.is_empty()));
        client
    };
    let mut client = start();
    client.mapped(1).unwrap();
    let first = client.surface().unwrap();
    client.mapped(1).unwrap();
    let second = client.surface().unwrap();
    assert!(!Arc::ptr_eq(&first, &second));
    assert!(client.map(3).unwrap().labels().contains(&1));
    wait_for_status(&mut client, |status| {
        status.phase == Phase::Training && status.steps > 0
    });
    // Whoever wants to have done, or nothing more at all, need not wait until that point.
    let mut client = start();
    client.send(Command::Settle);
    let settled = wait_for_status(&mut client, |status| status.is_final(1));
    assert_eq!(settled.phase, Phase::Training);
    drop(start());
}

#[test]
fn a_capture_is_listed_before_it_is_read_and_whoever_looks_first_reads_a_frame_for_all() {
    let folder = tempfile::tempdir().unwrap();
    let capture = folder.path().join("wall");
    write_replica(&wall(9, 64, 48), &capture, None).unwrap();
    let open = |image_bytes: u64| {
        let mut client = start_on(&capture, image_bytes);
        let listed = wait(&mut client, |event| match event {
            Event::Listed(scene) => Some(Arc::clone(scene)),
            _ => None,
        });
        let looked = listed.frames[5].pixels();
        let opened = client.opened().unwrap();
        assert_eq!(client.session.maps().len(), opened.frames.len());
        (listed, looked, opened)
    };
    for all_stay in [true, false] {
        let (listed, looked, opened) = open(if all_stay { u64::MAX } else { FOUR_FRAMES });
        assert!(opened.has_frames_of(&listed));
        let (looked, read) = (looked.unwrap(), opened.frames[5].pixels().unwrap());
        assert_eq!(looked, read);
        assert!(Arc::ptr_eq(&looked.color, &read.color) || !all_stay);
        for (listed, opened) in listed.frames.iter().zip(&opened.frames) {
            assert_eq!(listed.camera_to_world, opened.camera_to_world);
            assert_eq!(listed.has_depth(), opened.has_depth());
        }
    }
    let broken = &open(u64::MAX).0.frames[5].path.clone();
    let bytes = std::fs::read(broken).unwrap();
    std::fs::write(broken, &bytes[..bytes.len() / 2]).unwrap();
    let (listed, looked, opened) = open(u64::MAX);
    assert!(looked.is_err() && !opened.has_frames_of(&listed));
    assert_eq!((listed.frames.len(), opened.frames.len()), (9, 8));
}

/// Class and entropy of every pixel of all maps.
fn pixels(maps: &[Arc<FrameMap>]) -> Vec<(Vec<ClassId>, Vec<u16>)> {
    maps.iter()
        .map(|map| (map.labels().into_owned(), map.entropy().into_owned()))
        .collect()
}

#[test]
fn every_undo_restores_its_maps_when_the_prior_was_evaluated_before_the_pause() {
    // Where depth is measured, the maps do without the prior.
    let mut client = on(without_depth(wall(9, 64, 48)), options());
    // Both on the dark half, so that the graph is in doubt and the prior changes the maps.
    let mut history = clicked(&["left", "right"], &[(0, 1, [6, 20]), (0, 2, [28, 30])]);
    let of_the_graph = pixels(&maps_of(&mut client, &history, 1));
    // All maps again: the prior has been evaluated.
    all_maps(&mut client, 1);
    client.send(Command::Pause);
    wait_for_status(&mut client, |status| status.phase == Phase::Paused);

    let mut generation = 1;
    let mut pixels_of = |history: &History| {
        generation += 1;
        pixels(&maps_of(&mut client, history, generation))
    };
    let mut before = vec![pixels_of(&history)];
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
        before.push(pixels_of(&history));
    }
    assert!(before[1] != before[0]);
    for (edit, before) in before.iter().enumerate().rev().skip(1) {
        history.undo();
        assert!(pixels_of(&history) == *before, "after the undo of edit {edit}");
    }
    for (edit, before) in before.iter().enumerate().skip(1) {
        history.redo();
        assert!(pixels_of(&history) == *before, "after the redo of edit {edit}");
    }
}

#[test]
fn where_depth_is_measured_everywhere_nothing_is_trained_before_somebody_looks_at_the_field() {
    let mut client = start_with(SessionOptions {
        views: false,
        ..options()
    });
    let viewpoint = client.opened().unwrap().frames[4].viewpoint();
    client.label(two_clicks().labels().clone(), 1);
    let status = wait_for_status(&mut client, |status| status.is_final(1));
    assert_eq!(status.steps, 0);
    assert_eq!(status.training_end, Some(TrainingEnd::NotNeeded));
    client.send(Command::Render(viewpoint));
    let view = rendered(&mut client, |_| true);
    assert!(view.labels.is_none(), "nothing was learnt yet");
    // Each view trains the field for a while.
    let labels = loop {
        client.send(Command::Render(viewpoint));
        let view = rendered(&mut client, |view| view.is_last);
        if let Some(labels) = view.labels.as_ref().filter(|_| view.steps > 100) {
            break Arc::clone(&labels.classes);
        }
    };
    let shown = client.map(4).unwrap().labels().into_owned();
    let right = labels.iter().zip(&shown);
    let right = right.filter(|(rendered, shown)| rendered == shown).count();
    assert!(right > labels.len() / 2, "{right}");
}

#[test]
fn the_surface_knows_what_a_pretrained_network_sees_and_a_file_of_something_else_costs_nothing_but_a_warning()
{
    let folder = tempfile::tempdir().unwrap();
    let network = folder.path().join("untrained.safetensors");
    write_untrained(&network);
    let with = |features: &Path| {
        start_with(SessionOptions {
            views: false,
            features: Some(features.to_path_buf()),
            ..options()
        })
    };
    let image = ImportedMap::new(4, &[1; 64 * 48]);
    let imported = ImportedLabels::new(vec![image], Trust::new(0.5).unwrap());
    for imported in [None, Some(Arc::new(imported))] {
        let mut client = with(&network);
        let clicks = two_clicks().labels().clone();
        client.label(LabelSet { imported, ..clicks }, 1);
        let settled = wait_for_status(&mut client, |status| status.is_final(1));
        assert!(!settled.finding_features);
        assert!(client.surface().unwrap().look.has_features());
    }

    let other = folder.path().join("notes.pth");
    std::fs::write(&other, "notes").unwrap();
    let mut client = with(&other);
    client.label(two_clicks().labels().clone(), 1);
    let warning = wait(&mut client, |event| match event {
        Event::Warning(sentence) => Some(sentence.clone()),
        _ => None,
    });
    assert!(
        warning.contains("notes.pth") && warning.contains("MobileNetV2"),
        "{warning}"
    );
    wait_for_status(&mut client, |status| status.is_final(1));
    assert!(!client.surface().unwrap().look.has_features());
}

#[test]
fn a_pause_stops_the_steps_until_training_is_resumed_or_goes_on_from_a_saved_state() {
    let mut client = start();
    wait_for_status(&mut client, |status| status.steps >= 20);
    client.send(Command::Pause);
    let paused_at = wait_for_status(&mut client, |status| status.phase == Phase::Paused).steps;
    std::thread::sleep(Duration::from_millis(600));
    let state = client.saved().unwrap();
    assert_eq!(state.steps, paused_at);
    client.send(Command::Resume);
    wait_for_status(&mut client, |status| status.steps > paused_at);
    drop(client);
    let mut client = start_with(SessionOptions {
        state: Some(Arc::clone(&state).into()),
        ..options()
    });
    let first = wait_for_status(&mut client, |_| true);
    assert!(first.steps >= state.steps);
}

#[test]
fn suggestions_follow_the_maps_and_checks_of_the_strokes_too_once_they_are_wanted() {
    let mut client = start();
    let mut history = two_clicks();
    let mut unasked = 0;
    client.send(Command::Suggest { only: None });
    client.label(history.labels().clone(), 1);
    let suggestions = wait(&mut client, |event| {
        unasked += usize::from(matches!(event, Event::StrokeChecks { .. }));
        match event {
            Event::Suggestions {
                generation: 1,
                suggestions,
            } => Some(suggestions.clone()),
            _ => None,
        }
    });
    assert!(!suggestions.is_empty() && unasked == 0);
    client.send(Command::CheckStrokes);
    let checks = |client: &mut Client, wanted: u64| {
        wait(client, |event| match event {
            Event::StrokeChecks {
                generation,
                checks,
                accuracy,
            } if *generation == wanted => Some((checks.clone(), *accuracy)),
            _ => None,
        })
    };
    // Each is alone in its class.
    assert_eq!(checks(&mut client, 1), (Vec::new(), None));
    history.add_stroke(Stroke::click(1, 1, [12, 30]));
    history.add_stroke(Stroke::click(7, 2, [8, 24]));
    client.label(history.labels().clone(), 3);
    let (checks, accuracy) = checks(&mut client, 3);
    assert_eq!(checks.len(), 4);
    assert!(accuracy.is_some_and(|accuracy| accuracy < 1.0), "{checks:?}");
}

#[test]
fn views_of_the_field_are_rendered_during_a_pause_and_have_the_depth_of_the_wall() {
    let mut client = start();
    let of_frame = client.opened().unwrap().frames[4].viewpoint();
    wait_for_status(&mut client, |status| status.steps >= 200);
    client.send(Command::Pause);
    // From a frame, and from half a metre nearer by another camera.
    let free = Viewpoint {
        camera: Camera::with_horizontal_fov(50, 30, 40.0),
        camera_to_world: of_frame.camera_to_world * Affine3A::from_translation(Vec3::new(0.1, 0.05, 0.5)),
    };
    for (viewpoint, size, away) in [(of_frame, (64, 48), 2.0), (free, (50, 30), 1.5)] {
        client.send(Command::Render(viewpoint));
        let view = rendered(&mut client, |view| view.is_last);
        assert_eq!(view.viewpoint, viewpoint);
        assert_eq!((view.color.width(), view.color.height()), size);
        for pixel in [[10, 10], [25, 15], [40, 20]] {
            let depth = view.depth_at(pixel).unwrap();
            assert!((depth - away).abs() < 0.2, "{depth} m at {pixel:?}, not {away} m");
        }
    }
}

#[test]
fn what_a_stroke_would_win_is_told_while_training_and_changes_no_map() {
    let mut client = start();
    let history = two_clicks();
    client.label(history.labels().clone(), 1);
    // Asked before there is anything to tell it by.
    let click = Stroke::click(4, 1, [40, 30]);
    client.send(Command::Preview(click.clone()));
    let before = all_maps(&mut client, 1);
    let (generation, preview) = wait(&mut client, |event| match event {
        Event::Preview { generation, preview } => Some((*generation, Arc::clone(preview))),
        _ => None,
    });
    assert_eq!((generation, &preview.stroke), (1, &click));
    let mut after = history.clone();
    after.add_stroke(click);
    let after = maps_of(&mut client, &after, 2);
    let (before, after) = (before[4].labels(), after[4].labels());
    let won = before
        .iter()
        .zip(after.iter())
        .filter(|(before, after)| **before != 1 && **after == 1);
    assert_eq!(preview.pixels(), won.count() as u64);
    assert!(preview.pixels() > 100);
}
