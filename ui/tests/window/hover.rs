//! What a click at the pointer would win, before it is made.

use std::sync::Arc;

use egui::Key;
use inplace_core::labels::{Run, Stroke, StrokeKind};
use inplace_core::semantics::NodeMap;
use inplace_core::session::{self, Event, Preview};
use inplace_model::Command;

use crate::stand::*;

/// The strokes that the worker was asked about since the last call.
fn asked(window: &Window) -> Vec<Stroke> {
    let stroke = |command| match command {
        session::Command::Preview(stroke) => Some(stroke),
        _ => None,
    };
    let commands = window.worker().received().into_iter();
    commands.filter_map(stroke).collect()
}

/// An answer to a question: two rows of ten pixels from the place on, the second half of each on a voxel that reaches
/// beyond.
fn answer(stroke: &Stroke, generation: u64) -> Event {
    let [x, y] = stroke.first_point().unwrap();
    let run = |row, pixels| Run {
        row,
        first: x,
        last: x + pixels - 1,
    };
    let mut nodes = vec![0; (WIDTH * HEIGHT) as usize];
    for row in [y, y + 1] {
        let first = (row * WIDTH + x) as usize;
        nodes[first..first + 5].fill(1);
    }
    Event::Preview {
        generation,
        preview: Arc::new(Preview {
            stroke: stroke.clone(),
            won: vec![run(y, 10), run(y + 1, 10)],
            nodes: Arc::new(NodeMap::pack(WIDTH as usize, &nodes)),
        }),
    }
}

fn outlined(window: &Window) -> Option<u64> {
    let shown = window.workspace().hover.shown.as_ref();
    shown.map(|preview| preview.pixels())
}

/// A window with a class, a map of no class and the pointer on its frame, and what was asked of that.
fn hovering() -> (Window, Stroke) {
    let mut window = Window::with_classes(&["wall", "floor"]);
    window.hover(window.canvas(0.0, 0.0));
    assert!(
        asked(&window).is_empty(),
        "before there is a map there is nothing to win"
    );
    window.publish(0, 0);
    let questions = asked(&window);
    assert_eq!(questions.len(), 1);
    (window, questions[0].clone())
}

#[test]
fn a_click_at_the_pointer_is_asked_about_once_and_its_outline_goes_with_what_it_is_of() {
    let (mut window, click) = hovering();
    let settings = window.model().settings;
    assert_eq!((click.frame, click.class, click.radius), (0, 2, settings.brush));
    assert_eq!(click.kind(), StrokeKind::Click);
    let generation = window.generation();
    window.tell(answer(&click, generation - 1));
    assert_eq!(outlined(&window), None, "it is of older labels");
    window.tell(answer(&click, generation));
    assert_eq!(outlined(&window), Some(20));
    window.sees_part("a click wins below 1%");
    assert!(asked(&window).is_empty(), "nothing has changed");

    // It moves along with the pointer, and is asked about anew.
    window.hover(window.canvas(40.0, 0.0));
    assert_eq!(outlined(&window), Some(20));
    let moved = asked(&window);
    assert!(moved.len() == 1 && moved[0].lines != click.lines);
    // Another class, another brush.
    window.key(Key::Num1);
    assert_eq!((outlined(&window), asked(&window)[0].class), (None, 1));
    window.tell(answer(&moved[0], generation));
    assert_eq!(outlined(&window), None, "it is of another class");
    window.key(Key::CloseBracket);
    let questions = asked(&window);
    assert!(questions[0].radius > click.radius);
    window.tell(answer(&questions[0], generation));
    // A better map of the same labels.
    window.publish(0, 0);
    assert_eq!((outlined(&window), asked(&window).len()), (Some(20), 1));
    // Nothing that would spread a class.
    for (without, with) in [(Key::E, Key::B), (Key::Num0, Key::Num1), (Key::V, Key::V)] {
        window.key(without);
        assert!(asked(&window).is_empty(), "{without:?}");
        window.key(with);
        window.hover(window.canvas(40.0, 0.0));
        assert_eq!(asked(&window).len(), 1, "{with:?}");
    }
    for (on, questions) in [(false, 0), (true, 1)] {
        window.act(Command::SetPreview(on));
        assert_eq!(asked(&window).len(), questions);
    }
    window.hover(egui::Pos2::ZERO);
    window.tell(answer(&click, generation));
    assert_eq!(outlined(&window), None, "the pointer is elsewhere");
}

#[test]
fn a_pointer_that_rests_while_keys_answer_suggestions_outlines_nothing() {
    let (mut window, click) = hovering();
    let generation = window.generation();
    window.tell(answer(&click, generation));
    window.suggest(generation, vec![suggestion(0)]);
    assert_eq!(outlined(&window), Some(20));
    window.key(Key::N);
    assert_eq!((outlined(&window), asked(&window).len()), (None, 0));
    window.key(Key::Escape);
    assert_eq!(asked(&window).len(), 1, "keys answer nothing any more");
    window.key(Key::N);
    assert_eq!(asked(&window).len(), 0);
    window.hover(window.canvas(40.0, 0.0));
    assert_eq!(asked(&window).len(), 1, "it points at something");
    window.key(Key::Escape);
    window.key(Key::V);
    assert_eq!(asked(&window).len(), 0);
    window.act(Command::GoToSuggestion(0));
    window.key(Key::V);
    assert_eq!(asked(&window).len(), 0, "it rested over the 3D view, too");
}

#[test]
fn what_is_outlined_becomes_a_label_by_one_key_and_is_taken_back_in_one_step() {
    let (mut window, click) = hovering();
    window.tell(answer(&click, window.generation()));
    window.key(Key::R);
    let labels = window.labels();
    let region = labels.strokes.last_key_value().unwrap().1;
    assert_eq!((region.kind(), region.class), (StrokeKind::Polygon, 2));
    assert_eq!(
        region.pixel_count(WIDTH, HEIGHT),
        10,
        "only the part at the pointer"
    );
    assert_eq!(outlined(&window), None, "the labels have changed");
    window.press(egui::Modifiers::COMMAND, Key::Z);
    assert_eq!(window.strokes(), 0);
    window.key(Key::R);
    assert_eq!(window.strokes(), 0);
    assert!(window.messages().contains("Nothing is outlined"));
}
