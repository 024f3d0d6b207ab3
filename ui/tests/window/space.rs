//! The 3D view.

use std::sync::Arc;
use std::time::{Duration, Instant};

use egui::{Key, Modifiers, PointerButton, Pos2};
use inplace_core::guide::Suggestion;
use inplace_core::scene::{DepthMap, Scene, SceneSource};
use inplace_core::semantics::{LabelPropagation, Surface};
use inplace_core::session::Event;
use inplace_model::Command;
use inplace_model::dialogs::Dialog;
use inplace_model::layer::Layer;
use inplace_model::preferences::PreferenceChange;

use crate::stand::*;

/// How far away the wall is, in metres.
const AWAY: f32 = 2.0;

/// A wall before the cameras of the stand-in's scene.
pub fn wall() -> Arc<Surface> {
    let mut scene = Scene::clone(&scene(SceneSource::Demo));
    for frame in &mut scene.frames {
        let depths = vec![AWAY; frame.camera.pixels()];
        frame.set_depth(Some(DepthMap::from_z_depths(&frame.camera, depths)));
    }
    Arc::new(Surface::build(&scene, &[], 5.0).unwrap())
}

/// A window with the 3D view of a wall, ready to be clicked on.
fn shown() -> Window {
    let mut window = Window::demo();
    let spread = LabelPropagation::new(wall());
    let scene = Arc::clone(&window.workspace().scene);
    window.worker().maps.publish(spread.map(&scene, 0, 1));
    window.tell(Event::Map {
        frame: 0,
        generation: 1,
    });
    window.key(Key::V);
    window.until_window("the wall is shown", |window| window.shows("Fly to this frame"));
    window
}

/// All frames were taken at the origin.
fn fly_to_frame(window: &mut Window) {
    window.click("Fly to this frame");
    window.until("the camera has arrived", |app| {
        let camera = app.model().workspace().unwrap().space.camera;
        camera.is_some_and(|camera| camera.eye().length() < 1e-3)
    });
}

fn middle(window: &Window) -> Pos2 {
    window.rect("3D view").center()
}

#[test]
fn v_and_the_buttons_switch_and_say_what_is_missing() {
    let mut window = Window::demo();
    window.key(Key::V);
    window.sees("3D view");
    window.sees(
        "The surface of the scene is shown here as soon as it is found; until then you can label the frames",
    );
    window.click("Frame");
    assert!(!window.workspace().space.shown);
    window.sees(inplace_ui::canvas::CANVAS_NAME);
    window.click("3D");
    assert!(window.workspace().space.shown);
}

#[test]
fn all_controls_of_a_narrow_view_are_inside_of_it() {
    let mut window = shown();
    window.act(Command::Prefer(PreferenceChange::Scale(200)));
    window.harness.run_steps(4);
    let (view, last) = (window.rect("3D view"), window.rect("Field"));
    assert!(view.contains_rect(last), "{last} {view}");
}

#[test]
fn the_surface_is_exported_as_the_dialog_says() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = Window::with_demo(folder.path());
    window.add_class("wall");
    let generation = window.generation();
    let spread = LabelPropagation::new(wall());
    let scene = Arc::clone(&window.workspace().scene);
    for frame in 0..FRAMES {
        let map = spread.map(&scene, frame, generation);
        window.worker().maps.publish(map);
    }
    for (title, stem) in [("Point cloud", "cloud"), ("Mesh", "mesh")] {
        window.press(Modifiers::COMMAND, Key::E);
        window.pick("Format", title);
        let out = folder.path().join(stem);
        window.replace_text("Export folder", out.to_str().unwrap());
        window.until_exported();
        window.sees("Exported the surface");
        for file in [format!("{stem}.ply"), format!("{stem}_classes.ply")] {
            let bytes = std::fs::read(out.join(&file)).unwrap();
            assert!(bytes.starts_with(b"ply\n"), "{file}");
        }
        assert!(out.join("classes.json").is_file() && out.join("strokes.json").is_file());
    }
}

#[test]
fn a_click_on_the_surface_labels_the_frame_that_shows_it_unless_a_lock_refuses_or_it_is_beside_it() {
    let mut window = shown();
    window.add_class("wall");
    window.click("Lock wall");
    let place = middle(&window);
    window.drag(PointerButton::Primary, &[place]);
    window.until_window("the refusal is told", |window| {
        window.messages().contains("unlock it")
    });
    window.misses("wall, on frame rgb_0");
    assert_eq!(window.strokes(), 0);
    window.click("Unlock wall");
    window.drag(PointerButton::Primary, &[place]);
    window.until_window("the wall is labelled", |window| window.strokes() == 1);
    assert!(window.workspace().space.shown);
    let labels = window.labels();
    let (_, stroke) = labels.strokes_of(0).next().unwrap();
    // All frames see the wall alike: the first takes the click, in the middle of its image.
    let [x, y] = stroke.first_point().unwrap();
    assert_eq!((stroke.class, stroke.radius), (1, 0));
    assert!(x.abs_diff(32) <= 2 && y.abs_diff(24) <= 2, "{x} {y}");
    window.sees("wall, on frame rgb_0");
    window.press(Modifiers::COMMAND, Key::Z);
    // What is between the surface and the edge of a fitted view.
    let beside = window.rect("3D view").right_center() - egui::vec2(12.0, 0.0);
    window.drag(PointerButton::Primary, &[beside]);
    let said = "There is no surface under the pointer";
    window.until_window("it is said", |window| window.shows(said));
    assert_eq!(window.strokes(), 0);
}

#[test]
fn drags_and_arrows_turn_the_view_fitting_keeps_its_side_and_the_camera_flies_to_the_frame_in_view() {
    let mut window = shown();
    let camera = |window: &Window| window.workspace().space.camera;
    assert_eq!(camera(&window), None);
    window.key(Key::ArrowLeft);
    let turned = camera(&window).unwrap();
    assert_eq!(window.frame_index(), 0, "the arrow went to another frame");
    let place = middle(&window);
    let path = [0.0, 30.0, 60.0].map(|x| place + egui::vec2(x, 0.0));
    window.drag(PointerButton::Primary, &path);
    let dragged = camera(&window).unwrap();
    assert!(dragged.direction.yaw > turned.direction.yaw);
    assert!((dragged.distance - turned.distance).abs() < 1e-4);
    window.key(Key::F);
    window.act(Command::Show(Some(Dialog::Help)));
    window.key(Key::Plus);
    window.act(Command::Show(None));
    assert_eq!(camera(&window), None, "a dialog has the keys");
    window.key(Key::Plus);
    assert!(camera(&window).is_some());
    window.key(Key::F);
    assert_eq!(camera(&window), None);
    assert_eq!(window.strokes(), 0, "a drag is not a click");
    fly_to_frame(&mut window);
    let arrived = window.workspace().space;
    window.key(Key::V);
    window.key(Key::V);
    assert_eq!(window.workspace().space, arrived);
}

#[test]
fn what_two_fingers_touch_is_not_labelled() {
    let mut window = shown();
    window.add_class("wall");
    let place = middle(&window);
    window.pinch(place);
    window.drag(PointerButton::Primary, &[place]);
    window.until_window("the wall is labelled", |window| window.strokes() > 0);
    assert_eq!(window.strokes(), 1);
}

#[test]
fn a_double_click_turns_around_that_place_and_labels_nothing() {
    let mut window = shown();
    window.add_class("wall");
    // A step of the test takes longer than a person takes from click to click.
    let patience = |options: &mut egui::Options| options.input_options.max_double_click_delay = 2.0;
    window.harness.ctx.options_mut(patience);
    let place = middle(&window) + egui::vec2(-40.0, 20.0);
    for pressed in [true, false, true, false] {
        window.harness.event(egui::Event::PointerMoved(place));
        window.harness.event(button(place, pressed));
    }
    window.until("the pivot is set", |app| {
        let camera = app.model().workspace().unwrap().space.camera;
        camera.is_some_and(|camera| (camera.pivot.z - AWAY).abs() < 1e-3 && camera.pivot.x.abs() > 0.05)
    });
    window.harness.run_steps(20);
    assert_eq!(window.strokes(), 0);
}

#[test]
fn a_click_on_a_suggestion_leads_to_it_in_its_frame() {
    let mut window = shown();
    let suggestion = suggestion(3);
    let [x, y] = suggestion.pixel;
    window.suggest(1, vec![suggestion.clone()]);
    fly_to_frame(&mut window);
    // The node of that pixel, seen from the origin.
    let surface = wall();
    let node = surface.pixels[3].node((y * WIDTH + x) as usize).unwrap();
    let node = surface.graph.nodes()[node as usize].position;
    let area = window.rect("3D view");
    let focal = 0.5 * area.size().min_elem() / 0.48_f32.tan();
    let place = area.center() + focal / node.z * egui::vec2(node.x, node.y);
    window.hover(place);
    window.drag(PointerButton::Primary, &[place]);
    // It has another rank before the camera is there.
    let better = Suggestion {
        frame: 1,
        ..suggestion.clone()
    };
    window.suggest(1, vec![better, suggestion]);
    window.until_window("the frame is shown", |window| !window.workspace().space.shown);
    assert_eq!(window.frame_index(), 3);
    assert_eq!(window.workspace().suggestions().at(), Some(1));
    assert_eq!(window.strokes(), 0);
}

#[test]
fn the_field_is_shown_from_where_the_camera_rests_and_from_nowhere_else() {
    let mut window = shown();
    window.click("Field");
    assert_eq!(window.model().settings.layer, Layer::RenderedLabels);
    let asked = |window: &mut Window| {
        let end = Instant::now() + Duration::from_secs(20);
        loop {
            window.harness.step();
            if let [viewpoint] = window.worker().asked_views()[..] {
                return viewpoint;
            }
            assert!(Instant::now() < end, "no view was asked for");
        }
    };
    let first = asked(&mut window);
    let area = window.rect("3D view");
    assert_eq!(f64::from(first.camera.width), f64::from(area.width().round()));
    window.sees("The view is being rendered");
    window.tell(rendered(first, 300));
    window.until_window("the classes are missed", |window| {
        window.shows("The field is learning the labels")
    });
    window.act(Command::ChooseLayer(Layer::RenderedDepth));
    window.sees("after 300 training steps");

    window.focus("3D view");
    window.key(Key::ArrowLeft);
    window.sees("The view is being rendered");
    let second = asked(&mut window);
    assert_eq!(second.camera, first.camera);
    assert_ne!(second.camera_to_world, first.camera_to_world);
    // One that comes late is from elsewhere.
    window.tell(rendered(first, 400));
    window.sees("The view is being rendered");
    window.tell(rendered(second, 500));
    window.until_window("the view is there", |window| {
        window.shows("after 500 training steps")
    });

    window.click("Field");
    assert_eq!(window.model().settings.layer, Layer::Depth);
    window.misses("after 500 training steps");
    assert_eq!(window.worker().asked_views(), []);
}
