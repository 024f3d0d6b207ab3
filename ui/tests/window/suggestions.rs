//! Suggestions: going from one to the next and answering them, by keys and by buttons.

use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use inplace_core::guide::{Likely, Suggestion};
use inplace_core::labels::{ClassId, Pixel};
use inplace_core::scene::SceneSource;
use inplace_model::Command;
use inplace_model::class_view::Named;
use inplace_model::dialogs::ClassUse;
use inplace_model::preferences::PreferenceChange;
use inplace_model::suggestions::Mode;
use inplace_model::tool::Tool;
use inplace_model::view::View;
use inplace_ui::{Target, UiOptions};
use serde_json::{Value, json};

use crate::stand::*;

const WALL: ClassId = 1;
const FLOOR: ClassId = 2;

/// A place on a frame; frames are a metre apart.
pub fn place(frame: usize, pixel: Pixel, classes: &[ClassId]) -> Suggestion {
    let [x, y] = pixel.map(|at| at as f32);
    let likely = |(rank, &class): (usize, &ClassId)| Likely {
        class,
        object: None,
        probability: 0.6 / (rank + 1) as f32,
    };
    Suggestion {
        pixel,
        position: [frame as f32, 0.0, 0.0].into(),
        outline: vec![[x - 8.0, y - 8.0], [x + 8.0, y - 8.0], [x, y + 8.0]],
        classes: classes.iter().enumerate().map(likely).collect(),
        ..suggestion(frame)
    }
}

/// The list that belongs to the present labels.
fn suggest_now(window: &mut Window, suggestions: Vec<Suggestion>) {
    let generation = window.generation();
    window.suggest(generation, suggestions);
}

/// Frames of the listed places.
fn listed(window: &Window) -> Vec<usize> {
    let suggestions = &window.workspace().suggestions().listed;
    suggestions.iter().map(|suggestion| suggestion.frame).collect()
}

/// Class and place of the newest stroke.
fn last_stroke(window: &Window) -> (usize, ClassId, Pixel) {
    let labels = window.labels();
    let (_, stroke) = labels.strokes.last_key_value().unwrap();
    (stroke.frame, stroke.class, stroke.first_point().unwrap())
}

#[test]
fn enter_accepts_and_the_list_that_knows_it_leads_on() {
    let mut window = Window::with_classes(&["wall", "floor"]);
    let before = window.generation();
    window.suggest(before, vec![place(3, [20, 30], &[FLOOR, WALL])]);
    window.key(Key::N);
    window.sees_part("Enter: floor, 1: wall");
    window.key(Key::Enter);
    assert_eq!(last_stroke(&window), (3, FLOOR, [20, 30]));
    window.sees_part("Looking for the next place");
    window.sees("Labelled floor");
    window.sees("Last answer: floor");
    window.key(Key::Enter);
    assert_eq!(window.strokes(), 1, "there is nothing to accept meanwhile");

    window.suggest(before, vec![place(4, [9, 9], &[WALL])]);
    assert_eq!(window.frame_index(), 3, "that list is older than the answer");
    suggest_now(&mut window, vec![place(2, [8, 8], &[WALL])]);
    assert_eq!(window.frame_index(), 2);
    window.press(Modifiers::SHIFT, Key::Enter);
    assert_eq!(window.strokes(), 1, "no second class is likely there");
    window.sees_part("Suggestion 1 of 1");
    window.key(Key::Enter);
    suggest_now(&mut window, Vec::new());
    window.sees("There is nothing left to suggest.");
    assert!(!window.workspace().suggestions().is_active());
}

#[test]
fn n_goes_through_the_places_and_digits_answer_the_one_at_hand_and_choose_classes_otherwise() {
    let mut window = Window::with_classes(&["wall", "floor"]);
    let list = vec![
        place(3, [20, 30], &[WALL]),
        place(1, [40, 10], &[WALL]),
        place(2, [8, 8], &[]),
    ];
    suggest_now(&mut window, list);
    window.key(Key::Num1);
    assert_eq!((window.workspace().class, window.strokes()), (Some(WALL), 0));
    window.key(Key::N);
    assert_eq!(window.frame_index(), 3);
    let near = window.workspace().view != View::Whole;
    assert!(near, "a small place is shown from near");
    window.sees_part("Suggestion 1 of 3");
    window.key(Key::N);
    assert_eq!(window.frame_index(), 1);
    // Round and back.
    for (modifiers, frame) in [(Modifiers::SHIFT, 3), (Modifiers::SHIFT, 2), (Modifiers::NONE, 3)] {
        window.press(modifiers, Key::N);
        assert_eq!((window.frame_index(), window.strokes()), (frame, 0));
    }
    window.key(Key::Num2);
    assert_eq!(last_stroke(&window), (3, FLOOR, [20, 30]));
    assert_eq!(window.workspace().class, Some(WALL), "the brush keeps its class");
    // Whoever does not want to wait goes on with the list that is there.
    window.key(Key::N);
    window.key(Key::Num0);
    assert_eq!(last_stroke(&window), (1, 0, [40, 10]));
    window.key(Key::N);
    window.key(Key::Num9);
    assert_eq!(window.strokes(), 2, "there is no ninth class");
    assert_eq!(window.workspace().suggestions().at(), Some(2));
}

#[test]
fn a_name_labels_the_place_and_adds_the_class_where_it_is_new() {
    let mut window = Window::with_classes(&["wall", "floor"]);
    let list = vec![place(3, [20, 30], &[]), place(1, [40, 10], &[])];
    suggest_now(&mut window, list);
    window.key(Key::N);
    window.key(Key::C);
    window.type_into("Find class", "Floor");
    assert_eq!(last_stroke(&window), (3, FLOOR, [20, 30]));
    window.key(Key::N);
    window.key(Key::C);
    window.type_into("Find class", "lamp");
    assert_eq!(last_stroke(&window), (1, 3, [40, 10]));
    window.sees("lamp, 1 stroke");
    suggest_now(&mut window, vec![place(0, [9, 9], &[3])]);
    assert_eq!(window.workspace().suggestions().at(), Some(0));
}

#[test]
fn a_skipped_place_is_not_suggested_again_until_it_is_asked_for() {
    let mut window = Window::with_classes(&["wall", "floor"]);
    let generation = window.generation();
    let list = || vec![place(3, [20, 30], &[WALL]), place(1, [40, 10], &[WALL])];
    window.suggest(generation, list());
    window.key(Key::N);
    window.key(Key::X);
    assert_eq!((listed(&window), window.frame_index()), (vec![1], 1));
    window.suggest(generation, list());
    assert_eq!(listed(&window), [1]);
    // Something else is likely there now.
    window.suggest(generation, vec![place(3, [20, 30], &[FLOOR])]);
    assert_eq!(listed(&window), [1, 3]);
    window.key(Key::X);
    window.key(Key::Delete);
    assert!(listed(&window).is_empty() && !window.workspace().suggestions().is_active());
    assert_eq!(window.strokes(), 0);
    window.click("List them again");
    assert_eq!(listed(&window).len(), 2);
}

#[test]
fn undo_shows_the_answered_place_again_and_redo_goes_on() {
    let mut window = Window::with_classes(&["wall", "floor"]);
    suggest_now(&mut window, vec![place(3, [20, 30], &[WALL])]);
    window.key(Key::N);
    window.key(Key::Enter);
    suggest_now(&mut window, vec![place(2, [8, 8], &[WALL])]);
    assert_eq!(window.frame_index(), 2);
    window.press(Modifiers::COMMAND, Key::Z);
    assert_eq!((window.strokes(), window.frame_index()), (0, 3));
    assert_eq!(window.workspace().suggestions().at(), Some(0));
    assert_eq!(listed(&window), [3, 2]);
    // The list made after the undo has the place at another rank, which changes nothing.
    let list = vec![place(2, [8, 8], &[WALL]), place(3, [21, 30], &[FLOOR])];
    suggest_now(&mut window, list);
    assert_eq!(window.workspace().suggestions().listed[0].pixel, [20, 30]);
    window.key(Key::Num2);
    assert_eq!(last_stroke(&window), (3, FLOOR, [20, 30]));

    window.press(Modifiers::COMMAND, Key::Z);
    assert_eq!(window.workspace().suggestions().at(), Some(0));
    window.press(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    assert_eq!(window.strokes(), 1);
    assert!(matches!(window.workspace().suggestions().mode, Mode::Looking(_)));
}

#[test]
fn escape_a_click_and_another_frame_leave() {
    let mut window = Window::with_classes(&["wall", "floor"]);
    suggest_now(&mut window, vec![place(3, [20, 30], &[WALL])]);
    let is_active = |window: &Window| window.workspace().suggestions().is_active();

    window.key(Key::N);
    assert!(is_active(&window));
    // A menu that is open is closed first.
    window.click("Layer");
    window.key(Key::Escape);
    assert!(is_active(&window));
    window.key(Key::Escape);
    assert!(!is_active(&window));
    window.key(Key::Num2);
    assert_eq!((window.workspace().class, window.strokes()), (Some(FLOOR), 0));

    window.key(Key::N);
    window.key(Key::A);
    assert!(!is_active(&window) && window.frame_index() == 2);

    window.key(Key::N);
    window.click_canvas(40.0, 40.0);
    assert!(!is_active(&window));
    let (frame, class, pixel) = last_stroke(&window);
    assert_eq!((frame, class), (3, FLOOR));
    assert_ne!(pixel, [20, 30]);
}

#[test]
fn cards_do_not_move_under_the_pointer_and_are_answered_by_their_buttons() {
    let mut window = Window::with_classes(&["wall", "floor"]);
    let generation = window.generation();
    window.suggest(generation, vec![place(3, [20, 30], &[WALL])]);
    let card = window.rect("Go to suggestion 1").center();
    for x in [0.0, 3.0] {
        window.hover(card + egui::vec2(x, 0.0));
    }
    window.suggest(generation, vec![place(2, [8, 8], &[WALL])]);
    assert_eq!(listed(&window), [3]);
    // What is not shown may move.
    window.key(Key::T);
    assert_eq!(listed(&window), [2]);
    window.key(Key::T);
    // Other labels have other places.
    window.act(Command::AddClass(ClassUse::Choose, "lamp".to_owned()));
    suggest_now(&mut window, vec![place(4, [9, 9], &[WALL])]);
    assert_eq!(listed(&window), [4]);
    let generation = window.generation();
    window.suggest(generation, vec![place(2, [8, 8], &[WALL])]);
    assert_eq!(listed(&window), [4]);
    let canvas = window.canvas(0.0, 0.0);
    window.hover(canvas);
    assert_eq!(listed(&window), [2]);
    let list = vec![place(3, [20, 30], &[WALL, FLOOR]), place(1, [40, 10], &[FLOOR])];
    window.suggest(generation, list);
    window.click("Label suggestion 2 as floor");
    assert_eq!(last_stroke(&window), (1, FLOOR, [40, 10]));
    assert_eq!(window.frame_index(), 1, "what the answer does is seen");
    window.sees("Labelled floor");
    window.click("Go to suggestion 1");
    assert_eq!(window.frame_index(), 3);
    window.click("Label as floor");
    assert_eq!(last_stroke(&window), (3, FLOOR, [20, 30]));
}

#[test]
fn a_trace_tells_what_is_suggested_and_what_was_answered() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("trace.jsonl");
    let options = UiOptions {
        open: Some(Target::Scene(SceneSource::Demo)),
        trace: Some(file.clone()),
        ..UiOptions::default()
    };
    let mut window = Window::with_options(folder.path(), options);
    window.until_open();
    window.add_class("wall");
    window.key(Key::Escape);
    suggest_now(&mut window, vec![place(3, [20, 30], &[WALL])]);
    window.key(Key::N);
    window.key(Key::Enter);
    let traced = |event: &str| -> Vec<Value> {
        let text = std::fs::read_to_string(&file).unwrap_or_default();
        let lines = text.lines().filter_map(|line| serde_json::from_str(line).ok());
        lines.filter(|line: &Value| line["event"] == event).collect()
    };
    window.until("the answer is traced", |_| {
        let newest = traced("labels").pop();
        newest.is_some_and(|line| line["strokes"] == 1)
    });
    assert_eq!(traced("opened")[0]["frames"][3], "rgb_3");
    assert_eq!(traced("classes").pop().unwrap()["classes"][0]["name"], "wall");
    let places = traced("place");
    assert_eq!([&places[0]["mode"], &places[1]["mode"]], ["at", "looking"]);
    assert_eq!(places[0]["number"], 1);
    assert_eq!(places[0]["suggestion"]["pixel"], json!([20, 30]));
    let newest = &traced("labels").pop().unwrap()["newest"];
    assert_eq!((&newest["frame"], &newest["class"]), (&json!("rgb_3"), &json!(1)));
    assert_eq!(newest["lines"], json!([[[20, 30]]]));
}

#[test]
fn where_a_thing_is_likely_it_is_asked_which_one() {
    let mut window = Window::with_classes(&["chair", "table"]);
    window.act(Command::Choose(Named::Class(1)));
    window.act(Command::SayNewObject);
    window.point(Tool::Brush, [8, 8]);
    let chair = window.labels().objects[0].id;
    let suggested = |frame: usize| {
        let mut suggestion = place(frame, [20, 30], &[1, 2]);
        suggestion.classes[0].object = Some(chair);
        suggestion
    };
    let newest = |window: &Window| {
        let (_, stroke) = window.labels().strokes.last_key_value().unwrap();
        stroke
            .object
            .and_then(|id| Some(window.labels().object(id)?.name.clone()))
    };
    suggest_now(&mut window, vec![suggested(3)]);
    window.key(Key::N);
    window.sees_part("chair 1, or a new one?");
    window.sees_part("Enter: chair 1, O: new chair, 2: table");
    window.key(Key::Enter);
    assert_eq!(newest(&window).as_deref(), Some("chair 1"));
    suggest_now(&mut window, vec![suggested(4)]);
    window.key(Key::O);
    assert_eq!(newest(&window).as_deref(), Some("chair 2"));
    assert_eq!(last_stroke(&window), (4, 1, [20, 30]));
    // A digit says only the class, and so does Enter where the object is locked.
    suggest_now(&mut window, vec![suggested(1)]);
    window.key(Key::Num1);
    assert_eq!((last_stroke(&window).0, newest(&window)), (1, None));
    window.act(Command::SetLocked(Named::Object(chair), true));
    suggest_now(&mut window, vec![suggested(2)]);
    window.sees_part("Enter: chair, O: new chair");
    window.key(Key::Enter);
    assert_eq!((last_stroke(&window).0, newest(&window)), (2, None));
}

#[test]
fn an_answer_that_a_lock_refuses_says_so_and_its_place_waits() {
    let mut window = Window::with_classes(&["wall", "floor"]);
    window.point(Tool::Brush, [8, 8]);
    window.act(Command::SetLocked(Named::Class(FLOOR), true));
    suggest_now(&mut window, vec![place(0, [8, 8], &[WALL, FLOOR])]);
    window.key(Key::N);
    window.key(Key::Num2);
    window.says("unlock it in the class list to label with it");
    window.key(Key::Num1);
    window.says("would cover what is labelled \"floor\"");
    assert_eq!(window.strokes(), 1);
    assert_eq!(window.workspace().suggestions().at(), Some(0));
}

#[test]
fn the_bar_goes_on_in_another_line_where_the_canvas_is_narrow() {
    let mut window = Window::with_classes(&["a wall behind a sofa", "floor"]);
    suggest_now(&mut window, vec![place(3, [20, 30], &[WALL, FLOOR])]);
    window.key(Key::N);
    window.act(Command::Prefer(PreferenceChange::Scale(200)));
    window.harness.run_steps(4);
    let bar = window.harness.get_by_label_contains("Suggestion 1 of 1").rect();
    let canvas = window.rect(inplace_ui::canvas::CANVAS_NAME);
    assert!(bar.height() > 48.0 && canvas.contains_rect(bar), "{bar}");
}
