//! The start page, opening, and help.

use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use inplace_ui::Target;

use crate::stand::*;

#[test]
fn the_question_mark_shows_every_key() {
    let mut window = Window::demo();
    window.press(Modifiers::SHIFT, Key::Questionmark);
    window.harness.get_by_label("Pause or resume training");
    window.harness.run_steps(5);
    window.click("Close");
    assert!(
        window
            .harness
            .query_by_label("Pause or resume training")
            .is_none()
    );
}

#[test]
fn a_path_that_cannot_be_opened_is_one_sentence_on_the_start_page_until_escape() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("broken.inplace");
    std::fs::write(&file, "not a project").unwrap();
    let mut window = Window::new(folder.path(), Some(Target::Path(file)));
    window.until("the error is shown", |app| {
        app.model().messages.texts().count() > 0
    });
    window.harness.get_by_label("Open a folder...");
    window.harness.get_by_label("Error");
    let state = window.harness.state().model();
    let text = state.messages.texts().next().unwrap();
    assert!(text.contains("broken.inplace"), "{text}");
    window.press(Modifiers::NONE, Key::Escape);
    assert_eq!(window.harness.state().model().messages.texts().count(), 0);
}
