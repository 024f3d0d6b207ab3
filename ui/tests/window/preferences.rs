//! What a person prefers: kept, taken back when damaged, keys, scale, hints.

use std::path::Path;

use egui::{Key, Modifiers};
use inplace_model::Command;
use inplace_model::hints::Hint;
use inplace_model::preferences::{PreferenceChange, Theme};
use inplace_model::settings::Settings;
use inplace_model::tool::Tool;

use crate::stand::*;

#[test]
fn the_scale_has_keys_preferences_survive_a_restart_and_damaged_ones_are_set_aside() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = Window::with_demo(folder.path());
    window.press(Modifiers::COMMAND, Key::Minus);
    assert_eq!(window.model().preferences.scale, 100);
    window.press(Modifiers::COMMAND, Key::Equals);
    window.press(Modifiers::COMMAND, Key::Plus);
    assert_eq!(window.model().preferences.scale, 120);
    assert!((window.harness.ctx.zoom_factor() - 1.2).abs() < 1e-6);
    window.act(Command::Prefer(PreferenceChange::StepScale(100)));
    assert_eq!(window.model().preferences.scale, 300);
    window.press(Modifiers::COMMAND, Key::Num0);
    assert_eq!(window.model().preferences.scale, 100);
    window.press(Modifiers::COMMAND, Key::Plus);
    window.press(Modifiers::COMMAND, Key::Comma);
    window.choose("Light");
    assert_eq!(window.harness.ctx.theme(), egui::Theme::Light);
    window.type_into("Features", "/nets/mobilenet.pth");
    window.choose("Close");
    window.click_through(&["View", "Borders between classes"]);
    assert!(!window.model().settings.outlines);
    window.close();
    let window = Window::new(folder.path(), None);
    assert_eq!(window.model().preferences.scale, 110);
    assert_eq!(window.model().preferences.theme, Theme::Light);
    let features = window.model().preferences.features.as_deref();
    assert_eq!(features, Some(Path::new("/nets/mobilenet.pth")));
    assert!(!window.model().settings.outlines);
    window.close();
    std::fs::write(preferences_file(folder.path()), "{ damaged").unwrap();
    let window = Window::with_demo(folder.path());
    window.says("set aside");
}

#[test]
fn the_settings_of_a_project_win_and_change_no_preference() {
    let folder = tempfile::tempdir().unwrap();
    {
        let mut window = Window::with_demo(folder.path());
        window.click_through(&["View", "Borders between classes"]);
        window.close();
    }
    std::fs::remove_file(preferences_file(folder.path())).unwrap();
    let mut window = Window::new(folder.path(), None);
    assert!(window.model().settings.outlines);
    window.click("Try the demo");
    window.until_open();
    assert!(!window.model().settings.outlines);
    window.close();
    let window = Window::new(folder.path(), None);
    assert_eq!(window.model().settings, Settings::default());
}

#[test]
fn a_key_can_be_changed_and_help_shows_the_new_one() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = Window::with_demo(folder.path());
    window.press(Modifiers::COMMAND, Key::Comma);
    window.choose("Pause or resume training: P");
    window.key(Key::ControlLeft);
    window.key(Key::K);
    window.sees("Pause or resume training: K");
    window.choose("Close");
    window.key(Key::P);
    assert!(!window.workspace().paused);
    window.key(Key::K);
    assert!(window.workspace().paused);
    window.key(Key::Questionmark);
    window.sees("K");
    window.choose("Close");
    window.close();
    let mut window = Window::with_demo(folder.path());
    window.key(Key::K);
    assert!(window.workspace().paused);
    window.press(Modifiers::COMMAND, Key::Comma);
    window.choose("Reset all keys");
    window.choose("Close");
    window.key(Key::P);
    assert!(!window.workspace().paused);
    // A key that does something else is shown, and can be taken.
    window.press(Modifiers::COMMAND, Key::Comma);
    window.choose("Pause or resume training: P");
    window.key(Key::Num1);
    window.sees("1 cannot be given away: the window needs it.");
    window.choose("Another key");
    window.key(Key::F);
    window.sees("F is taken: Fit the image, or the scene in the 3D view, into the window.");
    assert!(window.model().preferences.keys.is_default());
    window.choose("Use it here");
    window.sees("Fit the image, or the scene in the 3D view, into the window: no key, by default F");
    window.sees("Pause or resume training: F");
    // Giving F back takes it from what has it now.
    window.choose("Reset Fit the image, or the scene in the 3D view, into the window to F");
    window.sees("Fit the image, or the scene in the 3D view, into the window: F");
    window.sees("Pause or resume training: no key, by default P");
    window.choose("Reset Pause or resume training to P");
    assert!(window.model().preferences.keys.is_default());
    // Escape leaves the key as it was, and the settings open.
    window.choose("Pause or resume training: P");
    window.key(Key::Escape);
    window.sees("Pause or resume training: P");
    window.key(Key::Escape);
    assert!(window.model().dialog.is_none());
}

#[test]
fn a_held_key_goes_on_with_steps_and_switches_once_and_with_alt_none_is_a_shortcut() {
    let mut window = Window::demo();
    for key in [Key::D, Key::E] {
        for _ in 0..2 {
            window.harness.key_down(key);
            window.harness.run_steps(2);
        }
        window.harness.key_up(key);
        window.harness.run_steps(2);
    }
    assert_eq!((window.frame_index(), window.tool()), (2, Tool::Erase));
    window.press(Modifiers::ALT, Key::D);
    window.press(Modifiers::ALT | Modifiers::COMMAND, Key::E);
    assert_eq!((window.frame_index(), window.tool()), (2, Tool::Erase));
    assert!(window.model().dialog.is_none());
}

#[test]
fn each_hint_is_shown_once_and_all_of_them_again_when_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let first = "Click on something in the image and name its class, or press N to be shown a place";
    let second = "No strokes yet: choose a class, then click or scribble on the image";
    {
        let mut window = Window::with_demo(folder.path());
        window.sees(first);
        // Followed.
        window.add_class("wall");
        assert!(window.model().preferences.hints_seen.contains(&Hint::FirstClass));
        window.sees(second);
        window.click("Dismiss hint");
        window.misses(second);
        window.close();
    }
    let mut window = Window::with_demo(folder.path());
    window.misses(second);
    window.press(Modifiers::COMMAND, Key::Comma);
    window.choose("Show all hints again");
    window.choose("Close");
    window.sees(second);
    window.click_canvas(0.0, 0.0);
    window.misses(second);

    // What speaks of the list stands above it and covers no image.
    let third = "These are the places whose label would settle most: click on one, or press N";
    let generation = window.generation();
    window.suggest(generation, vec![suggestion(1)]);
    let (hint, list) = (window.rect(third), window.rect("Go to suggestion 1"));
    let image = window.rect(inplace_ui::canvas::CANVAS_NAME);
    assert!(hint.left() > image.right() && hint.bottom() < list.top());
    window.key(Key::N);
    window.misses(third);
    assert!(window.model().preferences.hints_seen.contains(&Hint::Suggestions));
}

#[test]
fn a_menu_that_is_higher_than_the_window_begins_below_the_bar() {
    let mut window = Window::demo();
    window.act(Command::Prefer(PreferenceChange::Scale(200)));
    window.harness.run_steps(4);
    let bar = window.rect("View");
    window.click("View");
    window.harness.run_steps(4);
    let first = window.rect("Colour");
    assert!(first.top() >= bar.bottom(), "{first} {bar}");
}

#[test]
fn an_open_menu_keeps_all_keys_and_escape_or_a_click_beside_it_closes_it_alone() {
    let mut window = Window::demo().labelled(&[(0, "wall", [0.0, 0.0])]);
    let stroke = *window.labels().strokes.keys().next().unwrap();
    window.act(Command::GoToStroke(stroke));
    let tool = window.tool();
    window.click("View");
    for key in [Key::E, Key::D, Key::Delete] {
        window.key(key);
    }
    window.press(Modifiers::COMMAND, Key::Z);
    let state = (window.strokes(), window.tool(), window.frame_index());
    assert_eq!(state, (1, tool, 0));
    window.sees("Borders between classes");
    window.key(Key::Escape);
    window.misses("Borders between classes");
    assert_eq!(window.selected(), Some(stroke));
    window.key(Key::Delete);
    assert_eq!(window.strokes(), 0);
    // So does a click beside it.
    window.click("View");
    for strokes in [0, 1] {
        window.click_canvas(60.0, 60.0);
        assert_eq!(window.strokes(), strokes);
        window.misses("Borders between classes");
    }
}
