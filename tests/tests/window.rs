//! The window from the outside: a screen, a pointer and a keyboard, and the files that come of it.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "a test ends where it fails")]

use std::collections::HashSet;
use std::time::Duration;

use inplace_core::project::Project;
use inplace_tests::{
    OnDisk, PATIENCE, Running, Small, TRACE, Window, class_ids, inplace, one_line, projects_below, skip,
    strokes_of, until,
};

/// Two places in the frame in view, whatever the panels around it, far from each other.
const PLACES: [[u32; 2]; 2] = [[620, 240], [620, 500]];

#[test]
fn a_scene_is_shown_labelled_with_the_pointer_exported_and_kept() {
    let window = match Window::open(|folder| Small::get().write(folder), &["--trace", TRACE]) {
        Ok(window) => window,
        Err(missing) => return skip(&missing),
    };
    window.until("the frame is shown", |window| {
        let picture = window.screen.picture();
        let places = (480..760)
            .step_by(8)
            .flat_map(|x| (260..480).step_by(8).map(move |y| (x, y)));
        let colors: HashSet<_> = places.map(|(x, y)| picture.get_pixel(x, y).0).collect();
        (colors.len() > 30).then_some(())
    });
    // The first click asks what is there, before there is a class.
    window.fill(|window| window.screen.click(PLACES[0]), "wall");
    window.until_told("the first stroke", |trace| (trace.strokes() == 1).then_some(()));
    window.fill(|window| window.screen.key("c"), "floor");
    // A dialog takes the clicks of the moment after it was confirmed.
    std::thread::sleep(Duration::from_millis(500));
    window.screen.click(PLACES[1]);
    window.until_told("the second stroke", |trace| (trace.strokes() == 2).then_some(()));
    let classes = window.trace().classes();
    let names: Vec<&str> = classes.iter().map(|(_, name)| name.as_str()).collect();
    assert_eq!(names, ["wall", "floor"]);
    window.follow();
    let folder = window.home.path().join("labels-by-hand");
    window.export(&folder);

    let Window {
        running,
        screen,
        id,
        home,
    } = window;
    screen.close_window(&id);
    let outcome = running.wait(PATIENCE);
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    let kept = projects_below(&home.path().join("data/inplace/autosave"));
    assert_eq!(kept.len(), 1, "{kept:?}");
    let (_, contents) = Project::open(&kept[0]).unwrap();
    assert_eq!(contents.maps.len(), Small::get().scene.frames.len());
    let strokes = strokes_of(&contents);
    let said: Vec<u16> = strokes.iter().map(|stroke| stroke.class).collect();
    assert_eq!(said, [1, 2]);
    for (index, frame) in Small::get().scene.frames.iter().enumerate() {
        let (width, height, labels) = class_ids(&folder.join(format!("labels/{}.png", frame.stem)));
        assert_eq!((width, height), (frame.camera.width, frame.camera.height));
        let all_known = labels.iter().all(|label| [1, 2].contains(label));
        assert!(all_known, "{}", frame.stem);
        for stroke in strokes.iter().filter(|stroke| stroke.frame == index) {
            let [x, y] = stroke.first_point().unwrap();
            assert_eq!(labels[(y * width + x) as usize], stroke.class);
        }
    }
}

#[test]
fn without_a_display_a_scene_is_refused_in_one_sentence() {
    let disk = OnDisk::default();
    let outcome = Running::to_the_end(inplace().arg(disk.path("room")));
    assert_eq!(outcome.code, Some(1), "{outcome:?}");
    let line = one_line(&outcome.stderr);
    assert!(line.starts_with("there is no display"), "{line}");
    assert!(line.contains("DISPLAY"), "{line}");
}

#[test]
fn without_a_display_and_without_a_scene_the_demo_is_labelled() {
    let root = tempfile::tempdir().unwrap();
    let mut running = Running::start(inplace().current_dir(root.path()));
    until("the demo is being labelled", PATIENCE, || {
        assert!(running.ended().is_none(), "{}", running.stderr());
        root.path().join("inplace-demo/labels").is_dir().then_some(())
    });
    // Where frames take long to read, their progress follows.
    let told = running.stderr();
    let line = one_line(told.lines().next().unwrap_or_default());
    assert!(line.contains("no display"), "{line}");
    assert!(line.contains("./inplace-demo"), "{line}");
}
