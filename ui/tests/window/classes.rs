//! The class list.

use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use inplace_core::labels::{Class, PALETTES, StrokeId, read_class_list};
use inplace_model::Command;
use inplace_model::class_view::Named;
use inplace_model::tool::Tool;

use crate::stand::*;

fn names(window: &Window) -> Vec<String> {
    let classes = window.workspace().document.classes();
    classes.iter().map(|class| class.name.clone()).collect()
}

fn ids(window: &Window) -> Vec<u16> {
    let classes = window.workspace().document.classes();
    classes.iter().map(|class| class.id).collect()
}

/// Types into the field that has the keyboard.
fn type_text(window: &mut Window, field: &str, text: &str) {
    let role = egui::accesskit::Role::TextInput;
    window.harness.get_by_role_and_label(role, field).type_text(text);
    window.harness.run_steps(2);
}

#[test]
fn classes_are_renamed_merged_and_deleted_and_all_of_it_is_undone() {
    let mut window = Window::with_classes(&["wall", "floor"]);
    window.click_canvas(0.0, 0.0);

    window.click_through(&["Actions for wall", "Rename"]);
    let field = "Rename wall";
    for _ in 0..4 {
        window.key(Key::Backspace);
    }
    window.type_into(field, "ceiling");
    assert_eq!(names(&window), ["ceiling", "floor"]);

    window.click_through(&["Actions for floor", "Merge into", "ceiling"]);
    assert_eq!(names(&window), ["ceiling"]);
    window.sees("ceiling, 1 stroke");

    window.click_through(&["Actions for ceiling", "Delete with its stroke"]);
    assert_eq!(names(&window), [""; 0]);
    assert_eq!(window.strokes(), 0);

    for _ in 0..3 {
        window.press(Modifiers::COMMAND, Key::Z);
    }
    assert_eq!(names(&window), ["wall", "floor"]);
    assert_eq!(window.strokes(), 1);
}

#[test]
fn a_class_is_a_thing_or_stuff_by_its_name_until_its_menu_says_otherwise() {
    let mut window = Window::with_classes(&["chair", "floor"]);
    let things = |window: &Window| -> Vec<bool> {
        let classes = window.workspace().document.classes().iter();
        classes.map(|class| class.thing).collect()
    };
    assert_eq!(things(&window), [true, false]);
    window.click_through(&["Actions for chair", "Stuff"]);
    window.click_through(&["Actions for floor", "Thing (has objects)"]);
    assert_eq!(things(&window), [false, true]);
    window.press(Modifiers::COMMAND, Key::Z);
    assert_eq!(things(&window), [false, false]);
}

#[test]
fn a_locked_class_is_neither_drawn_nor_covered_nor_erased_nor_changed() {
    let mut window = Window::with_classes(&["wall", "floor"]);
    window.point(Tool::Brush, [8, 8]);
    window.act(Command::SetLocked(Named::Class(2), true));
    window.point(Tool::Brush, [20, 8]);
    window.says("unlock it in the class list to label with it");
    window.act(Command::ChooseSlot(1));
    window.point(Tool::Brush, [8, 8]);
    window.says("would cover what is labelled \"floor\"");
    assert_eq!(window.strokes(), 1);
    window.point(Tool::Brush, [20, 8]);
    assert_eq!(window.strokes(), 2, "beside it one may draw");
    window.point(Tool::Erase, [8, 8]);
    window.says("so its strokes stay");
    for change in [
        Command::Rename(Named::Class(2), "roof".to_owned()),
        Command::Delete(Named::Class(2)),
        Command::MergeClass(1, 2),
        Command::DeleteStroke(StrokeId(1)),
    ] {
        window.act(change);
    }
    window.says("to change it or its strokes");
    assert_eq!(names(&window), ["wall", "floor"]);
    assert_eq!(window.strokes(), 2);
    window.act(Command::UnlockAll);
    window.point(Tool::Erase, [8, 8]);
    assert_eq!(window.strokes(), 1);
}

#[test]
fn an_empty_list_offers_the_classes_of_data_sets_and_the_finder_chooses_and_makes_classes() {
    let mut window = Window::demo();
    window.click_through(&["NYU-13", "Add 13 classes"]);
    assert_eq!(window.workspace().document.classes(), PALETTES[0].classes());
    window.says("Added 13 classes.");
    assert!(window.workspace().class.is_some(), "none is ready to label with");
    window.press(Modifiers::COMMAND, Key::Z);
    assert!(names(&window).is_empty());
    window.press(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    assert_eq!(names(&window).len(), 13);

    let chosen = |window: &Window| {
        let class = window.workspace().class.unwrap();
        window.labels().class(class).map(|class| class.name.clone())
    };
    window.key(Key::C);
    type_text(&mut window, "Find class", "win");
    window.key(Key::Enter);
    assert_eq!(chosen(&window).as_deref(), Some("window"));
    window.misses("Find class");

    // "bed", "books", "ceiling": down and up again.
    window.key(Key::C);
    for key in [Key::ArrowDown, Key::ArrowDown, Key::ArrowUp, Key::Enter] {
        window.key(key);
    }
    assert_eq!(chosen(&window).as_deref(), Some("books"));
    assert_eq!(window.frame_index(), 0, "the arrows went to the frames");

    window.key(Key::C);
    type_text(&mut window, "Find class", "zebra");
    window.sees("New class \"zebra\"");
    window.key(Key::Enter);
    assert_eq!(chosen(&window).as_deref(), Some("zebra"));
    assert_eq!(names(&window).len(), 14);

    window.key(Key::C);
    type_text(&mut window, "Find class", "tab");
    window.key(Key::Escape);
    window.misses("Find class");
    assert_eq!(chosen(&window).as_deref(), Some("zebra"));
    // Keys mean what they did before.
    window.key(Key::D);
    assert_eq!(window.frame_index(), 1);
}

#[test]
fn a_long_list_is_searched_and_ticked_and_taken_numbers_are_said() {
    let mut window = Window::demo();
    window.add_class("Chair");
    window.click_through(&["Class list", "Add classes...", "COCO-Stuff"]);
    window.sees("Add 0 classes");
    window.type_into("Search in the list", "person");
    window.click_through(&["person", "Add 1 class"]);
    // The chair has number 1, which is that of persons in COCO.
    assert_eq!(names(&window), ["Chair", "person"]);
    assert_eq!(ids(&window), [1, 2]);
    window.says("person (1 is now 2)");

    window.click_through(&["Class list", "Add classes...", "COCO-Stuff"]);
    window.type_into("Search in the list", "chair");
    window.click("Tick all");
    window.sees("Add 0 classes");
    window.click("Cancel");
    assert_eq!(names(&window).len(), 2);
}

#[test]
fn a_list_of_ones_own_is_written_and_read_and_a_bad_one_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let (file, bad) = (folder.path().join("mine.json"), folder.path().join("bad.json"));
    {
        let mut window = Window::with_demo(folder.path());
        window.add_class("wall");
        window.add_class("mug");
        window.click_through(&["Class list", "Save classes as a file..."]);
        window.replace_text("Class list file", file.to_str().unwrap());
        window.until_told();
        window.says("mine.json");
        let written = read_class_list(&file).unwrap();
        assert_eq!(written, [Class::new(1, "wall"), Class::new(2, "mug")]);
    }
    std::fs::write(&bad, r#"[{"id": 1, "name": "a"}, {"id": 1, "name": "b"}]"#).unwrap();
    let other = tempfile::tempdir().unwrap();
    let mut window = Window::with_demo(other.path());
    window.click_through(&["ScanNet-20", "From a file"]);
    window.type_into("Class list file", "");
    window.replace_text("Class list file", bad.to_str().unwrap());
    window.until_window("the refusal is shown", |window| {
        let refusal = window.harness.query_by_label_contains("bad.json: cannot be used");
        refusal.is_some()
    });
    window.sees_part("listed twice");

    window.replace_text("Class list file", file.to_str().unwrap());
    window.until_window("the classes are shown", |window| window.shows("Add 2 classes"));
    window.click("Add 2 classes");
    assert_eq!(names(&window), ["wall", "mug"]);
}

#[test]
fn locks_hidden_classes_and_their_order_are_kept_in_the_project() {
    let folder = tempfile::tempdir().unwrap();
    {
        let mut window = Window::with_demo(folder.path());
        window.add_class("wall");
        window.add_class("floor");
        window.click_through(&["Lock wall", "Actions for floor", "Hide in the overlay"]);
        let palette = window.workspace().document.palette();
        assert_eq!((palette.class(1)[3], palette.class(2)[3]), (255, 0));
        window.click_through(&["Actions for floor", "Move up"]);
        window.close();
    }
    let mut window = Window::with_demo(folder.path());
    window.sees("wall, 0 strokes, locked");
    window.sees("floor, 0 strokes, hidden");
    assert_eq!(names(&window), ["floor", "wall"]);
    window.click_through(&[
        "Class list",
        "Show all that is hidden",
        "Class list",
        "Unlock all",
    ]);
    window.sees("wall, 0 strokes");
    window.sees("floor, 0 strokes");
    let palette = window.workspace().document.palette();
    assert_eq!(palette.class(2)[3], 255);
}

#[test]
fn the_order_decides_which_digit_chooses_a_class() {
    let mut window = Window::with_classes(&["wall", "floor", "door"]);
    window.click_through(&["Actions for door", "Move up"]);
    assert_eq!(ids(&window), [1, 3, 2]);
    window.key(Key::Num2);
    assert_eq!(window.workspace().class, Some(3));

    // By dragging it over the first, into its upper half.
    let from = window.rect("door, 0 strokes").center();
    let to = window.rect("wall, 0 strokes");
    let to = to.center_top() + egui::vec2(0.0, 3.0);
    let moved = |share| vec![egui::Event::PointerMoved(from.lerp(to, share))];
    let pressed = [moved(0.0), vec![button(from, true)]].concat();
    for events in [
        pressed,
        moved(0.3),
        moved(0.7),
        moved(1.0),
        vec![button(to, false)],
    ] {
        window.harness.input_mut().events.extend(events);
        window.harness.run_steps(2);
    }
    assert_eq!(ids(&window), [3, 1, 2]);

    // And by the keyboard.
    window.focus("door, 0 strokes");
    window.press(Modifiers::ALT, Key::ArrowDown);
    window.press(Modifiers::ALT, Key::ArrowDown);
    assert_eq!(ids(&window), [1, 2, 3]);
    for order in [[1, 3, 2], [3, 1, 2], [1, 3, 2], [1, 2, 3]] {
        window.press(Modifiers::COMMAND, Key::Z);
        assert_eq!(ids(&window), order);
    }
}

#[test]
fn a_long_list_shows_the_class_that_is_chosen_elsewhere_and_has_a_search_field() {
    let mut window = Window::demo();
    window.add_class("wall");
    window.misses("Search classes");
    window.click_through(&["Class list", "Add classes...", "Add 12 classes"]);
    let last = window.workspace().document.classes()[12].clone();
    let line = format!("{}, 0 strokes", last.name);
    window.misses(&line);
    window.act(Command::Choose(Named::Class(last.id)));
    window.harness.run_steps(4);
    window.sees(&line);
    let first = window.workspace().document.classes()[0].id;
    for class in [first, last.id, first] {
        window.act(Command::Choose(Named::Class(class)));
    }
    window.harness.run_steps(60);
    window.sees("wall, 0 strokes");
    window.misses(&line);
    window.type_into("Search classes", "wi");
    window.sees("window, 0 strokes");
    window.misses("bed, 0 strokes");
    window.type_into("Search classes", "qqq");
    window.sees("No class has this in its name.");
    window.sees("void, 0 strokes");
}
