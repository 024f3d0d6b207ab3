//! Everything that a person did within one frame is applied in the order in which it was done.

use egui::{Event, Key, Modifiers, Pos2, accesskit::Role};
use egui_kittest::kittest::Queryable;

use crate::stand::*;

fn typed(key: Key, text: &str) -> [Event; 2] {
    let pressed = Event::Key {
        key,
        physical_key: None,
        pressed: true,
        repeat: false,
        modifiers: Modifiers::NONE,
    };
    [pressed, Event::Text(text.to_owned())]
}

fn click(pos: Pos2) -> [Event; 3] {
    [Event::PointerMoved(pos), button(pos, true), button(pos, false)]
}

/// Feeds everything to one frame of the window, and lets it draw as often as it asks for.
fn in_one_frame(window: &mut Window, events: &[Vec<Event>]) {
    // The field that made the last class has the keyboard.
    window.key(Key::Escape);
    window.harness.input_mut().events.extend(events.concat());
    window.harness.run_steps(12);
}

#[test]
fn keys_clicks_and_letters_of_one_frame_find_their_class_and_their_field() {
    let mut window = Window::with_classes(&["wall", "floor", "sofa"]);
    let field = window.harness.get_by_role_and_label(Role::TextInput, "New class");
    let field = field.rect().center();
    let (left, middle, right) = (
        window.canvas(-60.0, 0.0),
        window.canvas(0.0, 0.0),
        window.canvas(60.0, 0.0),
    );
    let before = window.frame_index();
    // D and Q are shortcuts: the next frame, the next layer.
    let events = [
        typed(Key::Num2, "2").to_vec(),
        click(left).to_vec(),
        typed(Key::Num3, "3").to_vec(),
        click(middle).to_vec(),
        typed(Key::Num1, "1").to_vec(),
        click(right).to_vec(),
        click(field).to_vec(),
        typed(Key::D, "d").to_vec(),
        typed(Key::Q, "q").to_vec(),
        vec![typed(Key::Enter, "")[0].clone()],
    ];
    in_one_frame(&mut window, &events);
    let strokes = window.labels().strokes_of(0);
    let mut strokes: Vec<_> = strokes
        .map(|(_, stroke)| (stroke.lines[0][0][0], stroke.class))
        .collect();
    strokes.sort_unstable();
    let classes: Vec<_> = strokes.iter().map(|(_, class)| *class).collect();
    assert_eq!(classes, [2, 3, 1], "from left to right: {strokes:?}");
    assert_eq!(window.frame_index(), before);
    window.sees("dq, 0 strokes");
    // S is a shortcut, too, but after the key of the finder its letter is looked for.
    let events = [
        typed(Key::C, "c").to_vec(),
        typed(Key::S, "s").to_vec(),
        typed(Key::O, "o").to_vec(),
        vec![typed(Key::Enter, "")[0].clone()],
        click(middle).to_vec(),
    ];
    in_one_frame(&mut window, &events);
    window.sees("sofa, 2 strokes");
}

#[test]
fn letters_after_a_click_without_any_class_name_the_class_of_that_click() {
    let mut window = Window::demo();
    let places = [window.canvas(-60.0, 0.0), window.canvas(60.0, 0.0)];
    let enter = typed(Key::Enter, "")[0].clone();
    let letters = [typed(Key::D, "d"), typed(Key::A, "a")].concat();
    let events = [
        click(places[0]).to_vec(),
        letters,
        vec![enter],
        click(places[1]).to_vec(),
    ];
    in_one_frame(&mut window, &events);
    window.sees("da, 2 strokes");
}
