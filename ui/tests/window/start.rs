//! The start page, opening, and help.

use egui::Key;
use inplace_ui::Target;

use crate::stand::*;

#[test]
fn a_path_that_cannot_be_opened_is_one_sentence_on_the_start_page_until_escape() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("broken.inplace");
    std::fs::write(&file, "not a project").unwrap();
    let mut window = Window::new(folder.path(), Some(Target::Path(file)));
    window.until_told();
    window.sees("Open a folder...");
    window.sees("Error");
    let state = window.model();
    let text = state.messages.texts().next().unwrap();
    assert!(text.contains("broken.inplace"), "{text}");
    window.key(Key::Escape);
    assert_eq!(window.model().messages.texts().count(), 0);
}
