//! The objects of a class: in the list, by the pointer, and through the project file.

use egui::{Key, Modifiers};
use inplace_core::labels::ObjectId;
use inplace_model::Command;
use inplace_model::class_view::Named;
use inplace_model::layer::Layer;
use inplace_model::tool::{DrawnLine, Tool};

use crate::stand::*;

/// The row in which strokes are drawn.
const MIDDLE: u32 = HEIGHT / 2;

fn id(number: u16) -> ObjectId {
    ObjectId::new(number).unwrap()
}

fn listed(window: &Window) -> Vec<String> {
    let objects = window.labels().objects.iter();
    objects.map(|object| object.name.clone()).collect()
}

/// The line of an object in the list.
fn line(name: &str) -> String {
    format!("{name}, object of chair, {FRAMES} frames")
}

/// The maps follow, and the objects on them are listed.
fn follow(window: &mut Window, names: &[&str], gone: &str) {
    window.spread();
    let last = line(names[names.len() - 1]);
    window.until_window("the objects are found", |window| {
        window.shows(&last) && !window.shows(&line(gone))
    });
    for name in names {
        window.sees(&line(name));
    }
}

/// A chair at each end of a wall, with a stroke that names none, and floor between them.
fn two_chairs(mut window: Window) -> Window {
    for class in ["chair", "floor"] {
        window.add_class(class);
    }
    window.key(Key::Escape);
    for (class, x) in [(2, 32), (1, 8), (1, 56)] {
        window.act(Command::Choose(Named::Class(class)));
        window.point(Tool::Brush, [x, MIDDLE]);
    }
    window.click("List the objects of chair");
    follow(&mut window, &["chair 1", "chair 2"], "chair 3");
    window
}

#[test]
fn parts_of_a_class_are_named_merged_and_gone_on_with_and_undo_takes_each_back() {
    let mut window = two_chairs(Window::demo());
    let before = window.labels().clone();
    // By the stroke that lies on it.
    window.click_through(&["Actions for chair 1", "Rename"]);
    window.replace_text("Rename chair 1", "stool");
    assert_eq!(listed(&window), ["stool"]);
    assert_eq!(window.said().iter().flatten().count(), 1);
    follow(&mut window, &["stool", "chair 2"], "chair 1");
    let renamed = window.labels().clone();

    window.click_through(&["Actions for chair 2", "Merge into", "stool"]);
    let [floor, first, second] = window.said()[..] else {
        panic!("a stroke was added, though there is one on both");
    };
    assert!(floor.is_none() && first.is_some() && first == second);
    follow(&mut window, &["stool"], "chair 2");
    window.press(Modifiers::COMMAND, Key::Z);
    assert_eq!(window.labels(), &renamed);
    follow(&mut window, &["stool", "chair 1"], "chair 2");

    // Gone on with, a part takes the stroke along that is on it.
    window.click(&line("chair 1"));
    assert_eq!(window.workspace().said().unwrap().name, "chair 1");
    window.point(Tool::Brush, [60, MIDDLE]);
    assert_eq!(listed(&window), ["stool", "chair 1"]);
    assert_eq!(window.said().iter().flatten().count(), 3);
    // Deleted, it is still a chair, and its strokes are no more of it.
    let chosen = window.workspace().said().unwrap().id;
    window.act(Command::Delete(Named::Object(chosen)));
    assert_eq!((listed(&window), window.strokes()), (vec!["stool".to_owned()], 4));
    assert!(window.workspace().said().is_none());
    for _ in 0..3 {
        window.press(Modifiers::COMMAND, Key::Z);
    }
    assert_eq!(window.labels(), &before);
}

#[test]
fn a_stroke_with_ctrl_is_on_a_new_object_and_what_was_said_before_goes_on() {
    let mut window = two_chairs(Window::demo());
    window.act(Command::Choose(Named::Object(id(1))));
    window.click_canvas_with(Modifiers::COMMAND, 0.0, 0.0);
    assert_eq!(window.said(), [None, None, None, Some(3)]);
    assert_eq!(window.workspace().said().map(|said| said.id), Some(id(1)));
    // Of stuff there are none: nothing is drawn.
    window.act(Command::Choose(Named::Class(2)));
    let (tool, points) = (Tool::Brush, vec![[40, 8]]);
    window.act(Command::DrawObject(DrawnLine { tool, points }));
    window.says("\"floor\" is stuff");
    assert_eq!(window.strokes(), 4);
}

#[test]
fn an_object_is_gone_to_where_it_is_seen_best_and_a_lock_keeps_it_as_it_is() {
    let mut window = two_chairs(Window::demo());
    let (_, found) = window.workspace().objects_of(1)[1];
    let best = found.unwrap().click.clone().unwrap().frame;
    window.act(Command::GoToFrame((best + 1) % FRAMES));
    window.click_through(&["Actions for chair 2", "Show in its best frame"]);
    assert_eq!(window.frame_index(), best);
    window.act(Command::SetLocked(Named::Class(1), true));
    let before = window.labels().clone();
    for change in [
        Command::Rename(Named::Object(id(1)), "stool".to_owned()),
        Command::MergeObject(id(1), id(2)),
        Command::Delete(Named::Object(id(1))),
    ] {
        window.act(change);
    }
    assert_eq!(window.labels(), &before);
    window.says("\"chair\" is locked");
}

#[test]
fn a_locked_object_keeps_its_strokes_and_those_that_lie_on_it() {
    let mut window = two_chairs(Window::demo());
    let before = window.labels().clone();
    // No stroke names it: the one that lies on it is kept as well.
    window.click("Lock chair 1");
    window.sees(&format!("{}, locked", line("chair 1")));
    window.point(Tool::Erase, [8, MIDDLE]);
    window.says("\"chair 1\" is locked, so its strokes stay");
    window.act(Command::Choose(Named::Class(2)));
    window.point(Tool::Brush, [8, MIDDLE]);
    window.says("This would cover what is labelled \"chair 1\"");
    window.act(Command::Choose(Named::Object(id(1))));
    window.point(Tool::Brush, [20, MIDDLE]);
    window.says("unlock it in the class list to label with it");
    for change in [
        Command::Rename(Named::Object(id(1)), "stool".to_owned()),
        Command::MergeObject(id(1), id(2)),
        Command::MergeObject(id(2), id(1)),
        Command::Delete(Named::Class(1)),
        Command::MergeClass(1, 2),
    ] {
        window.act(change);
    }
    window.says("\"chair 1\" is locked: unlock it");
    assert_eq!(window.labels(), &before);
    // The other chair is free.
    window.point(Tool::Erase, [56, MIDDLE]);
    assert_eq!(window.strokes(), 2);
    window.press(Modifiers::COMMAND, Key::Z);
    window.click_through(&["Class list", "Unlock all"]);
    window.point(Tool::Erase, [8, MIDDLE]);
    assert_eq!(window.strokes(), 2);
}

#[test]
fn objects_are_hidden_one_by_one_or_all_but_one_and_the_project_keeps_that() {
    let folder = tempfile::tempdir().unwrap();
    let hidden = |window: &Window| {
        let hidden = window.workspace().document.palette().hidden.clone();
        [1, 2].map(|number| hidden.has(id(number)))
    };
    {
        let mut window = two_chairs(Window::with_demo(folder.path()));
        window.click_through(&["Actions for chair 2", "Show only this one"]);
        assert_eq!(
            (hidden(&window), window.model().settings.layer),
            ([true, false], Layer::Objects)
        );
        window.sees(&format!("{}, hidden", line("chair 1")));
        let strokes = window.labels().strokes.clone();
        let is_hidden = |window: &Window| -> Vec<bool> {
            let shown = strokes
                .iter()
                .map(|(&id, stroke)| window.workspace().is_stroke_hidden(id, stroke));
            shown.collect()
        };
        assert_eq!(is_hidden(&window), [true, true, false]);
        window.click("Show chair 1 in the overlay");
        assert_eq!(hidden(&window), [false; 2]);
        window.click_through(&["Actions for chair 1", "Show only this one"]);
        window.click_through(&["Actions for chair 1", "Show the others again"]);
        assert_eq!(hidden(&window), [false; 2]);
        window.click_through(&["Actions for chair 2", "Hide in the overlay"]);
        assert_eq!(
            (hidden(&window), is_hidden(&window)),
            ([false, true], vec![false, false, true])
        );
        window.act(Command::ShowOnly(id(1), true));
        window.click("Lock chair 1");
        window.close();
    }
    let mut window = Window::with_demo(folder.path());
    window.sees("Hide the objects of chair");
    assert_eq!(hidden(&window), [false, true]);
    assert!(window.workspace().is_object_locked(id(1)));
    let builds = |window: &Window| window.harness.state().canvas().strokes().builds;
    let before = builds(&window);
    window.spread();
    window.until_window("the objects are found", |window| {
        let chairs = window.workspace().objects_of(1);
        chairs.iter().any(|(_, found)| found.is_some())
    });
    assert!(
        builds(&window) > before,
        "the strokes on what is hidden are hidden"
    );
    // When it is gone, no other is hidden beside it.
    let locked = Command::SetLocked(Named::Object(id(1)), false);
    [locked, Command::MergeObject(id(1), id(2))]
        .into_iter()
        .for_each(|command| window.act(command));
    window.spread();
    window.until_window("all is shown", |window| hidden(window) == [false, true]);
    window.click_through(&["Class list", "Show all that is hidden"]);
    assert_eq!(hidden(&window), [false; 2]);
}
