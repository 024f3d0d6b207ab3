//! Drawing on frames and what the worker answers.

use egui::{Key, Modifiers, PointerButton};
use inplace_core::session;
use inplace_core::session::{Event, Phase, Status};
use inplace_ui::canvas::FrameView;

use crate::stand::*;

#[test]
fn what_is_typed_is_a_class_and_a_click_a_stroke_whose_map_is_shown_and_undo_takes_it_back() {
    let mut window = Window::demo();
    // Nearly every letter is a shortcut.
    window.add_class("desk pane");
    assert_eq!(window.frame_index(), 0);
    assert!(!window.workspace().paused);
    window.sees("desk pane, 0 strokes");
    window.worker().received();
    window.click_canvas(0.0, 0.0);
    window.sees("desk pane, 1 stroke");
    let generation = window.generation();
    assert!(window.worker().received().iter().any(|command| matches!(
        command,
        session::Command::Labels { generation: sent, labels } if *sent == generation && labels.strokes.len() == 1
    )));
    window.worker().publish(0, generation, 1);
    window.until("the map is shown", |app| {
        let shown = app.canvas().frame().and_then(FrameView::map);
        shown.is_some_and(|shown| shown.map.generation == generation)
    });
    window.press(Modifiers::COMMAND, Key::Z);
    assert_eq!(window.strokes(), 0);
    window.press(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    assert_eq!(window.strokes(), 1);
}

#[test]
fn a_scribble_keeps_every_position_and_the_right_button_erases_it() {
    let mut window = Window::demo();
    window.add_class("wall");
    let path = [
        window.canvas(-60.0, 0.0),
        window.canvas(0.0, 60.0),
        window.canvas(60.0, 0.0),
    ];
    window.drag(PointerButton::Primary, &path);
    let labels = window.labels();
    let (_, stroke) = labels.strokes_of(0).next().unwrap();
    assert_eq!(stroke.lines[0].len(), 3);
    window.drag(PointerButton::Secondary, &path);
    assert_eq!(window.strokes(), 0);
}

#[test]
fn what_the_worker_reports_is_said() {
    let mut window = Window::demo();
    let sentence = "The surface could not be found.";
    window.tell(Event::Error(sentence.to_owned()));
    window.sees(sentence);
    window.click("Dismiss message");
    window.misses(sentence);
    let status = Status {
        phase: Phase::FindingSurface,
        spreading_import: true,
        ..Status::default()
    };
    window.tell(Event::Status(status));
    window.sees("Spreading them over the scene");
    window.key(Key::N);
    let said = window.messages();
    assert!(said.contains("as soon as the surface"), "{said}");
    window.tell(Event::Status(Status::default()));
    window.misses("Importing labels");
}
