//! The tools that draw, and strokes as things to find, change and delete.

use egui::{Key, Modifiers, PointerButton};
use egui_kittest::kittest::Queryable;
use inplace_core::labels::{History, Stroke, StrokeId, StrokeKind, VOID};
use inplace_core::project::{Contents, Project, SceneRecord};
use inplace_core::scene::{OpenOptions, SceneSource};
use inplace_model::Command;
use inplace_model::class_view::Named;
use inplace_model::layer::Layer;
use inplace_model::tool::Tool;
use inplace_ui::Target;
use std::time::{Duration, Instant};

use crate::stand::*;

fn newest(window: &Window) -> Stroke {
    let labels = window.labels();
    labels.strokes.last_key_value().unwrap().1.as_ref().clone()
}

/// Clicks one after the other, slowly.
fn click_at(window: &mut Window, places: &[[f32; 2]]) {
    for &[x, y] in places {
        window.click_canvas(x, y);
        window.harness.run_steps(30);
    }
}

const TRIANGLE: [[f32; 2]; 3] = [[-120.0, -90.0], [120.0, -90.0], [0.0, 90.0]];

fn draw_triangle(window: &mut Window) {
    window.key(Key::G);
    click_at(window, &TRIANGLE);
    window.key(Key::Enter);
}

/// A window with a project of two classes and these strokes.
fn opened(strokes: impl IntoIterator<Item = Stroke>) -> Window {
    let mut history = History::default();
    history.add_class("wall");
    history.add_class("floor");
    for stroke in strokes {
        history.add_stroke(stroke);
    }
    let history = History::new(history.labels().clone());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("strokes.inplace");
    let record = SceneRecord::of(&scene(SceneSource::Demo), OpenOptions::default());
    drop(Project::create(&path, &Contents::new(record, history)).unwrap());
    let mut window = Window::opened(folder.path(), Target::Project(path));
    window.folder = Some(folder);
    window
}

#[test]
fn a_polygon_waits_on_its_frame_escape_drops_it_and_backspace_and_undo_take_back_corners() {
    let mut window = Window::with_classes(&["wall", "floor"]);
    click_at(&mut window, &[[0.0, 0.0]]);
    window.key(Key::G);
    click_at(&mut window, &TRIANGLE);
    window.sees_part("Polygon, 3 corners");
    window.key(Key::Backspace);
    window.sees_part("Polygon, 2 corners");
    window.press(Modifiers::COMMAND, Key::Z);
    window.sees_part("Polygon, 1 corner");
    assert_eq!(window.strokes(), 1, "undo in a polygon is about the polygon");
    window.key(Key::Escape);
    assert!(window.harness.query_by_label_contains("Polygon, ").is_none());
    window.key(Key::Enter);
    assert_eq!(window.strokes(), 1);
    click_at(&mut window, &TRIANGLE[..2]);
    window.key(Key::D);
    assert!(window.harness.query_by_label_contains("Polygon, ").is_none());
    window.key(Key::Enter);
    assert_eq!(window.strokes(), 1);
    window.key(Key::A);
    // The 3D view leaves it where it is.
    window.key(Key::V);
    window.key(Key::Escape);
    window.key(Key::V);
    window.sees_part("Polygon, 2 corners");
    // A click on the first corner ends it, too.
    click_at(&mut window, &[TRIANGLE[2], TRIANGLE[0]]);
    let polygon = newest(&window);
    assert_eq!((polygon.kind(), polygon.frame), (StrokeKind::Polygon, 0));
    // A scribble is dropped while its button is still held.
    window.key(Key::B);
    let [from, to] = [window.canvas(-50.0, 0.0), window.canvas(50.0, 0.0)];
    window.harness.event(egui::Event::PointerMoved(from));
    window.harness.event(button(from, true));
    window.harness.run_steps(2);
    window.harness.event(egui::Event::PointerMoved(to));
    window.key(Key::Escape);
    window.harness.event(button(to, false));
    window.harness.run_steps(2);
    assert_eq!(window.strokes(), 2);
}

#[test]
fn shift_draws_from_the_end_of_the_last_line_and_a_polyline_ends_by_a_double_click() {
    let mut window = Window::with_classes(&["wall", "floor"]);
    click_at(&mut window, &[[-100.0, 0.0]]);
    let from = newest(&window).lines[0][0];
    window.click_canvas_with(Modifiers::SHIFT, 100.0, 50.0);
    let stroke = newest(&window);
    assert_eq!((stroke.lines[0].len(), stroke.lines[0][0]), (2, from));
    assert_eq!(window.strokes(), 2);
    window.key(Key::CloseBracket);
    window.key(Key::L);
    click_at(&mut window, &[[-100.0, 0.0], [0.0, 50.0]]);
    let pos = window.canvas(100.0, 0.0);
    // All within one frame: a step of the window takes longer than a double-click.
    let events = [true, false, true, false].map(|pressed| button(pos, pressed));
    window.harness.input_mut().events.extend(events);
    window.harness.run_steps(3);
    let stroke = newest(&window);
    assert_eq!((stroke.radius, stroke.lines.len()), (3, 1));
    assert_eq!((stroke.lines[0].len(), window.strokes()), (3, 3));
    click_at(&mut window, &[[-100.0, 60.0]]);
    window.sees_part("Polyline, 1 corner");
}

#[test]
fn a_polygon_that_a_lock_refuses_keeps_its_corners() {
    let mut window = Window::with_classes(&["wall"]);
    window.act(Command::SetLocked(Named::Class(1), true));
    window.key(Key::G);
    click_at(&mut window, &TRIANGLE);
    window.key(Key::Enter);
    assert_eq!(window.strokes(), 0);
    window.sees_part("Polygon, 3 corners");
    window.act(Command::SetLocked(Named::Class(1), false));
    window.key(Key::Enter);
    assert_eq!(newest(&window).kind(), StrokeKind::Polygon);
    assert!(window.harness.query_by_label_contains("Polygon, ").is_none());
}

#[test]
fn void_is_drawn_with_every_tool_and_the_eraser_cuts_polygons() {
    let mut window = Window::with_classes(&["wall", "floor"]);
    window.key(Key::G);
    window.key(Key::Num0);
    assert_eq!(
        window.tool(),
        Tool::Polygon,
        "a class is chosen for the tool in hand"
    );
    draw_triangle(&mut window);
    let whole = newest(&window);
    assert_eq!(whole.class, VOID);
    window.key(Key::E);
    let path = [window.canvas(0.0, -120.0), window.canvas(0.0, 120.0)];
    window.drag(PointerButton::Primary, &path);
    let rest = newest(&window);
    assert_eq!(rest.kind(), StrokeKind::Polygon);
    assert!(rest.pixel_count(WIDTH, HEIGHT) < whole.pixel_count(WIDTH, HEIGHT));
    window.key(Key::E);
    assert_eq!(window.tool(), Tool::Polygon, "E goes back to the tool of before");
    window.press(Modifiers::COMMAND, Key::Z);
    assert_eq!(newest(&window), whole);
}

#[test]
fn a_stroke_is_picked_on_the_frame_changed_by_a_digit_and_deleted() {
    let mut window = Window::with_classes(&["wall", "floor"]);
    draw_triangle(&mut window);
    click_at(&mut window, &[[200.0, 150.0]]);
    window.key(Key::Escape);
    window.key(Key::S);
    click_at(&mut window, &[[0.0, -20.0]]);
    let selected = window.selected();
    assert!(selected.is_some());
    window.key(Key::Num1);
    assert_eq!(newest(&window).class, 1);
    let own = window.workspace().class;
    assert_eq!(own, Some(2), "the class to draw with is another matter");
    assert_eq!(window.selected(), selected);
    let undo = window.workspace().document.history().undo_name();
    assert_eq!(undo, Some("change polygon floor to wall"));
    // Empty ground lets go of it, and then there is nothing to delete.
    click_at(&mut window, &[[200.0, 150.0]]);
    assert_eq!(window.selected(), None);
    window.key(Key::Delete);
    assert_eq!(window.strokes(), 1);
    click_at(&mut window, &[[0.0, -20.0]]);
    window.key(Key::Delete);
    assert_eq!((window.strokes(), window.selected()), (0, None));
    window.press(Modifiers::COMMAND, Key::Z);
    window.press(Modifiers::COMMAND, Key::Z);
    assert_eq!(newest(&window).class, 2);
    window.act(Command::SetHidden(Named::Class(2), true));
    click_at(&mut window, &[[0.0, -20.0]]);
    assert_eq!(window.selected(), None, "it is not seen");
}

#[test]
fn a_stroke_picked_on_the_frame_is_in_view_in_the_list() {
    let polygon = Stroke::polygon(0, 2, &[[25, 20], [39, 20], [39, 29], [25, 29]]);
    let clicks = (0..60).map(|index| Stroke::click(0, 1, [index, 2]));
    let mut window = opened(std::iter::once(polygon).chain(clicks));
    let row = "floor, polygon, 150 pixels, frame rgb_0";
    assert!(!window.shows(row), "only what is in view is built");
    window.key(Key::S);
    click_at(&mut window, &[[0.0, 0.0]]);
    assert_eq!(window.selected(), Some(StrokeId(1)));
    window.sees(row);
}

#[test]
fn the_list_is_worked_through_with_the_keyboard_alone() {
    let strokes = (0..4).map(|frame| Stroke::click(frame, 1, [5, 5]));
    let mut window = opened(strokes);
    let place = window.rect("wall, click, 1 pixel, frame rgb_2").center();
    window.drag(PointerButton::Primary, &[place]);
    assert_eq!(window.frame_index(), 2);
    window.key(Key::ArrowUp);
    assert_eq!(window.frame_index(), 3, "the list has got the keyboard");
    window.key(Key::Escape);
    window.focus("List of strokes");
    window.key(Key::Home);
    assert_eq!(window.frame_index(), 3, "the newest comes first");
    window.key(Key::ArrowDown);
    assert_eq!(window.selected(), Some(StrokeId(3)));
    window.key(Key::Delete);
    assert_eq!(window.strokes(), 3);
    assert_eq!(window.selected(), Some(StrokeId(2)), "the next takes its place");
    window.key(Key::End);
    assert_eq!(window.frame_index(), 0);
    window.key(Key::ArrowUp);
    assert_eq!(window.frame_index(), 1);
    window.key(Key::S);
    window.key(Key::Num2);
    assert_eq!(window.labels().strokes[&StrokeId(2)].class, 2);
}

#[test]
fn the_list_is_filtered_goes_to_strokes_changes_and_deletes_them() {
    let window = Window::demo();
    window.sees_part("No strokes yet. What you draw");
    drop(window);
    let mut window = opened([
        Stroke::click(0, 1, [5, 5]),
        Stroke::click(2, 2, [6, 6]),
        Stroke::polygon(2, 1, &[[10, 10], [19, 10], [19, 14], [10, 14]]),
    ]);
    let rows = [
        "wall, click, 1 pixel, frame rgb_0",
        "floor, click, 1 pixel, frame rgb_2",
        "wall, polygon, 50 pixels, frame rgb_2",
    ];
    let listed = |window: &Window| rows.map(|row| window.shows(row));
    assert_eq!(listed(&window), [true, true, true]);
    window.click("This frame");
    assert_eq!(listed(&window), [true, false, false]);
    window.click("This frame");
    window.type_into("Find strokes", "wall rgb_2");
    assert_eq!(listed(&window), [false, false, true]);
    window.click(rows[2]);
    assert_eq!(window.frame_index(), 2);
    assert_eq!(window.selected(), Some(StrokeId(3)));
    window.pick("Class of the stroke", "floor");
    assert_eq!(newest(&window).class, 2);
    window.press(Modifiers::COMMAND, Key::Z);
    window.click("Delete stroke (Delete)");
    assert_eq!(window.strokes(), 2);
    window.key(Key::A);
    window.press(Modifiers::COMMAND, Key::Z);
    assert_eq!((window.strokes(), window.frame_index()), (3, 2));
    window.type_into("Find strokes", " click");
    window.click("Show all strokes");
    window.pick("Strokes of class", "floor");
    assert_eq!(listed(&window), [false, true, false]);
    window.click("Hide the list of strokes");
    assert_eq!(listed(&window), [false, false, false]);
    window.click("Show the list of strokes");
    assert_eq!(listed(&window), [false, true, false], "the filter is as it was");
}

#[test]
fn in_another_scene_the_list_has_all_strokes_whatever_was_looked_for_before() {
    let mut window = opened([Stroke::click(0, 1, [5, 5]), Stroke::click(2, 2, [6, 6])]);
    let row = "wall, click, 1 pixel, frame rgb_0";
    window.pick("Strokes of class", "floor");
    window.misses(row);
    let path = window.model().project.as_ref().unwrap().path.clone();
    let serial = window.workspace().serial;
    window.act(Command::Open(Target::Project(path)));
    window.until("it is open again", |app| {
        let workspace = app.model().workspace();
        workspace.is_some_and(|workspace| workspace.serial != serial)
    });
    window.sees(row);
}

#[test]
fn strokes_say_a_new_object_after_its_key_until_a_class_is_chosen() {
    let mut window = Window::with_classes(&["chair", "floor"]);
    window.key(Key::O);
    assert!(window.messages().contains("\"floor\" is stuff"));
    window.key(Key::Num1);
    window.key(Key::O);
    window.sees("chair, 0 strokes, saying chair 1");
    window.click_canvas(-60.0, 0.0);
    window.click_canvas(0.0, 0.0);
    window.key(Key::O);
    window.click_canvas(60.0, 0.0);
    window.sees("chair, 3 strokes, saying chair 2");
    assert_eq!(window.said(), [Some(1), Some(1), Some(2)]);
    window.press(Modifiers::COMMAND, Key::Z);
    assert_eq!((window.strokes(), window.labels().objects.len()), (2, 1));
    window.key(Key::Num1);
    window.click_canvas(60.0, 0.0);
    assert_eq!(window.said(), [Some(1), Some(1), None]);
    window.sees("chair, 3 strokes");
    // What the maps show keeps its number and its name.
    window.spread();
    window.act(Command::ChooseLayer(Layer::Objects));
    window.until_window("the objects are found", |window| {
        window.frame().objects().is_some()
    });
    window.key(Key::O);
    window.sees("chair, 3 strokes, saying chair 3");
}

#[test]
fn ten_thousand_strokes_leave_the_window_quick() {
    let stroke = |index: u32| {
        let (x, y) = (index % WIDTH, index / WIDTH % HEIGHT);
        let line = vec![[x, y], [WIDTH - 1 - x, y], [x, HEIGHT - 1 - y]];
        Stroke::drawn(index as usize % FRAMES, 1 + (index % 2) as u16, 2, vec![line])
    };
    let mut window = opened((0..10_000).map(stroke));
    let builds = |window: &Window| window.harness.state().canvas().strokes().builds;
    window.until_window("the strokes are drawn", |window| builds(window) > 0);
    window.harness.run_steps(5);
    let before = builds(&window);
    let start = Instant::now();
    window.harness.run_steps(20);
    let spent = start.elapsed() / 20;
    assert_eq!(builds(&window), before, "drawn anew although nothing changed");
    // Many times what it takes; walking all strokes in each frame takes longer in a dev build.
    assert!(spent < Duration::from_millis(60), "{spent:?} a frame");
    let places = [window.canvas(-60.0, 0.0), window.canvas(60.0, 0.0)];
    window.drag(PointerButton::Primary, &places);
    assert_eq!(window.strokes(), 10_001);
    assert_eq!(builds(&window), before + 1, "one stroke more is one mesh more");
}
