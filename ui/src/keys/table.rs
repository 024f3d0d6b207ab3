//! What every key and gesture does by default.

use egui::{Key, Modifiers};

use super::{Binding, Row};
use crate::action::Action;
use crate::canvas::Tool;
use crate::dialogs::{ClassUse, Dialog};
use crate::preferences::Change;

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
        shown: "Shift+click",
        does: "Label along a straight line from where the last one ended",
        bindings: &[],
    },
    Row {
        shown: "Right drag",
        does: "Erase",
        bindings: &[],
    },
    Row {
        shown: "B, L, G",
        does: "Brush, polyline, polygon",
        bindings: &[
            key(Key::B, Action::ChooseTool(Tool::Brush)),
            key(Key::L, Action::ChooseTool(Tool::Polyline)),
            key(Key::G, Action::ChooseTool(Tool::Polygon)),
        ],
    },
    Row {
        shown: "Enter or double-click",
        does: "End the polyline or polygon",
        bindings: &[],
    },
    Row {
        shown: "Backspace, Escape",
        does: "Take its last corner back, drop it",
        bindings: &[],
    },
    Row {
        shown: "E",
        does: "Switch the left button between labelling and erasing",
        bindings: &[key(Key::E, Action::ToggleTool)],
    },
    Row {
        shown: "S",
        does: "Select strokes by clicking on them",
        bindings: &[key(Key::S, Action::ChooseTool(Tool::Select))],
    },
    Row {
        shown: "Delete",
        does: "Delete the selected stroke",
        bindings: &[key(Key::Delete, Action::DeleteSelected)],
    },
    Row {
        shown: "1 to 9, 0",
        does: "Choose a class, or change that of the stroke selected with S; 0 is void",
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
        shown: "C",
        does: "Find a class by typing part of its name, or make one",
        bindings: &[key(Key::C, Action::FindClass(ClassUse::Choose))],
    },
    Row {
        shown: "Alt+Up and Alt+Down",
        does: "Move the class that has the focus in the list",
        bindings: &[],
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
        does: "Fit the image, or the scene in the 3D view, into the window",
        bindings: &[key(Key::F, Action::Fit)],
    },
    Row {
        shown: "V",
        does: "Switch between the frame and the 3D view",
        bindings: &[key(Key::V, Action::ToggleSpace)],
    },
    Row {
        shown: "A and D, Left and Right",
        does: "Previous and next frame, of those that the filmstrip shows",
        bindings: &[
            key(Key::A, Action::StepFrame(-1)),
            key(Key::D, Action::StepFrame(1)),
            key(Key::ArrowLeft, Action::StepFrame(-1)),
            key(Key::ArrowRight, Action::StepFrame(1)),
        ],
    },
    Row {
        shown: "N, Shift+N",
        does: "Go to the next suggestion, or the one before",
        bindings: &[
            key(Key::N, Action::NextSuggestion),
            with(Modifiers::SHIFT, Key::N, Action::PreviousSuggestion),
        ],
    },
    Row {
        shown: "T",
        does: "Show the other tab at the right: what to label next, progress",
        bindings: &[key(Key::T, Action::SwitchSide)],
    },
    Row {
        shown: "Tab (hold)",
        does: "Hide the overlay while the pointer is over the frame",
        bindings: &[],
    },
    Row {
        shown: "Q",
        does: "Next layer: colour, labels, entropy, disagreement, depth, rendered colour",
        bindings: &[key(Key::Q, Action::CycleLayer)],
    },
    Row {
        shown: "W",
        does: "Compare two layers side by side",
        bindings: &[key(Key::W, Action::ToggleCompare)],
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
        shown: "Ctrl+,",
        does: "Settings",
        bindings: &[with(CTRL, Key::Comma, Action::Show(Some(Dialog::settings())))],
    },
    Row {
        shown: "Ctrl++, Ctrl+-, Ctrl+0",
        does: "Everything larger, smaller, as it comes",
        bindings: &[
            with(CTRL, Key::Plus, Action::Prefer(Change::StepScale(1))),
            with(CTRL, Key::Equals, Action::Prefer(Change::StepScale(1))),
            with(CTRL_SHIFT, Key::Plus, Action::Prefer(Change::StepScale(1))),
            with(CTRL, Key::Minus, Action::Prefer(Change::StepScale(-1))),
            with(CTRL, Key::Num0, Action::Prefer(Change::Scale(100))),
        ],
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

/// The keys that answer a suggestion; while one is at hand they come before those of [`TABLE`].
pub static AT_A_SUGGESTION: &[Row] = &[
    Row {
        shown: "Enter, Shift+Enter",
        does: "At a suggestion: label it with its first or second likely class",
        bindings: &[
            key(Key::Enter, Action::AnswerLikely(0)),
            with(Modifiers::SHIFT, Key::Enter, Action::AnswerLikely(1)),
        ],
    },
    Row {
        shown: "1 to 9, 0",
        does: "At a suggestion: label it with a class of the list; 0 is void",
        bindings: &[
            key(Key::Num0, Action::AnswerSlot(0)),
            key(Key::Num1, Action::AnswerSlot(1)),
            key(Key::Num2, Action::AnswerSlot(2)),
            key(Key::Num3, Action::AnswerSlot(3)),
            key(Key::Num4, Action::AnswerSlot(4)),
            key(Key::Num5, Action::AnswerSlot(5)),
            key(Key::Num6, Action::AnswerSlot(6)),
            key(Key::Num7, Action::AnswerSlot(7)),
            key(Key::Num8, Action::AnswerSlot(8)),
            key(Key::Num9, Action::AnswerSlot(9)),
        ],
    },
    Row {
        shown: "C",
        does: "At a suggestion: type the name of its class",
        bindings: &[key(Key::C, Action::FindClass(ClassUse::Answer))],
    },
    Row {
        shown: "X, Delete",
        does: "At a suggestion: skip it",
        bindings: &[
            key(Key::X, Action::SkipSuggestion),
            key(Key::Delete, Action::SkipSuggestion),
        ],
    },
    Row {
        shown: "Escape",
        does: "Leave the suggestions",
        bindings: &[key(Key::Escape, Action::LeaveSuggestions)],
    },
];
