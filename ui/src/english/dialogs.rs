//! The dialogs, and the words that their buttons share.

use inplace_core::labels::Trust;

use crate::dialogs::Purpose;

/// Asks the system for a path.
pub const BROWSE: &str = "Browse...";
/// Writes the file.
pub const SAVE: &str = "Save";
/// Closes a dialog or a note that asks nothing.
pub const CLOSE: &str = "Close";
/// Closes a dialog without doing what it is for; stops what runs.
pub const CANCEL: &str = "Cancel";
/// In an empty path field.
pub const PATH_HINT: &str = "/path/to/...";

/// Title: something to open.
pub const OPEN: &str = "Open";
/// What can be opened.
pub const OPEN_EXPLAINED: &str = "The folder of a scene, or a project file (.inplace).";
/// Asks the system for the folder of a scene.
pub const BROWSE_FOLDERS: &str = "Browse folders...";
/// Asks the system for a project.
pub const BROWSE_PROJECTS: &str = "Browse projects...";
/// Opens the demo scene.
pub const DEMO: &str = "Demo scene";

/// Title: a project file to write.
pub const SAVE_AS: &str = "Save project as";
/// What is in a project file.
pub const SAVE_AS_EXPLAINED: &str =
    "Everything is kept in one file: classes, strokes, their history, and the result so far.";
/// Name of the path field.
pub const PROJECT_FILE: &str = "Project file";

/// Title and verb: a folder to export into.
pub const EXPORT: &str = "Export";
/// Name of the path field.
pub const EXPORT_FOLDER: &str = "Export folder";

/// Title: label images to import.
pub const IMPORT: &str = "Import labels";
/// What they are good for.
pub const IMPORT_EXPLAINED: &str = "A folder of files named like the frames, such as a network's predictions or an earlier \
                                    export: PNGs with class ids or colours, or NPYs or NPZs with probabilities. \
                                    Pixels that may be wrong are outvoted where many disagree.";
/// Name of the path field.
pub const IMPORT_FOLDER: &str = "Folder of label images";
/// How far they can be believed.
pub const TRUST: &str = "Trust";
/// Name of its slider.
pub const TRUST_NAME: &str = "Trust in the imported pixels";

/// What a trust means.
pub fn trust(trust: Trust) -> &'static str {
    match trust.value() {
        1.0 => "Every labelled pixel is right, as your strokes are.",
        above if above > 0.6 => "Mostly right: your strokes correct them close by.",
        about if about >= 0.4 => {
            "They may be wrong: your strokes correct them on what they are connected with."
        }
        below if below > 0.0 => "Often wrong: your strokes correct them from afar, too.",
        _ => "They only fill in what none of your strokes leads to.",
    }
}

/// Reads them.
pub const IMPORT_NOW: &str = "Import";

/// Title: the class of the click that came before any class.
pub const FIRST_CLASS: &str = "Name the first class";
/// What is asked.
pub const FIRST_CLASS_EXPLAINED: &str =
    "What is it that you clicked on? Your click is kept and gets this class.";
/// Name of the field.
pub const CLASS_NAME: &str = "Class name";
/// In the empty field.
pub const CLASS_NAME_HINT: &str = "for example: wall";

/// Title: the table of keys.
pub const KEYS: &str = "Keys and gestures";

/// Title of the system's dialog.
pub fn system_title(purpose: Purpose) -> &'static str {
    match purpose {
        Purpose::Scene => "Open the folder of a scene",
        Purpose::Project => "Open a project",
        Purpose::SaveAs => "Save the project as",
        Purpose::Export => "Export into a folder",
        Purpose::Import => "Import the label images of a folder",
        Purpose::Moved => "The folder of the scene",
        Purpose::Classes => "Read a class list",
        Purpose::SaveClasses => "Save the classes as a file",
    }
}

/// Files that the system's dialog lists: projects.
pub const PROJECT_FILES: &str = "Inplace project";
/// Files that the system's dialog lists: class lists.
pub const CLASS_LISTS: &str = "Class list";
