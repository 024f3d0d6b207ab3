//! What is shown and kept while a scene is still being read.

use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use inplace_core::labels::Stroke;
use inplace_core::project::Contents;
use inplace_core::scene::{Scene, SceneSource};
use inplace_core::session::Event;
use inplace_model::Command;
use inplace_ui::Target;

use crate::stand::*;

/// A window with a scene that is listed, and read when the test says so.
fn listed(folder: &Path) -> Window {
    let scene = folder.join("slow");
    std::fs::create_dir_all(&scene).unwrap();
    Window::opened(folder, Target::Scene(SceneSource::Folder(scene)))
}

/// The worker has read the scene but for the lost frames.
fn read(window: &mut Window, lost: Range<usize>) {
    let mut scene = Scene::clone(&window.workspace().scene);
    scene.frames.drain(lost);
    window.tell(Event::Opened(Arc::new(scene)));
}

/// The class that the map in view shows in its first pixel, once there is one.
fn shown(window: &Window) -> Option<u16> {
    window.frame().map().map(|shown| shown.map.labels()[0])
}

#[test]
fn a_stroke_set_while_frames_are_read_is_kept_at_once_and_told_to_the_worker_when_all_are() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = listed(folder.path());
    window.tell(Event::Opening { done: 3, total: 5 });
    window.tell(Event::Opening { done: 2, total: 5 });
    window.sees("Reading: 3 of 5 frames");
    window.label("wall");
    window.sees_part("your labels spread as soon as all of them are there");
    window.until_saved();
    assert!(window.worker().received().is_empty());
    read(&mut window, 0..0);
    window.misses("Reading: 3 of 5 frames");
    let (labels, generation) = window.worker().told_labels().unwrap();
    assert_eq!((labels.strokes.len(), generation), (1, window.generation()));
    window.publish(0, 1);
    window.until_window("the map is shown", |window| shown(window).is_some());
    window.close();
    let file = folder.path().join("autosave.inplace");
    assert_eq!(Contents::read(&file).unwrap().history.labels().strokes.len(), 1);
}

#[test]
fn strokes_stay_on_their_images_where_others_that_were_listed_cannot_be_used() {
    for writable in [true, false] {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("autosave.inplace");
        if !writable {
            std::fs::create_dir(&file).unwrap();
        }
        let mut window = listed(folder.path());
        window.label("wall");
        window.act(Command::GoToFrame(3));
        window.click_canvas(0.0, 0.0);
        let stems = |window: &Window| -> Vec<String> {
            let scene = &window.workspace().scene;
            let stem = |stroke: &Arc<Stroke>| scene.frames[stroke.frame].stem.clone();
            window.labels().strokes.values().map(stem).collect()
        };
        let before = stems(&window);
        read(&mut window, 1..3);
        // It is listed again, and this time not shown before it is read.
        let started = |window: &Window| window.workers.lock().unwrap().len();
        window.until_window("another session has started", |window| started(window) == 2);
        assert!(window.model().workspace().is_none());
        let scene = scene(SceneSource::Folder(folder.path().join("slow")));
        let mut scene = Scene::clone(&scene);
        scene.frames.drain(1..3);
        window.tell(Event::Opened(Arc::new(scene)));
        window.until_open();
        assert_eq!(stems(&window), before);
        assert_eq!(window.labels().strokes.values().last().unwrap().frame, 1);
        window.act(Command::Undo);
        assert_eq!(window.strokes(), 1);
        if writable {
            window.act(Command::Redo);
            window.until_saved();
            window.close();
            let kept = Contents::read(&file).unwrap();
            let strokes = kept.history.labels().strokes.values();
            let stems = strokes.map(|stroke| &kept.scene.frames[stroke.frame].stem);
            assert!(stems.eq(&before));
        }
    }
}

#[test]
fn a_listed_scene_that_cannot_be_read_leads_back_to_the_start_page_and_its_labels_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = listed(folder.path());
    window.label("wall");
    window.tell(Event::Error("5 of 5 images cannot be used".to_owned()));
    window.sees("Open a folder...");
    window.sees_part("images cannot be used");
    assert!(window.model().preferences.recents.is_empty());
    window.close();
    let again = listed(folder.path());
    assert_eq!(again.strokes(), 1);
}

#[test]
fn stored_maps_are_shown_before_the_scene_is_read_but_never_those_of_other_labels() {
    let folder = tempfile::tempdir().unwrap();
    {
        let mut window = listed(folder.path());
        window.label("wall");
        read(&mut window, 0..0);
        window.worker().publish_all(window.generation(), 1);
        window.harness.run_steps(3);
        window.close();
    }
    {
        let mut window = listed(folder.path());
        window.until_window("the stored map is shown", |window| shown(window) == Some(1));
        assert!(window.workspace().reading.is_some());
        window.click_canvas(0.2, 0.2);
        window.until_saved();
        // The program ends without the maps of these labels.
        window.close();
    }
    let window = listed(folder.path());
    assert_eq!(window.strokes(), 2);
    assert!((0..FRAMES).all(|frame| window.workspace().newest_map(frame).is_none()));
    assert_eq!(shown(&window), None);
}
