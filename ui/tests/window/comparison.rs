//! The open scene compared with another project of it.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use egui::Key;
use inplace_core::labels::{ClassId, History, Stroke};
use inplace_core::project::{Contents, Project, SceneRecord};
use inplace_core::scene::{OpenOptions, SceneSource};
use inplace_core::session::FrameMap;
use inplace_model::Command;
use inplace_model::frames::FrameOrder;
use inplace_model::layer::Layer;

use crate::stand::*;

/// A colleague's project, which numbers the classes the other way round: the floor is 1. Of the first frame its left half is
/// floor, all else is wall, but for the last frame, which is void.
fn of_anna(folder: &Path) -> PathBuf {
    let scene = scene(SceneSource::Demo);
    let mut history = History::default();
    for class in ["floor", "wall"] {
        let (id, _) = history.add_class(class);
        history.add_stroke(Stroke::click(0, id, [3, 3]));
    }
    let class = |frame: usize, pixel: u32| -> ClassId {
        match frame {
            0 if pixel % WIDTH < WIDTH / 2 => 1,
            frame if frame + 1 == FRAMES => 0,
            _ => 2,
        }
    };
    let map = |frame: usize| {
        let pixels = WIDTH * HEIGHT;
        let labels: Vec<ClassId> = (0..pixels).map(|pixel| class(frame, pixel)).collect();
        let map = FrameMap::new(frame, 1, [WIDTH, HEIGHT], labels, vec![0; pixels as usize]);
        Arc::new(map.unwrap())
    };
    let mut contents = Contents::new(SceneRecord::of(&scene, OpenOptions::default()), history);
    contents.maps = (0..FRAMES).map(map).collect();
    let project = folder.join("anna.inplace");
    drop(Project::create(&project, &contents).unwrap());
    project
}

/// A window that says wall everywhere, compared with the project of [`of_anna`].
fn compared(folder: &Path) -> Window {
    let project = of_anna(folder);
    let mut window = Window::with_demo(folder);
    for class in ["wall", "floor"] {
        window.add_class(class);
    }
    window.key(Key::Escape);
    window.worker().publish_all(window.generation(), 1);
    window.click_through(&["File", "Compare with..."]);
    window.replace_text("Project to compare with", project.to_str().unwrap());
    window.until("all frames are compared", |app| {
        let workspace = app.model().workspace().unwrap();
        let comparison = workspace.comparison.as_ref();
        comparison.is_some_and(|comparison| comparison.of_scene().is_some())
    });
    window.until("the plane is made", |app| {
        let frame = app.canvas().frame();
        frame.is_some_and(|frame| frame.differences().is_some())
    });
    window
}

#[test]
fn differences_are_a_layer_with_numbers_and_frames_that_differ_come_first() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = compared(folder.path());
    assert_eq!(window.model().settings.layer, Layer::Differences);
    window.sees(
        "Differences: Compared with anna, Another class there, A class in only one of the two, \
         Same class: 50.0% here, 87.5% in the scene",
    );
    let palette = window.workspace().document.palette();
    let content = window.frame().content(Layer::Differences, palette);
    let over = content.unwrap().over.unwrap();
    // By name, not by number: different on the left, the same on the right.
    assert!(over.greyed && over.texels.values()[0] == 3);
    assert_eq!(over.texels.values()[WIDTH as usize - 1], 1);
    for (x, class) in [(-40.0, "floor"), (40.0, "wall")] {
        window.hover(window.canvas(x, 0.0));
        window.sees_part(&format!("; wall; anna: {class}; "));
    }
    window.key(Key::T);
    window.sees("87.5% of the scene, 50.0% of this frame has the same class in anna");
    let last = window.rect("End comparison");
    assert!(last.right() <= 1280.0, "it is cut off: {last}");
    window.act(Command::GoToFrame(1));
    window.sees("87.5% of the scene, 100.0% of this frame has the same class in anna");
    window.click("Different frames first");
    let frames = &window.workspace().overview.frames;
    assert_eq!((frames.order, frames.shown[0]), (FrameOrder::Difference, 0));
    // On the last one nothing is labelled twice.
    assert_eq!(frames.shown[FRAMES - 1], FRAMES - 1);
    window.sees_part("Frame rgb_0: no strokes, 50.0% as in the other project, ");

    // What is said meanwhile counts.
    window.act(Command::GoToFrame(0));
    window.publish(0, 2);
    window.until("the numbers follow", |app| {
        let workspace = app.model().workspace().unwrap();
        let counts = workspace.comparison.as_ref().unwrap().of_frame(0).unwrap();
        counts.different == u64::from(WIDTH * HEIGHT / 2) && workspace.newest_map(0).unwrap().labels()[0] == 2
    });
    window.key(Key::Q);
    assert_eq!(window.model().settings.layer, Layer::Depth);
}

#[test]
fn the_end_of_a_comparison_leaves_nothing_of_it() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = compared(folder.path());
    window.act(Command::OrderFrames(FrameOrder::Difference));
    window.click_through(&["File", "End comparison"]);
    assert!(window.workspace().comparison.is_none());
    assert_eq!(window.model().settings.layer, Layer::Labels);
    assert_eq!(window.workspace().overview.frames.order, FrameOrder::Capture);
    assert_eq!(
        Layer::Disagreement.next(window.model().is_compared()),
        Layer::Depth
    );
    window.click("Layer");
    window.misses(Layer::Differences.name());
    window.key(Key::Escape);

    // Nor does a project that is closed while it is compared.
    let folder = tempfile::tempdir().unwrap();
    let mut window = compared(folder.path());
    let project = folder.path().join("own.inplace");
    window.save_as(&project);
    window.until_saved();
    window.close();
    let bytes = std::fs::read(&project).unwrap();
    assert!(!bytes.windows(4).any(|part| part == b"anna"));
    let window = Window::opened(folder.path(), inplace_ui::Target::Project(project));
    assert_eq!(window.model().settings.layer, Layer::Labels);
}

#[test]
fn what_cannot_be_compared_with_is_said_in_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = Window::with_demo(folder.path());
    let own = folder.path().join("own.inplace");
    window.save_as(&own);
    let scene = scene(SceneSource::Folder("other".into()));
    let record = |scene| SceneRecord::of(scene, OpenOptions::default());
    let write = |name: &str, contents: &Contents| {
        let path = folder.path().join(name);
        drop(Project::create(&path, contents).unwrap());
        path
    };
    let mut history = History::default();
    let (class, _) = history.add_class("wall");
    history.add_stroke(Stroke::click(0, class, [3, 3]));
    let other_scene = write("other.inplace", &Contents::new(record(&scene), history));
    let here = crate::stand::scene(SceneSource::Demo);
    let empty = write("empty.inplace", &Contents::new(record(&here), History::default()));
    for (project, words) in [
        (
            own,
            "own.inplace: is the project that is open; choose another one",
        ),
        (other_scene, "has none of the 5 frames of this project"),
        (empty, "empty.inplace: nothing is labelled in it"),
        (
            folder.path().join("none.inplace"),
            "none.inplace: no such project file",
        ),
    ] {
        window.act(Command::CompareWith(project));
        window.until(words, |app| app.model().beginning_comparison.is_none());
        window.says(words);
        assert!(window.workspace().comparison.is_none());
    }
}
