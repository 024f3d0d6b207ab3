//! Suggestions.

use egui::{Key, Modifiers};
use inplace_core::guide::Suggestion;
use inplace_core::session::Event;

use crate::stand::*;

#[test]
fn a_suggestion_is_gone_to_and_labelled_with_a_likely_class() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = Window::with_demo(folder.path());
    window.add_class("wall");
    let suggestion = Suggestion {
        frame: 3,
        pixel: [20, 30],
        outline: vec![[10.0, 20.0], [30.0, 20.0], [20.0, 40.0]],
        score: 1.0,
        entropy: 0.6,
        share: 0.04,
        classes: vec![1],
    };
    let suggestions = Event::Suggestions {
        generation: 1,
        suggestions: vec![suggestion],
    };
    window.worker().events.send(suggestions).unwrap();
    for x in [0.0, 5.0] {
        window.harness.hover_at(window.canvas(x, 0.0));
        window.harness.run_steps(2);
    }
    window.press(Modifiers::NONE, Key::N);
    assert_eq!(window.workspace().frame_index(), 3);
    window.press(Modifiers::NONE, Key::A);
    window.click("Label as wall");
    assert_eq!(window.workspace().frame_index(), 3);
    let labels = window.workspace().document().labels();
    let (_, stroke) = labels.strokes_of(3).next().unwrap();
    assert_eq!((stroke.class, stroke.first_point()), (1, Some([20, 30])));
}
