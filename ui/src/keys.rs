//! The keys: one table for the dispatcher and for the help window.

use egui::{Event, Key, Modifiers};

use crate::action::{Action, Actions};
use crate::dialogs::Dialog;

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
    /// The keys, for people.
    pub shown: &'static str,
    /// What they do.
    pub does: &'static str,
    bindings: &'static [Binding],
}

const fn key(key: Key, action: Action) -> Binding {
    Binding {
        modifiers: Modifiers::NONE,
        key,
        action,
    }
}

const fn with(modifiers: Modifiers, key: Key, action: Action) -> Binding {
    Binding {
        modifiers,
        key,
        action,
    }
}

const CTRL: Modifiers = Modifiers::COMMAND;
const CTRL_SHIFT: Modifiers = Modifiers::COMMAND.plus(Modifiers::SHIFT);

/// Every key and gesture, in the order of the help window.
pub static TABLE: &[Row] = &[
    Row {
        shown: "Left click, drag",
        does: "Label a point, or scribble, with the current class",
        bindings: &[],
    },
    Row {
        shown: "Right drag",
        does: "Erase",
        bindings: &[],
    },
    Row {
        shown: "E",
        does: "Switch the left button between labelling and erasing",
        bindings: &[key(Key::E, Action::ToggleTool)],
    },
    Row {
        shown: "1 to 9, 0",
        does: "Choose a class; 0 is void",
        bindings: &[
            key(Key::Num0, Action::ChooseSlot(0)),
            key(Key::Num1, Action::ChooseSlot(1)),
            key(Key::Num2, Action::ChooseSlot(2)),
            key(Key::Num3, Action::ChooseSlot(3)),
            key(Key::Num4, Action::ChooseSlot(4)),
            key(Key::Num5, Action::ChooseSlot(5)),
            key(Key::Num6, Action::ChooseSlot(6)),
            key(Key::Num7, Action::ChooseSlot(7)),
            key(Key::Num8, Action::ChooseSlot(8)),
            key(Key::Num9, Action::ChooseSlot(9)),
        ],
    },
    Row {
        shown: "[ and ], Ctrl+wheel",
        does: "Smaller and larger brush",
        bindings: &[
            key(Key::OpenBracket, Action::StepBrush(-1)),
            key(Key::CloseBracket, Action::StepBrush(1)),
        ],
    },
    Row {
        shown: "Wheel",
        does: "Zoom at the cursor",
        bindings: &[],
    },
    Row {
        shown: "Space+drag, middle drag",
        does: "Move the image",
        bindings: &[],
    },
    Row {
        shown: "F",
        does: "Fit the image into the window",
        bindings: &[key(Key::F, Action::SetView(crate::canvas::View::FITTED))],
    },
    Row {
        shown: "A and D, Left and Right",
        does: "Previous and next frame",
        bindings: &[
            key(Key::A, Action::StepFrame(-1)),
            key(Key::D, Action::StepFrame(1)),
            key(Key::ArrowLeft, Action::StepFrame(-1)),
            key(Key::ArrowRight, Action::StepFrame(1)),
        ],
    },
    Row {
        shown: "N",
        does: "Go to the next suggestion",
        bindings: &[key(Key::N, Action::NextSuggestion)],
    },
    Row {
        shown: "Tab (hold)",
        does: "Hide the overlay while the pointer is over the frame",
        bindings: &[],
    },
    Row {
        shown: "Q",
        does: "Next layer: colour, labels, entropy",
        bindings: &[key(Key::Q, Action::CycleLayer)],
    },
    Row {
        shown: "Ctrl+Z, Ctrl+Shift+Z",
        does: "Undo and redo, also on other frames",
        bindings: &[
            with(CTRL, Key::Z, Action::Undo),
            with(CTRL_SHIFT, Key::Z, Action::Redo),
            with(CTRL, Key::Y, Action::Redo),
        ],
    },
    Row {
        shown: "Ctrl+S",
        does: "Save",
        bindings: &[with(CTRL, Key::S, Action::Save)],
    },
    Row {
        shown: "Ctrl+O",
        does: "Open a scene or a project",
        bindings: &[with(CTRL, Key::O, Action::Show(Some(Dialog::open())))],
    },
    Row {
        shown: "Ctrl+E",
        does: "Export",
        bindings: &[with(CTRL, Key::E, Action::Show(Some(Dialog::export())))],
    },
    Row {
        shown: "P",
        does: "Pause or resume training",
        bindings: &[key(Key::P, Action::TogglePause)],
    },
    Row {
        shown: "?",
        does: "This table",
        bindings: &[
            key(Key::Questionmark, Action::Show(Some(Dialog::Help))),
            key(Key::F1, Action::Show(Some(Dialog::Help))),
        ],
    },
];

/// Pushes the actions of the keys pressed in this frame. Nothing happens while a text field has the
/// focus, and arrow keys stay with a focused control.
pub fn dispatch(ctx: &egui::Context, actions: &mut Actions) {
    if ctx.text_edit_focused() {
        return;
    }
    let focused = ctx.egui_wants_keyboard_input();
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
            let arrow = matches!(key, Key::ArrowLeft | Key::ArrowRight);
            if !(focused && arrow)
                && let Some(action) = action_of(*key, *modifiers)
            {
                actions.push(action);
            }
        }
    });
}

fn action_of(key: Key, pressed: Modifiers) -> Option<Action> {
    let mut bindings = TABLE.iter().flat_map(|row| row.bindings);
    let found = bindings.find(|binding| binding.key == key && matches(binding.modifiers, pressed))?;
    Some(found.action.clone())
}

/// Shift only counts together with Ctrl: layouts differ in what needs Shift.
fn matches(wanted: Modifiers, pressed: Modifiers) -> bool {
    wanted.command == pressed.command && (!wanted.command || wanted.shift == pressed.shift)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn no_key_is_bound_twice() {
        let mut seen = HashSet::new();
        for binding in TABLE.iter().flat_map(|row| row.bindings) {
            let pressed = (binding.key, binding.modifiers.command, binding.modifiers.shift);
            assert!(seen.insert(pressed), "{binding:?} is bound twice");
        }
    }

    #[test]
    fn shift_tells_undo_from_redo() {
        assert_eq!(action_of(Key::Z, CTRL), Some(Action::Undo));
        assert_eq!(action_of(Key::Z, CTRL_SHIFT), Some(Action::Redo));
        assert_eq!(action_of(Key::Z, Modifiers::NONE), None);
    }

    #[test]
    fn a_question_mark_is_found_with_and_without_shift() {
        let help = Some(Action::Show(Some(Dialog::Help)));
        assert_eq!(action_of(Key::Questionmark, Modifiers::SHIFT), help);
        assert_eq!(action_of(Key::Questionmark, Modifiers::NONE), help);
    }
}
