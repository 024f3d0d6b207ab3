//! The class list.

use egui::{Key, Modifiers, PointerButton};
use egui_kittest::kittest::Queryable;

use crate::stand::*;

#[test]
fn classes_are_renamed_merged_and_deleted_and_all_of_it_is_undone() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = Window::with_demo(folder.path());
    window.add_class("wall");
    window.add_class("floor");
    let place = window.canvas(0.0, 0.0);
    window.drag(PointerButton::Primary, &[place]);
    let names = |window: &Window| -> Vec<String> {
        let classes = window.workspace().document().classes();
        classes.iter().map(|class| class.name.clone()).collect()
    };

    window.click("Actions for wall");
    window.click("Rename");
    let field = "Rename wall";
    for _ in 0..4 {
        window.press(Modifiers::NONE, Key::Backspace);
    }
    window.type_into(field, "ceiling");
    assert_eq!(names(&window), ["ceiling", "floor"]);

    window.click("Actions for floor");
    window.click("Merge into");
    window.click("ceiling");
    assert_eq!(names(&window), ["ceiling"]);
    window.harness.get_by_label("ceiling, 1 stroke");

    window.click("Actions for ceiling");
    window.click("Delete with its stroke");
    assert_eq!(names(&window), [""; 0]);
    assert_eq!(window.strokes(), 0);

    for _ in 0..3 {
        window.press(Modifiers::COMMAND, Key::Z);
    }
    assert_eq!(names(&window), ["wall", "floor"]);
    assert_eq!(window.strokes(), 1);
}
