//! Every command that has a key, with its name, what it does and its default keys; and the gestures beside them.

use inplace_model::Command;
use inplace_model::dialogs::{ClassUse, Dialog};
use inplace_model::keymap::Shortcut;
use inplace_model::preferences::PreferenceChange;
use inplace_model::tool::Tool;

/// A command of the keyboard, the menus and the buttons.
#[derive(Debug)]
pub struct UiCommand {
    /// Its name on buttons and in menus.
    pub name: &'static str,
    /// What it does, for the help window and the settings.
    pub does: &'static str,
    /// Its keys, unless the person chose others; the one that is shown comes first.
    pub keys: &'static [Shortcut],
    /// What is asked for.
    pub command: Command,
}

/// A line of the help window.
#[derive(Debug)]
pub enum Line {
    /// A command with its keys.
    Command(&'static UiCommand),
    /// A gesture, or keys that no person can choose, and what they do.
    Gesture(&'static str, &'static str),
}

use Line::{Command as Key, Gesture};

/// Draw with the brush.
pub static BRUSH: UiCommand = UiCommand {
    name: "Brush",
    does: "Draw with the brush",
    keys: &[Shortcut::key("B")],
    command: Command::ChooseTool(Tool::Brush),
};

/// Draw lines from corner to corner.
pub static POLYLINE: UiCommand = UiCommand {
    name: "Polyline",
    does: "Draw lines from corner to corner",
    keys: &[Shortcut::key("L")],
    command: Command::ChooseTool(Tool::Polyline),
};

/// Draw outlines that are filled.
pub static POLYGON: UiCommand = UiCommand {
    name: "Polygon",
    does: "Draw outlines that are filled",
    keys: &[Shortcut::key("G")],
    command: Command::ChooseTool(Tool::Polygon),
};

/// Switch the left button between labelling and erasing.
pub static ERASE: UiCommand = UiCommand {
    name: "Erase",
    does: "Switch the left button between labelling and erasing",
    keys: &[Shortcut::key("E")],
    command: Command::ToggleTool,
};

/// Select strokes by clicking on them.
pub static SELECT: UiCommand = UiCommand {
    name: "Select strokes",
    does: "Select strokes by clicking on them",
    keys: &[Shortcut::key("S")],
    command: Command::ChooseTool(Tool::Select),
};

/// Delete the selected stroke.
pub static DELETE: UiCommand = UiCommand {
    name: "Delete stroke",
    does: "Delete the selected stroke",
    keys: &[Shortcut::key("Delete")],
    command: Command::DeleteSelected,
};

/// Find a class by typing part of its name, or make one.
pub static FIND_CLASS: UiCommand = UiCommand {
    name: "Find a class",
    does: "Find a class by typing part of its name, or make one",
    keys: &[Shortcut::key("C")],
    command: Command::FindClass(ClassUse::Choose),
};

/// Smaller brush.
pub static SMALLER_BRUSH: UiCommand = UiCommand {
    name: "Smaller brush",
    does: "Smaller brush",
    keys: &[Shortcut::key("[")],
    command: Command::StepBrush(-1),
};

/// Larger brush.
pub static LARGER_BRUSH: UiCommand = UiCommand {
    name: "Larger brush",
    does: "Larger brush",
    keys: &[Shortcut::key("]")],
    command: Command::StepBrush(1),
};

/// Fit the image, or the scene in the 3D view, into the window.
pub static FIT: UiCommand = UiCommand {
    name: "Fit",
    does: "Fit the image, or the scene in the 3D view, into the window",
    keys: &[Shortcut::key("F")],
    command: Command::Fit,
};

/// Switch between the frame and the 3D view.
pub static SPACE: UiCommand = UiCommand {
    name: "Frame or 3D view",
    does: "Switch between the frame and the 3D view",
    keys: &[Shortcut::key("V")],
    command: Command::ToggleSpace,
};

/// Previous frame, of those that the filmstrip shows.
pub static PREVIOUS_FRAME: UiCommand = UiCommand {
    name: "Previous frame",
    does: "Previous frame, of those that the filmstrip shows",
    keys: &[Shortcut::key("A"), Shortcut::key("Left")],
    command: Command::StepFrame(-1),
};

/// Next frame, of those that the filmstrip shows.
pub static NEXT_FRAME: UiCommand = UiCommand {
    name: "Next frame",
    does: "Next frame, of those that the filmstrip shows",
    keys: &[Shortcut::key("D"), Shortcut::key("Right")],
    command: Command::StepFrame(1),
};

/// Go to the next suggestion.
pub static NEXT_SUGGESTION: UiCommand = UiCommand {
    name: "Next",
    does: "Go to the next suggestion",
    keys: &[Shortcut::key("N")],
    command: Command::NextSuggestion,
};

/// Go to the suggestion before.
pub static PREVIOUS_SUGGESTION: UiCommand = UiCommand {
    name: "Previous",
    does: "Go to the suggestion before",
    keys: &[Shortcut::key("N").with_shift()],
    command: Command::PreviousSuggestion,
};

/// Show the other tab at the right: what to label next, progress.
pub static OTHER_SIDE: UiCommand = UiCommand {
    name: "Show the other tab",
    does: "Show the other tab at the right: what to label next, progress",
    keys: &[Shortcut::key("T")],
    command: Command::SwitchSide,
};

/// Next layer: colour, labels, entropy, disagreement, depth, rendered colour.
pub static NEXT_LAYER: UiCommand = UiCommand {
    name: "Next layer",
    does: "Next layer: colour, labels, entropy, disagreement, depth, rendered colour",
    keys: &[Shortcut::key("Q")],
    command: Command::CycleLayer,
};

/// Compare two layers side by side.
pub static COMPARE: UiCommand = UiCommand {
    name: "Compare two layers",
    does: "Compare two layers side by side",
    keys: &[Shortcut::key("W")],
    command: Command::ToggleCompare,
};

/// Undo, also on other frames.
pub static UNDO: UiCommand = UiCommand {
    name: "Undo",
    does: "Undo, also on other frames",
    keys: &[Shortcut::key("Z").with_ctrl()],
    command: Command::Undo,
};

/// Redo, also on other frames.
pub static REDO: UiCommand = UiCommand {
    name: "Redo",
    does: "Redo, also on other frames",
    keys: &[
        Shortcut::key("Z").with_ctrl().with_shift(),
        Shortcut::key("Y").with_ctrl(),
    ],
    command: Command::Redo,
};

/// Open a scene or a project.
pub static OPEN: UiCommand = UiCommand {
    name: "Open...",
    does: "Open a scene or a project",
    keys: &[Shortcut::key("O").with_ctrl()],
    command: Command::Show(Some(Dialog::open())),
};

/// Save.
pub static SAVE: UiCommand = UiCommand {
    name: "Save",
    does: "Save",
    keys: &[Shortcut::key("S").with_ctrl()],
    command: Command::Save,
};

/// Export.
pub static EXPORT: UiCommand = UiCommand {
    name: "Export...",
    does: "Export",
    keys: &[Shortcut::key("E").with_ctrl()],
    command: Command::Show(Some(Dialog::export())),
};

/// Pause or resume training.
pub static PAUSE: UiCommand = UiCommand {
    name: "Pause training",
    does: "Pause or resume training",
    keys: &[Shortcut::key("P")],
    command: Command::TogglePause,
};

/// Settings.
pub static SETTINGS: UiCommand = UiCommand {
    name: "Settings...",
    does: "Settings",
    keys: &[Shortcut::key(",").with_ctrl()],
    command: Command::Show(Some(Dialog::settings())),
};

/// Everything larger.
pub static LARGER: UiCommand = UiCommand {
    name: "Larger",
    does: "Everything larger",
    keys: &[
        Shortcut::key("+").with_ctrl(),
        Shortcut::key("=").with_ctrl(),
        Shortcut::key("+").with_ctrl().with_shift(),
    ],
    command: Command::Prefer(PreferenceChange::StepScale(1)),
};

/// Everything smaller.
pub static SMALLER: UiCommand = UiCommand {
    name: "Smaller",
    does: "Everything smaller",
    keys: &[Shortcut::key("-").with_ctrl()],
    command: Command::Prefer(PreferenceChange::StepScale(-1)),
};

/// Everything as large as it comes.
pub static USUAL_SIZE: UiCommand = UiCommand {
    name: "Usual size",
    does: "Everything as large as it comes",
    keys: &[Shortcut::key("0").with_ctrl()],
    command: Command::Prefer(PreferenceChange::Scale(100)),
};

/// This table.
pub static HELP: UiCommand = UiCommand {
    name: "Keys and gestures",
    does: "This table",
    keys: &[Shortcut::key("?"), Shortcut::key("F1")],
    command: Command::Show(Some(Dialog::Help)),
};

/// At a suggestion: label it with its first likely class.
pub static ANSWER: UiCommand = UiCommand {
    name: "Label as likely",
    does: "At a suggestion: label it with its first likely class",
    keys: &[Shortcut::key("Enter")],
    command: Command::AnswerLikely(0),
};

/// At a suggestion: label it with its second likely class.
pub static ANSWER_SECOND: UiCommand = UiCommand {
    name: "Label as second",
    does: "At a suggestion: label it with its second likely class",
    keys: &[Shortcut::key("Enter").with_shift()],
    command: Command::AnswerLikely(1),
};

/// At a suggestion: type the name of its class.
pub static ANSWER_BY_NAME: UiCommand = UiCommand {
    name: "Name it",
    does: "At a suggestion: type the name of its class",
    keys: &[Shortcut::key("C")],
    command: Command::FindClass(ClassUse::Answer),
};

/// At a suggestion: skip it.
pub static SKIP: UiCommand = UiCommand {
    name: "Skip",
    does: "At a suggestion: skip it",
    keys: &[Shortcut::key("X"), Shortcut::key("Delete")],
    command: Command::SkipSuggestion,
};

/// Leave the suggestions.
pub static LEAVE: UiCommand = UiCommand {
    name: "Leave",
    does: "Leave the suggestions",
    keys: &[Shortcut::key("Escape")],
    command: Command::LeaveSuggestions,
};

/// Every key and gesture, in the order of the help window.
pub static TABLE: &[Line] = &[
    Gesture(
        "Left click, drag",
        "Label a point, or scribble, with the current class",
    ),
    Gesture(
        "Shift+click",
        "Label along a straight line from where the last one ended",
    ),
    Gesture("Right drag", "Erase"),
    Key(&BRUSH),
    Key(&POLYLINE),
    Key(&POLYGON),
    Gesture("Enter or double-click", "End the polyline or polygon"),
    Gesture("Backspace, Escape", "Take its last corner back, drop it"),
    Key(&ERASE),
    Key(&SELECT),
    Key(&DELETE),
    Gesture(
        "1 to 9, 0",
        "Choose a class, or change that of the stroke selected with S; 0 is void",
    ),
    Key(&FIND_CLASS),
    Gesture(
        "Alt+Up and Alt+Down",
        "Move the class that has the focus in the list",
    ),
    Key(&SMALLER_BRUSH),
    Key(&LARGER_BRUSH),
    Gesture("Ctrl+wheel", "Smaller and larger brush"),
    Gesture("Wheel", "Zoom at the cursor"),
    Gesture("Space+drag, middle drag", "Move the image"),
    Key(&FIT),
    Key(&SPACE),
    Key(&PREVIOUS_FRAME),
    Key(&NEXT_FRAME),
    Key(&NEXT_SUGGESTION),
    Key(&PREVIOUS_SUGGESTION),
    Key(&OTHER_SIDE),
    Gesture(
        "Tab (hold)",
        "Hide the overlay while the pointer is over the frame",
    ),
    Key(&NEXT_LAYER),
    Key(&COMPARE),
    Key(&UNDO),
    Key(&REDO),
    Key(&OPEN),
    Key(&SAVE),
    Key(&EXPORT),
    Key(&PAUSE),
    Key(&SETTINGS),
    Key(&LARGER),
    Key(&SMALLER),
    Key(&USUAL_SIZE),
    Key(&HELP),
];

/// The keys that answer a suggestion; while one is at hand they come before those of [`TABLE`], and nobody can move them.
pub static AT_A_SUGGESTION: &[Line] = &[
    Key(&ANSWER),
    Key(&ANSWER_SECOND),
    Gesture(
        "1 to 9, 0",
        "At a suggestion: label it with a class of the list; 0 is void",
    ),
    Key(&ANSWER_BY_NAME),
    Key(&SKIP),
    Key(&LEAVE),
];
