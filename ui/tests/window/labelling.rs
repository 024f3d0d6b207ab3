//! Drawing on frames and what the worker answers.

use egui::{Key, PointerButton};
use inplace_core::session::{Event, Phase, Status};
use inplace_model::view::View;

use crate::stand::*;

#[test]
fn what_is_typed_is_a_class_and_a_scribble_a_stroke_for_the_worker_until_the_right_button_erases_it() {
    let mut window = Window::demo();
    // Nearly every letter is a shortcut.
    window.add_class("desk pane");
    assert_eq!(window.frame_index(), 0);
    assert!(!window.workspace().paused);
    window.sees("desk pane, 0 strokes");
    window.worker().received();
    let path = [
        window.canvas(-60.0, 0.0),
        window.canvas(0.0, 60.0),
        window.canvas(60.0, 0.0),
        window.canvas(-2000.0, 0.0),
    ];
    window.drag(PointerButton::Primary, &path);
    window.sees("desk pane, 1 stroke");
    let (_, stroke) = window.labels().strokes_of(0).next().unwrap();
    assert_eq!(stroke.lines[0].len(), 4, "every position is kept");
    assert_eq!(stroke.lines[0][3], [0, HEIGHT / 2], "it stays in the image");
    let (labels, generation) = window.worker().told_labels().unwrap();
    assert_eq!((labels.strokes.len(), generation), (1, window.generation()));
    window.drag(PointerButton::Secondary, &path);
    assert_eq!(window.strokes(), 0);
}

#[test]
fn two_fingers_zoom_and_draw_nothing() {
    let mut window = Window::with_classes(&["wall"]);
    let place = window.canvas(-40.0, 0.0);
    let zooms = [(), ()].map(|()| {
        window.pinch(place);
        match window.workspace().view {
            View::Free { zoom, .. } => zoom,
            view => panic!("{view:?}"),
        }
    });
    assert!((zooms[1] / zooms[0] - 2.0).abs() < 1e-3, "{zooms:?}");
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
    window.says("as soon as the surface");
    let status = Status {
        phase: Phase::Estimating { percent: 45 },
        ..Status::default()
    };
    window.tell(Event::Status(status));
    window.sees("Estimating depth: 45%");
    window.tell(Event::Status(Status::default()));
    window.misses("Importing labels");
}
