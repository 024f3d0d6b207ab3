//! What every key and gesture does by default.

use egui::{Key, Modifiers};

use super::{Binding, Row};
use crate::action::Action;
use crate::canvas::Tool;
use crate::dialogs::{ClassUse, Dialog};
use crate::english::keys as words;
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
        words: words::LABEL,
        bindings: &[],
    },
    Row {
        words: words::STRAIGHT,
        bindings: &[],
    },
    Row {
        words: words::ERASE,
        bindings: &[],
    },
    Row {
        words: words::DRAWING_TOOLS,
        bindings: &[
            key(Key::B, Action::ChooseTool(Tool::Brush)),
            key(Key::L, Action::ChooseTool(Tool::Polyline)),
            key(Key::G, Action::ChooseTool(Tool::Polygon)),
        ],
    },
    Row {
        words: words::END_DRAFT,
        bindings: &[],
    },
    Row {
        words: words::DROP_DRAFT,
        bindings: &[],
    },
    Row {
        words: words::TOGGLE_ERASER,
        bindings: &[key(Key::E, Action::ToggleTool)],
    },
    Row {
        words: words::SELECT,
        bindings: &[key(Key::S, Action::ChooseTool(Tool::Select))],
    },
    Row {
        words: words::DELETE,
        bindings: &[key(Key::Delete, Action::DeleteSelected)],
    },
    Row {
        words: words::CLASS_DIGITS,
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
        words: words::FIND_CLASS,
        bindings: &[key(Key::C, Action::FindClass(ClassUse::Choose))],
    },
    Row {
        words: words::MOVE_CLASS,
        bindings: &[],
    },
    Row {
        words: words::BRUSH_SIZE,
        bindings: &[
            key(Key::OpenBracket, Action::StepBrush(-1)),
            key(Key::CloseBracket, Action::StepBrush(1)),
        ],
    },
    Row {
        words: words::ZOOM,
        bindings: &[],
    },
    Row {
        words: words::MOVE_IMAGE,
        bindings: &[],
    },
    Row {
        words: words::FIT,
        bindings: &[key(Key::F, Action::Fit)],
    },
    Row {
        words: words::SPACE,
        bindings: &[key(Key::V, Action::ToggleSpace)],
    },
    Row {
        words: words::STEP_FRAME,
        bindings: &[
            key(Key::A, Action::StepFrame(-1)),
            key(Key::D, Action::StepFrame(1)),
            key(Key::ArrowLeft, Action::StepFrame(-1)),
            key(Key::ArrowRight, Action::StepFrame(1)),
        ],
    },
    Row {
        words: words::STEP_SUGGESTION,
        bindings: &[
            key(Key::N, Action::NextSuggestion),
            with(Modifiers::SHIFT, Key::N, Action::PreviousSuggestion),
        ],
    },
    Row {
        words: words::SIDE,
        bindings: &[key(Key::T, Action::SwitchSide)],
    },
    Row {
        words: words::HIDE_OVERLAY,
        bindings: &[],
    },
    Row {
        words: words::LAYER,
        bindings: &[key(Key::Q, Action::CycleLayer)],
    },
    Row {
        words: words::COMPARE,
        bindings: &[key(Key::W, Action::ToggleCompare)],
    },
    Row {
        words: words::UNDO_REDO,
        bindings: &[
            with(CTRL, Key::Z, Action::Undo),
            with(CTRL_SHIFT, Key::Z, Action::Redo),
            with(CTRL, Key::Y, Action::Redo),
        ],
    },
    Row {
        words: words::SAVE,
        bindings: &[with(CTRL, Key::S, Action::Save)],
    },
    Row {
        words: words::OPEN,
        bindings: &[with(CTRL, Key::O, Action::Show(Some(Dialog::open())))],
    },
    Row {
        words: words::EXPORT,
        bindings: &[with(CTRL, Key::E, Action::Show(Some(Dialog::export())))],
    },
    Row {
        words: words::PAUSE,
        bindings: &[key(Key::P, Action::TogglePause)],
    },
    Row {
        words: words::SETTINGS,
        bindings: &[with(CTRL, Key::Comma, Action::Show(Some(Dialog::settings())))],
    },
    Row {
        words: words::SCALE,
        bindings: &[
            with(CTRL, Key::Plus, Action::Prefer(Change::StepScale(1))),
            with(CTRL, Key::Equals, Action::Prefer(Change::StepScale(1))),
            with(CTRL_SHIFT, Key::Plus, Action::Prefer(Change::StepScale(1))),
            with(CTRL, Key::Minus, Action::Prefer(Change::StepScale(-1))),
            with(CTRL, Key::Num0, Action::Prefer(Change::Scale(100))),
        ],
    },
    Row {
        words: words::HELP,
        bindings: &[
            key(Key::Questionmark, Action::Show(Some(Dialog::Help))),
            key(Key::F1, Action::Show(Some(Dialog::Help))),
        ],
    },
];

/// The keys that answer a suggestion; while one is at hand they come before those of [`TABLE`].
pub static AT_A_SUGGESTION: &[Row] = &[
    Row {
        words: words::ANSWER_LIKELY,
        bindings: &[
            key(Key::Enter, Action::AnswerLikely(0)),
            with(Modifiers::SHIFT, Key::Enter, Action::AnswerLikely(1)),
        ],
    },
    Row {
        words: words::ANSWER_DIGITS,
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
        words: words::ANSWER_NAME,
        bindings: &[key(Key::C, Action::FindClass(ClassUse::Answer))],
    },
    Row {
        words: words::SKIP,
        bindings: &[
            key(Key::X, Action::SkipSuggestion),
            key(Key::Delete, Action::SkipSuggestion),
        ],
    },
    Row {
        words: words::LEAVE,
        bindings: &[key(Key::Escape, Action::LeaveSuggestions)],
    },
];
