//! The keys: what they do by default stands in [`table`], and the person may move them.

pub mod table;

use std::sync::Arc;

use egui::{Event, Key, Modifiers};
use inplace_model::keymap::{KeyMap, Shortcut};
use inplace_model::workspace::Workspace;
use inplace_model::{Command, Commands};

use table::{AT_A_PLACE, AT_A_SUGGESTION, Line, TABLE, UiCommand};

/// Makes this the key map of a window: [`map_of`] finds it.
pub fn install(ctx: &egui::Context, map: KeyMap) {
    ctx.data_mut(|data| data.insert_temp(egui::Id::NULL, Arc::new(map)));
}

/// The key map of a window.
pub fn map_of(ctx: &egui::Context) -> Arc<KeyMap> {
    ctx.data(|data| data.get_temp(egui::Id::NULL)).unwrap_or_default()
}

/// The key that an event presses, with what is held beside it. With Alt there is none, but for what is typed with it on
/// macOS, which is another key than the one pressed.
pub fn pressed(event: &Event) -> Option<(Modifiers, Key)> {
    match *event {
        Event::Key {
            key,
            physical_key,
            pressed: true,
            modifiers,
            ..
        } => {
            let typed = cfg!(target_os = "macos") && physical_key.is_some_and(|physical| physical != key);
            (typed || !modifiers.alt).then_some((modifiers, key))
        }
        _ => None,
    }
}

/// A key as it was pressed; `None` of one that has no name here.
pub fn shortcut(modifiers: Modifiers, key: Key) -> Option<Shortcut> {
    let name = match key {
        Key::ArrowLeft | Key::ArrowRight | Key::ArrowUp | Key::ArrowDown => key.name(),
        Key::Minus => "-",
        key => key.symbol_or_name(),
    };
    Some(Shortcut {
        command: modifiers.command,
        shift: modifiers.shift,
        key: inplace_model::keymap::Key::named(name)?,
    })
}

impl UiCommand {
    /// The key that is shown for it now, for people; empty where it has none.
    pub fn key(&self, ctx: &egui::Context) -> String {
        let map = map_of(ctx);
        let first = self.keys.first().and_then(|&default| map.present(default));
        first.map_or_else(String::new, |key| key.to_string())
    }

    /// Its name with its key: "Erase (E)".
    pub fn named(&self, ctx: &egui::Context) -> String {
        self.named_as(ctx, self.name)
    }

    /// Another name with its key: "Undo scribble wall (Ctrl+Z)".
    pub fn named_as(&self, ctx: &egui::Context, name: &str) -> String {
        match self.key(ctx) {
            key if key.is_empty() => name.to_owned(),
            key => format!("{name} ({key})"),
        }
    }

    /// All its keys as they are now, for people.
    pub fn present(&self, map: &KeyMap) -> String {
        let keys = self.keys.iter().filter_map(|&default| map.present(default));
        let keys: Vec<String> = keys.map(|key| key.to_string()).collect();
        keys.join(", ")
    }
}

/// What keys are about before anything else.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Asked {
    /// Nothing but what they always are.
    Nothing,
    /// The suggestion at hand, which they answer.
    Suggestion,
    /// The place of an audit at hand, which they judge.
    Place,
}

impl Asked {
    /// What they are about now.
    pub fn of(workspace: Option<&Workspace>) -> Self {
        match workspace {
            Some(workspace) if workspace.auditing.at.is_some() => Self::Place,
            Some(workspace) if workspace.suggestions().is_active() => Self::Suggestion,
            _ => Self::Nothing,
        }
    }

    /// The keys that answer.
    fn table(self) -> &'static [Line] {
        match self {
            Self::Nothing => &[],
            Self::Suggestion => AT_A_SUGGESTION,
            Self::Place => AT_A_PLACE,
        }
    }
}

/// Whether a text field or an open menu has the keys.
pub fn are_taken(ctx: &egui::Context) -> bool {
    ctx.text_edit_focused() || egui::Popup::is_any_open(ctx)
}

/// Under which the identity of the 3D view is kept.
fn space_id() -> egui::Id {
    egui::Id::unique("the 3D view for keys")
}

/// Notes which control the 3D view is: where it has the keyboard, it turns with the arrow keys and does nothing with Enter.
pub fn note_space(ctx: &egui::Context, id: egui::Id) {
    ctx.data_mut(|data| data.insert_temp(space_id(), id));
}

fn is_in_space(ctx: &egui::Context) -> bool {
    let focused = ctx.memory(|memory| memory.focused());
    focused.is_some() && focused == ctx.data(|data| data.get_temp::<egui::Id>(space_id()))
}

/// Pushes the commands of the keys pressed in this frame; `asked` tells what they are about. An open menu keeps all
/// keys, a focused text field all but those with Ctrl that mean nothing in a text, and a focused control the arrow keys
/// and Enter; the 3D view leaves Enter. A key that is held goes on with steps alone.
pub fn dispatch(ctx: &egui::Context, asked: Asked, commands: &mut Commands) {
    if egui::Popup::is_any_open(ctx) {
        return;
    }
    let typing = ctx.text_edit_focused();
    let focused = ctx.egui_wants_keyboard_input();
    let in_space = is_in_space(ctx);
    let map = map_of(ctx);
    ctx.input(|input| {
        for event in &input.events {
            let Some((modifiers, key)) = pressed(event) else {
                continue;
            };
            let turns = matches!(key, Key::ArrowLeft | Key::ArrowRight);
            let of_controls = turns || key == Key::Enter && !in_space;
            let of_texts = !modifiers.command || matches!(key, Key::Z | Key::Y);
            if focused && of_controls || typing && of_texts {
                continue;
            }
            let is_held = matches!(event, Event::Key { repeat: true, .. });
            let command = shortcut(modifiers, key).and_then(|pressed| command_of(&map, pressed, asked));
            commands.extend(command.filter(|command| !(is_held && command.is_done_once())));
        }
    });
}

/// Whether a key opens something that takes the keyboard, so that what is typed next is meant for that.
pub fn moves_focus(ctx: &egui::Context, modifiers: Modifiers, key: Key) -> bool {
    let pressed = shortcut(modifiers, key);
    let command = pressed.and_then(|pressed| command_of(&map_of(ctx), pressed, Asked::Nothing));
    matches!(command, Some(Command::Show(Some(_)) | Command::FindClass(_)))
}

/// What a key does with this map.
fn command_of(map: &KeyMap, pressed: Shortcut, asked: Asked) -> Option<Command> {
    let bound = in_table(asked.table(), &KeyMap::default(), pressed);
    if bound.is_none()
        && let Some(slot) = pressed.digit()
    {
        return Some(Command::ChooseSlot(slot));
    }
    let bound = bound.or_else(|| in_table(TABLE, map, pressed));
    bound.map(|(command, _)| command.command.clone())
}

/// A command, and the default key by which it is bound.
type Binding = (&'static UiCommand, Shortcut);

/// What a key does in a table with this map. Shift only counts together with Ctrl, or where something is bound to
/// it: layouts differ in what needs Shift.
fn in_table(table: &'static [Line], map: &KeyMap, pressed: Shortcut) -> Option<Binding> {
    let with_shift = bound_to(table, map, pressed);
    if pressed.shift && !pressed.command {
        with_shift.or_else(|| bound_to(table, map, pressed.without_shift()))
    } else {
        with_shift
    }
}

/// The command that a key is bound to in a table with this map.
fn bound_to(table: &'static [Line], map: &KeyMap, pressed: Shortcut) -> Option<Binding> {
    let mut all = bindings(table);
    all.find(|&(_, default)| map.present(default) == Some(pressed))
}

fn bindings(table: &'static [Line]) -> impl Iterator<Item = Binding> {
    let commands = table.iter().filter_map(|line| match line {
        Line::Command(command) => Some(*command),
        Line::Gesture(..) => None,
    });
    commands.flat_map(|command| command.keys.iter().map(move |&key| (command, key)))
}

/// What a key does with this map, in words, and the default key of that.
pub fn meaning(map: &KeyMap, pressed: Shortcut) -> Option<(&'static str, Shortcut)> {
    bound_to(TABLE, map, pressed).map(|(command, default)| (command.does, default))
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;
    use crate::keys::table::{ERASE, HELP, REDO};
    use inplace_core::guide::audit::Verdict;
    use inplace_model::dialogs::Dialog;

    fn parsed(text: &str) -> Shortcut {
        text.parse().unwrap()
    }

    fn pressed(text: &str) -> Option<Command> {
        command_of(&KeyMap::default(), parsed(text), Asked::Nothing)
    }

    #[test]
    fn every_key_that_is_not_held_beside_others_has_a_name_and_every_default_is_a_key_that_is_bound_once() {
        for &key in Key::ALL {
            let mut held = ["Shift", "Control", "Alt", "Super"].into_iter();
            let is_held = held.any(|held| key.name().starts_with(held));
            assert_eq!(shortcut(Modifiers::NONE, key).is_none(), is_held, "{key:?}");
        }
        for table in [TABLE, AT_A_SUGGESTION, AT_A_PLACE] {
            let mut seen = HashSet::new();
            for (command, default) in bindings(table) {
                assert_eq!(default.to_string().parse(), Ok(default), "{}", command.does);
                assert!(seen.insert(default), "{default} is bound twice: {command:?}");
                assert!(default.digit().is_none(), "{default} chooses a class");
            }
        }
    }

    #[test]
    fn shift_counts_where_something_is_bound_to_it() {
        let help = Some(Command::Show(Some(Dialog::Help)));
        for (key, command) in [
            ("Ctrl+Z", Some(Command::Undo)),
            ("Ctrl+Shift+Z", Some(Command::Redo)),
            ("Z", None),
            ("N", Some(Command::NextSuggestion)),
            ("Shift+N", Some(Command::PreviousSuggestion)),
            ("?", help.clone()),
            ("Shift+?", help),
            ("3", Some(Command::ChooseSlot(3))),
        ] {
            assert_eq!(pressed(key), command, "{key}");
        }
        let answer = |key| command_of(&KeyMap::default(), parsed(key), Asked::Suggestion);
        assert_eq!(answer("3"), Some(Command::ChooseSlot(3)));
        assert_eq!(answer("Delete"), Some(Command::SkipSuggestion));
        assert_eq!(answer("Ctrl+Z"), Some(Command::Undo));
        let judge = |key| command_of(&KeyMap::default(), parsed(key), Asked::Place);
        assert_eq!(judge("N"), Some(Command::Judge(Verdict::Wrong)));
        assert_eq!(judge("3"), Some(Command::ChooseSlot(3)));
    }

    #[test]
    fn help_and_names_show_the_present_keys() {
        let ctx = egui::Context::default();
        assert_eq!(ERASE.named(&ctx), "Erase (E)");
        let mut map = KeyMap::default();
        map.set(parsed("E"), Some(parsed("K")));
        map.set(parsed("F1"), Some(parsed("F2")));
        map.set(parsed("Ctrl+Shift+Z"), None);
        assert_eq!(
            (HELP.present(&map), REDO.present(&map)),
            ("?, F2".to_owned(), "Ctrl+Y".to_owned())
        );
        install(&ctx, map);
        assert_eq!(ERASE.named(&ctx), "Erase (K)");
        assert_eq!(REDO.named_as(&ctx, "Redo scribble"), "Redo scribble");
    }
}
