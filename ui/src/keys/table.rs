//! Every command that has a key, with its name, what it does and its default keys; and the gestures beside them.

use inplace_core::guide::audit::Verdict;
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

const fn key(name: &'static str) -> Shortcut {
    Shortcut::key(name)
}

/// Makes a table of lines, and a static for each command in it: `STATIC "name" [keys] "what it does" => command;`.
/// A gesture is `"gesture" => "what it does";`.
macro_rules! table {
    ($(#[$about:meta])* $table:ident: $(
        $($gesture:literal => $means:literal;)*
        $command:ident $name:literal [$($key:expr),+] $does:literal => $asks:expr;
    )+) => {
        $(
            #[doc = $does]
            pub static $command: UiCommand = UiCommand {
                name: $name,
                does: $does,
                keys: &[$($key),+],
                command: $asks,
            };
        )+

        $(#[$about])*
        pub static $table: &[Line] =
            &[$($(Line::Gesture($gesture, $means),)* Line::Command(&$command)),+];
    };
}

table! {
    /// Every key and gesture, in the order of the help window.
    TABLE:
    "Left click, drag" => "Label a point, or scribble, with the current class";
    "Shift+click" => "Label along a straight line from where the last one ended";
    "Right drag" => "Erase";
    BRUSH "Brush" [key("B")] "Draw with the brush" => Command::ChooseTool(Tool::Brush);
    POLYLINE "Polyline" [key("L")] "Draw lines from corner to corner" => Command::ChooseTool(Tool::Polyline);
    POLYGON "Polygon" [key("G")] "Draw outlines that are filled" => Command::ChooseTool(Tool::Polygon);
    "Enter or double-click" => "End the polyline or polygon";
    "Backspace, Escape" => "Take its last corner back, drop it";
    ERASE "Erase" [key("E")] "Switch the left button between labelling and erasing" => Command::ToggleTool;
    SELECT "Select strokes" [key("S")] "Select strokes by clicking on them"
        => Command::ChooseTool(Tool::Select);
    DELETE "Delete stroke" [key("Delete")] "Delete the selected stroke" => Command::DeleteSelected;
    "1 to 9, 0" => "Choose a class, or change that of the stroke selected with S; 0 is void";
    FIND_CLASS "Find a class" [key("C")] "Find a class by typing part of its name, or make one"
        => Command::FindClass(ClassUse::Choose);
    NEW_OBJECT "New object" [key("O")]
        "Say with the next strokes that they are on a new object of the class, until a class is chosen"
        => Command::SayNewObject;
    "Ctrl+click, Ctrl+drag" => "Label a new object of the class with this one stroke";
    "Alt+Up and Alt+Down" => "Move the class that has the focus in the list";
    LABEL_OUTLINED "Label what is outlined" [key("R")]
        "Label what is outlined at the pointer, but for its rim, as one stroke"
        => Command::LabelOutlined;
    SMALLER_BRUSH "Smaller brush" [key("[")] "Smaller brush" => Command::StepBrush(-1);
    LARGER_BRUSH "Larger brush" [key("]")] "Larger brush" => Command::StepBrush(1);
    "Ctrl+wheel" => "Smaller and larger brush";
    "Wheel, pinch" => "Zoom at the cursor";
    "Space+drag, middle drag" => "Move the image";
    FIT "Fit" [key("F")] "Fit the image, or the scene in the 3D view, into the window" => Command::Fit;
    SPACE "Frame or 3D view" [key("V")] "Switch between the frame and the 3D view" => Command::ToggleSpace;
    PREVIOUS_FRAME "Previous frame" [key("A"), key("Left")]
        "Previous frame, of those that the filmstrip shows" => Command::StepFrame(-1);
    NEXT_FRAME "Next frame" [key("D"), key("Right")] "Next frame, of those that the filmstrip shows"
        => Command::StepFrame(1);
    MARK_CHECKED "Mark as checked" [key("M")] "Mark the frame as checked, or take the mark away"
        => Command::ToggleChecked;
    NEXT_SUGGESTION "Next" [key("N")] "Go to the next suggestion" => Command::NextSuggestion;
    PREVIOUS_SUGGESTION "Previous" [key("N").with_shift()] "Go to the suggestion before"
        => Command::PreviousSuggestion;
    OTHER_SIDE "Show the other tab" [key("T")] "Show the other tab at the right: what to label next, progress"
        => Command::SwitchSide;
    "Tab (hold)" => "Hide the overlay while the pointer is over the frame";
    NEXT_LAYER "Next layer" [key("Q")] "Next layer" => Command::CycleLayer;
    COMPARE "Compare two layers" [key("W")] "Compare two layers side by side" => Command::ToggleCompare;
    UNDO "Undo" [key("Z").with_ctrl()] "Undo, also on other frames" => Command::Undo;
    REDO "Redo" [key("Z").with_ctrl().with_shift(), key("Y").with_ctrl()] "Redo, also on other frames"
        => Command::Redo;
    OPEN "Open..." [key("O").with_ctrl()] "Open a scene or a project" => Command::Show(Some(Dialog::open()));
    SAVE "Save" [key("S").with_ctrl()] "Save" => Command::Save;
    EXPORT "Export..." [key("E").with_ctrl()] "Export" => Command::Show(Some(Dialog::export()));
    PAUSE "Pause training" [key("P")] "Pause or resume training" => Command::TogglePause;
    SETTINGS "Settings..." [key(",").with_ctrl()] "Settings" => Command::Show(Some(Dialog::Settings(None)));
    LARGER "Larger" [key("+").with_ctrl(), key("=").with_ctrl(), key("+").with_ctrl().with_shift()]
        "Everything larger" => Command::Prefer(PreferenceChange::StepScale(1));
    SMALLER "Smaller" [key("-").with_ctrl()] "Everything smaller"
        => Command::Prefer(PreferenceChange::StepScale(-1));
    USUAL_SIZE "Usual size" [key("0").with_ctrl()] "Everything as large as it comes"
        => Command::Prefer(PreferenceChange::Scale(100));
    HELP "Keys and gestures" [key("?"), key("F1")] "This table" => Command::Show(Some(Dialog::Help));
}

table! {
    /// The keys that answer a suggestion; while one is at hand they come before those of [`TABLE`], and nobody can move
    /// them.
    AT_A_SUGGESTION:
    ANSWER "Label as likely" [key("Enter")] "At a suggestion: label it with its first likely class, and the object that is named"
        => Command::AnswerLikely(0);
    ANSWER_SECOND "Label as second" [key("Enter").with_shift()]
        "At a suggestion: label it with its second likely class" => Command::AnswerLikely(1);
    ANSWER_NEW "New object" [key("O")] "At a suggestion: label it as a new object of its first likely class"
        => Command::AnswerNew;
    "1 to 9, 0" => "At a suggestion: label it with a class of the list; 0 is void";
    ANSWER_BY_NAME "Name it" [key("C")] "At a suggestion: type the name of its class"
        => Command::FindClass(ClassUse::Answer);
    SKIP "Skip" [key("X"), key("Delete")] "At a suggestion: skip it" => Command::SkipSuggestion;
    LEAVE "Leave" [key("Escape")] "Leave the suggestions" => Command::LeaveSuggestions;
}

table! {
    /// The keys that judge a place of an audit; while one is at hand they come before those of [`TABLE`], and nobody can
    /// move them.
    AT_A_PLACE:
    RIGHT "Right" [key("Y"), key("Enter")] "At a place of an audit: the label is right" => Command::Judge(Verdict::Right);
    WRONG "Wrong" [key("N")] "At a place of an audit: the label is wrong" => Command::Judge(Verdict::Wrong);
    CANNOT_TELL "Cannot tell" [key("X"), key("Delete")] "At a place of an audit: it cannot be told"
        => Command::Judge(Verdict::Skipped);
    LEAVE_AUDIT "Leave" [key("Escape")] "Leave the audit" => Command::LeaveAudit;
}
