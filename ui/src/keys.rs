//! The keys: one table for the dispatcher and for the help window.

mod table;

use std::borrow::Cow;

use egui::{Event, Key, Modifiers};

pub use table::{AT_A_SUGGESTION, TABLE};

use crate::action::{Action, Actions};
use crate::english::keys::Line;
use crate::keymap::{KeyMap, Shortcut};

/// A key and what it does.
#[derive(Debug)]
pub struct Binding {
    modifiers: Modifiers,
    key: Key,
    action: Action,
}

/// A line of the help window with its keys; gestures of the mouse and keys to hold have no bindings.
#[derive(Debug)]
pub struct Row {
    /// The keys by default and what they do, for people.
    pub words: Line,
    bindings: &'static [Binding],
}

impl Binding {
    /// The key that it has unless the person chose another.
    pub fn default_key(&self) -> Shortcut {
        Shortcut::new(self.modifiers, self.key)
    }
}

impl Row {
    /// The keys of this line that a person may choose.
    pub fn choices(&self) -> impl Iterator<Item = Shortcut> + use<> {
        let bindings = self.bindings.iter().map(Binding::default_key);
        bindings.filter(|default| !default.is_fixed())
    }

    /// The keys as they are now, for people.
    pub fn present(&self, map: &KeyMap) -> String {
        if !self
            .bindings
            .iter()
            .any(|binding| map.is_moved(binding.default_key()))
        {
            return self.words.keys.to_owned();
        }
        let mut parts: Vec<String> = Vec::new();
        let mut named = Vec::new();
        for part in self.words.keys.split(", ").flat_map(|part| part.split(" and ")) {
            let bound = self.bindings.iter().map(Binding::default_key);
            match bound.into_iter().find(|default| default.to_string() == part) {
                Some(default) => {
                    named.push(default);
                    parts.extend(map.present(default).map(|present| present.to_string()));
                }
                None => parts.push(part.to_owned()),
            }
        }
        let others = self.bindings.iter().map(Binding::default_key);
        let moved = others.filter(|default| map.is_moved(*default) && !named.contains(default));
        parts.extend(moved.filter_map(|default| Some(map.present(default)?.to_string())));
        parts.join(", ")
    }
}

/// Pushes the actions of the keys pressed in this frame; `guided` tells whether keys answer suggestions. A focused text
/// field keeps all keys but those with Ctrl that mean nothing in a text; a focused control keeps the arrow keys and
/// Enter.
pub fn dispatch(ctx: &egui::Context, guided: bool, actions: &mut Actions) {
    let typing = ctx.text_edit_focused();
    let focused = ctx.egui_wants_keyboard_input();
    let (map, fixed) = (KeyMap::of(ctx), KeyMap::default());
    ctx.input(|input| {
        for event in &input.events {
            let Event::Key {
                key,
                pressed: true,
                modifiers,
                ..
            } = event
            else {
                continue;
            };
            let of_controls = matches!(key, Key::ArrowLeft | Key::ArrowRight | Key::Enter);
            let of_texts = !modifiers.command || matches!(key, Key::Z | Key::Y);
            if focused && of_controls || typing && of_texts {
                continue;
            }
            let pressed = Shortcut::new(*modifiers, *key);
            let answer = guided.then(|| action_of(AT_A_SUGGESTION, &fixed, pressed));
            let action = answer.flatten().or_else(|| action_of(TABLE, &map, pressed));
            if let Some(action) = action {
                actions.push(action);
            }
        }
    });
}

/// What a key does in a table with this map. Shift only counts together with Ctrl, or where something is bound to
/// it: layouts differ in what needs Shift.
fn action_of(table: &'static [Row], map: &KeyMap, pressed: Shortcut) -> Option<Action> {
    let with_shift = bound_to(table, map, pressed);
    let found = if pressed.shift && !pressed.command {
        with_shift.or_else(|| bound_to(table, map, pressed.without_shift()))
    } else {
        with_shift
    };
    Some(found?.1.action.clone())
}

/// What a key is bound to in a table with this map, and the line of the help window that it belongs to.
fn bound_to(
    table: &'static [Row],
    map: &KeyMap,
    pressed: Shortcut,
) -> Option<(&'static Row, &'static Binding)> {
    let all = table
        .iter()
        .flat_map(|row| row.bindings.iter().map(move |binding| (row, binding)));
    let mut all = all.filter(|(_, binding)| map.present(binding.default_key()) == Some(pressed));
    all.next()
}

/// What a key does with this map, in words, and the default key of that.
pub fn meaning(map: &KeyMap, pressed: Shortcut) -> Option<(&'static str, Shortcut)> {
    bound_to(TABLE, map, pressed).map(|(row, binding)| (row.words.does, binding.default_key()))
}

/// The present key of what `default` ("Ctrl+S") does by default; empty where it has none.
pub fn text(map: &KeyMap, default: &str) -> String {
    let Ok(shortcut) = default.parse() else {
        return default.to_owned();
    };
    map.present(shortcut)
        .map_or_else(String::new, |present| present.to_string())
}

/// A control's name that ends with a default key in brackets, "Erase (E)", with the present key instead.
pub fn named<'a>(ctx: &egui::Context, name: &'a str) -> Cow<'a, str> {
    let map = KeyMap::of(ctx);
    let parts = name.strip_suffix(')').and_then(|name| name.rsplit_once(" ("));
    match parts {
        Some((does, default)) if default.parse().is_ok_and(|default| map.is_moved(default)) => {
            match text(&map, default) {
                key if key.is_empty() => Cow::Borrowed(does),
                key => Cow::Owned(format!("{does} ({key})")),
            }
        }
        _ => Cow::Borrowed(name),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dialogs::Dialog;
    use std::collections::HashSet;

    #[test]
    fn no_key_is_bound_twice() {
        for table in [TABLE, AT_A_SUGGESTION] {
            let mut seen = HashSet::new();
            for binding in table.iter().flat_map(|row| row.bindings) {
                let pressed = (binding.key, binding.modifiers.command, binding.modifiers.shift);
                assert!(seen.insert(pressed), "{binding:?} is bound twice");
            }
        }
    }

    fn pressed(text: &str) -> Option<Action> {
        action_of(TABLE, &KeyMap::default(), text.parse().unwrap())
    }

    #[test]
    fn shift_tells_undo_from_redo() {
        assert_eq!(pressed("Ctrl+Z"), Some(Action::Undo));
        assert_eq!(pressed("Ctrl+Shift+Z"), Some(Action::Redo));
        assert_eq!(pressed("Z"), None);
        assert_eq!(pressed("Shift+N"), Some(Action::PreviousSuggestion));
        assert_eq!(pressed("N"), Some(Action::NextSuggestion));
    }

    #[test]
    fn a_question_mark_is_found_with_and_without_shift() {
        let help = Some(Action::Show(Some(Dialog::Help)));
        assert_eq!(pressed("Shift+?"), help);
        assert_eq!(pressed("?"), help);
    }

    #[test]
    fn a_key_that_was_given_to_something_else_does_only_that() {
        let mut map = KeyMap::default();
        let shortcut = |text: &str| text.parse::<Shortcut>().unwrap();
        map.set(shortcut("N"), Some(shortcut("E")));
        map.set(shortcut("E"), None);
        assert_eq!(
            action_of(TABLE, &map, shortcut("E")),
            Some(Action::NextSuggestion)
        );
        assert_eq!(action_of(TABLE, &map, shortcut("N")), None);
        assert_eq!(
            (text(&map, "N"), text(&map, "E")),
            ("E".to_owned(), String::new())
        );
        assert_eq!(
            meaning(&map, shortcut("E")).map(|(_, default)| default),
            Some(shortcut("N"))
        );
    }

    #[test]
    fn the_help_window_shows_the_present_keys_and_keeps_the_gestures() {
        let mut map = KeyMap::default();
        let shortcut = |text: &str| text.parse::<Shortcut>().unwrap();
        let row = |key: &str| {
            let row = TABLE
                .iter()
                .find(|row| row.choices().any(|default| default == shortcut(key)));
            row.unwrap()
        };
        assert_eq!(row("[").present(&map), row("[").words.keys);
        map.set(shortcut("["), Some(shortcut("J")));
        map.set(shortcut("]"), None);
        assert_eq!(row("[").present(&map), "J, Ctrl+wheel");
        map.set(shortcut("F1"), Some(shortcut("F2")));
        assert_eq!(row("?").present(&map), "?, F2");
    }

    #[test]
    fn names_of_controls_follow_their_keys() {
        let ctx = egui::Context::default();
        assert_eq!(named(&ctx, "Erase (E)"), "Erase (E)");
        let mut map = KeyMap::default();
        map.set("E".parse().unwrap(), Some("K".parse().unwrap()));
        map.install(&ctx);
        assert_eq!(named(&ctx, "Erase (E)"), "Erase (K)");
        assert_eq!(named(&ctx, "Redo (Ctrl+Y)"), "Redo (Ctrl+Y)");
        assert_eq!(named(&ctx, "Erase"), "Erase");
    }
}
