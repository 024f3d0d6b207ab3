//! The menu bar.

/// Menu: opening, saving, exporting, importing.
pub const FILE: &str = "File";
/// Menu: undo and redo.
pub const EDIT: &str = "Edit";
/// Menu: layers, panels, theme.
pub const VIEW: &str = "View";
/// Menu: the keys.
pub const HELP: &str = "Help";

/// Opens by a path or the demo.
pub const OPEN: &str = "Open...";
/// Asks the system for the folder of a scene.
pub const OPEN_FOLDER: &str = "Open folder...";
/// Asks the system for a project.
pub const OPEN_PROJECT: &str = "Open project...";
/// Goes on in another file.
pub const SAVE_AS: &str = "Save as...";
/// Asks for a folder to export into.
pub const EXPORT: &str = "Export...";
/// Asks for a folder of label images.
pub const IMPORT: &str = "Import labels...";
/// Takes imported label images away.
pub const REMOVE_IMPORTED: &str = "Remove imported labels";
/// Opens the settings.
pub const SETTINGS: &str = "Settings...";
/// Back to the start page.
pub const CLOSE_SCENE: &str = "Close scene";
/// Ends the program.
pub const QUIT: &str = "Quit";

/// Takes the newest edit back.
pub const UNDO: &str = "Undo";
/// Makes it again.
pub const REDO: &str = "Redo";

/// Fits what is in the middle into the window.
pub const FIT: &str = "Fit";
/// The other one of the two.
pub const SPACE: &str = "Frame or 3D view";
/// Dark colours.
pub const DARK_THEME: &str = "Dark theme";
/// Light colours.
pub const LIGHT_THEME: &str = "Light theme";

/// What undo or redo would do: "Undo scribble wall".
pub fn history(verb: &str, edit: &str) -> String {
    format!("{verb} {edit}")
}
