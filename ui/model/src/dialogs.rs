//! The dialogs, as far as they are filled in.

mod add_classes;
mod export_choice;
mod finder;
mod moved;
mod settings_page;

use std::path::Path;

use inplace_core::labels::{Stroke, Trust};

pub use add_classes::{AddClasses, ClassChoice, ClassSource};
pub use export_choice::ExportChoice;
pub use finder::{ClassFinder, ClassUse, FoundClass};
pub use moved::MovedScene;
pub use settings_page::{ChosenKey, SettingsPage, TakenKey};

/// What a path is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// The folder of a capture, to open.
    Scene,
    /// A project file, to open.
    Project,
    /// A project file, to write.
    SaveAs,
    /// A folder, to export into.
    Export,
    /// A folder of label images, to import.
    Import,
    /// The folder that a project's scene has moved into.
    Moved,
    /// A class list, to read.
    Classes,
    /// A class list, to write.
    SaveClasses,
}

/// The dialog shown.
#[derive(Clone, Debug, PartialEq)]
pub enum Dialog {
    /// Asks for a scene or project to open.
    Open {
        /// The path typed so far.
        path: String,
    },
    /// Asks for a project file to write.
    SaveAs {
        /// The path typed so far.
        path: String,
    },
    /// Asks what to export, and for a folder to export into.
    Export(ExportChoice),
    /// Asks for a folder of label images.
    Import {
        /// The path typed so far.
        path: String,
        /// How far its pixels can be believed.
        trust: Trust,
    },
    /// Asks for the name of the first class; the stroke that waited for it is then added.
    FirstClass {
        /// The name typed so far.
        name: String,
        /// The stroke, without its class.
        waiting: Stroke,
    },
    /// Adds classes of a data set or a file.
    AddClasses(Box<AddClasses>),
    /// Asks for a file to write the classes to.
    SaveClasses {
        /// The path typed so far.
        path: String,
    },
    /// Finds a class by part of its name.
    FindClass(Box<ClassFinder>),
    /// Shows the keys.
    Help,
    /// Shows what the person can choose once for all scenes.
    Settings(SettingsPage),
    /// Asks where the scene of a project is now.
    Moved(MovedScene),
}

impl Dialog {
    /// Asks for something to open.
    pub const fn open() -> Self {
        Self::Open { path: String::new() }
    }

    /// Asks what to export; the path, and what was chosen last, are filled in when it is shown.
    pub const fn export() -> Self {
        Self::Export(ExportChoice::new())
    }

    /// Asks for a folder of label images.
    pub const fn import() -> Self {
        Self::Import {
            path: String::new(),
            trust: Trust::VOTES,
        }
    }

    /// Shows the settings.
    pub const fn settings() -> Self {
        Self::Settings(SettingsPage { choosing: None })
    }

    /// Puts a path that the system's dialog gave into the path field.
    pub fn take_path(&mut self, picked: &Path) {
        match self {
            Self::Open { path }
            | Self::SaveAs { path }
            | Self::Export(ExportChoice { path, .. })
            | Self::Import { path, .. }
            | Self::SaveClasses { path }
            | Self::Moved(MovedScene { path, .. }) => {
                *path = picked.display().to_string();
            }
            Self::AddClasses(dialog) => dialog.path = picked.display().to_string(),
            Self::FirstClass { .. } | Self::FindClass(_) | Self::Help | Self::Settings(_) => {}
        }
    }
}
