//! What a person prefers: kept, taken back when damaged, keys, scale, hints.

use egui::{Key, Modifiers, PointerButton};
use egui_kittest::kittest::Queryable;
use inplace_model::Command;
use inplace_model::preferences::{Hint, PreferenceChange, Preferences, Theme};
use inplace_model::settings::Settings;

use crate::stand::*;

fn preferences(window: &Window) -> &Preferences {
    &window.harness.state().model().preferences
}

#[test]
fn preferences_survive_a_restart() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = Window::with_demo(folder.path());
    window.press(Modifiers::COMMAND, Key::Plus);
    window.press(Modifiers::COMMAND, Key::Comma);
    window.choose("Light");
    assert_eq!(window.harness.ctx.theme(), egui::Theme::Light);
    window.choose("Close");
    window.click("View");
    window.click("Borders between classes");
    assert!(!window.harness.state().model().settings.outlines);
    window.close();
    let window = Window::new(folder.path(), None);
    assert_eq!(preferences(&window).scale, 110);
    assert_eq!(preferences(&window).theme, Theme::Light);
    assert!(!window.harness.state().model().settings.outlines);
}

#[test]
fn the_settings_of_a_project_win_and_change_no_preference() {
    let folder = tempfile::tempdir().unwrap();
    {
        let mut window = Window::with_demo(folder.path());
        window.click("View");
        window.click("Borders between classes");
        window.close();
    }
    std::fs::remove_file(preferences_file(folder.path())).unwrap();
    let mut window = Window::new(folder.path(), None);
    assert!(window.harness.state().model().settings.outlines);
    window.click("Try the demo");
    window.until("the demo is open", |app| app.model().workspace().is_some());
    assert!(!window.harness.state().model().settings.outlines);
    window.close();
    let window = Window::new(folder.path(), None);
    assert_eq!(window.harness.state().model().settings, Settings::default());
}

#[test]
fn damaged_preferences_are_set_aside_and_stop_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let file = preferences_file(folder.path());
    std::fs::create_dir_all(file.parent().unwrap()).unwrap();
    std::fs::write(&file, "{ damaged").unwrap();
    let window = Window::with_demo(folder.path());
    let texts: Vec<&str> = window.harness.state().model().messages.texts().collect();
    assert!(texts.iter().any(|text| text.contains("set aside")), "{texts:?}");
    assert_eq!(preferences(&window).scale, 100);
    assert!(file.with_extension("set-aside.json").exists());
}

#[test]
fn a_key_can_be_changed_and_help_shows_the_new_one() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = Window::with_demo(folder.path());
    window.press(Modifiers::COMMAND, Key::Comma);
    window.choose("Pause or resume training: P");
    window.press(Modifiers::NONE, Key::K);
    window.harness.get_by_label("Pause or resume training: K");
    window.choose("Close");
    window.press(Modifiers::NONE, Key::P);
    assert!(!window.workspace().is_paused());
    window.press(Modifiers::NONE, Key::K);
    assert!(window.workspace().is_paused());
    window.press(Modifiers::NONE, Key::Questionmark);
    window.harness.get_by_label("K");
    window.choose("Close");
    window.close();
    let mut window = Window::with_demo(folder.path());
    window.press(Modifiers::NONE, Key::K);
    assert!(window.workspace().is_paused());
    window.press(Modifiers::COMMAND, Key::Comma);
    window.choose("Reset all keys");
    window.choose("Close");
    window.press(Modifiers::NONE, Key::P);
    assert!(!window.workspace().is_paused());
}

#[test]
fn a_key_that_does_something_else_is_shown_and_can_be_taken() {
    let mut window = Window::demo();
    window.press(Modifiers::COMMAND, Key::Comma);
    window.choose("Pause or resume training: P");
    window.press(Modifiers::NONE, Key::Num1);
    window
        .harness
        .get_by_label("1 cannot be given away: the window needs it.");
    window.choose("Another key");
    window.press(Modifiers::NONE, Key::F);
    window
        .harness
        .get_by_label("F is taken: Fit the image, or the scene in the 3D view, into the window.");
    assert!(preferences(&window).keys.is_default());
    window.choose("Use it here");
    window
        .harness
        .get_by_label("Fit the image, or the scene in the 3D view, into the window: no key, by default F");
    window.harness.get_by_label("Pause or resume training: F");
    // Giving F back takes it from what has it now.
    window.choose("Reset Fit the image, or the scene in the 3D view, into the window to F");
    window
        .harness
        .get_by_label("Fit the image, or the scene in the 3D view, into the window: F");
    window
        .harness
        .get_by_label("Pause or resume training: no key, by default P");
    window.choose("Reset Pause or resume training to P");
    assert!(preferences(&window).keys.is_default());
}

#[test]
fn escape_leaves_the_key_as_it_was_and_the_settings_open() {
    let mut window = Window::demo();
    window.press(Modifiers::COMMAND, Key::Comma);
    window.choose("Pause or resume training: P");
    window.press(Modifiers::NONE, Key::Escape);
    window.harness.get_by_label("Pause or resume training: P");
    window.press(Modifiers::NONE, Key::Escape);
    assert!(window.harness.state().model().dialog.is_none());
}

#[test]
fn the_scale_has_keys_and_limits() {
    let mut window = Window::demo();
    window.press(Modifiers::COMMAND, Key::Minus);
    assert_eq!(preferences(&window).scale, 100);
    window.press(Modifiers::COMMAND, Key::Equals);
    window.press(Modifiers::COMMAND, Key::Plus);
    assert_eq!(preferences(&window).scale, 120);
    assert!((window.harness.ctx.zoom_factor() - 1.2).abs() < 1e-6);
    window.press(Modifiers::COMMAND, Key::Num0);
    assert_eq!(preferences(&window).scale, 100);
}

#[test]
fn each_hint_is_shown_once_and_all_of_them_again_when_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let first = "Click on something in the image and name its class, or press N to be shown a place";
    let second = "No strokes yet: choose a class, then click or scribble on the image";
    {
        let mut window = Window::with_demo(folder.path());
        window.harness.get_by_label(first);
        // Followed.
        window.add_class("wall");
        assert!(preferences(&window).hints_seen.contains(&Hint::FirstClass));
        window.harness.get_by_label(second);
        window.click("Dismiss hint");
        assert!(window.harness.query_by_label(second).is_none());
        window.close();
    }
    let mut window = Window::with_demo(folder.path());
    assert!(window.harness.query_by_label(second).is_none());
    window.press(Modifiers::COMMAND, Key::Comma);
    window.choose("Show all hints again");
    window.choose("Close");
    window.harness.get_by_label(second);
    let place = window.canvas(0.0, 0.0);
    window.drag(PointerButton::Primary, &[place]);
    assert!(window.harness.query_by_label(second).is_none());
}

#[test]
fn a_menu_that_is_higher_than_the_window_begins_below_the_bar() {
    let mut window = Window::demo();
    window.act(Command::Prefer(PreferenceChange::Scale(200)));
    window.harness.run_steps(4);
    let bar = window.harness.get_by_label("View").rect();
    window.click("View");
    window.harness.run_steps(4);
    let first = window.harness.get_by_label("Colour").rect();
    assert!(first.top() >= bar.bottom(), "{first} {bar}");
}
