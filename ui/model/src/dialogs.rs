//! The dialogs, as far as they are filled in.

mod add_classes;
mod finder;

use std::path::{Path, PathBuf};

use inplace_core::export::{Format, IdMap, Options};
use inplace_core::labels::{ClassPalette, Stroke, Trust};

pub use add_classes::{AddClasses, ClassChoice, ClassSource};
pub use finder::{ClassFinder, ClassUse, FoundClass};

use crate::keymap::Shortcut;

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
    /// A project file, to compare with.
    Compare,
    /// The folder that a project's scene has moved into.
    Moved,
    /// A class list, to read.
    Classes,
    /// A class list, to write.
    SaveClasses,
    /// A pretrained network, to use.
    Features,
}

/// The dialog shown.
#[derive(Clone, Debug, PartialEq)]
pub enum Dialog {
    /// Asks for a scene or project to open, with the path typed so far.
    Open(String),
    /// Asks for a project file to write, with the path typed so far.
    SaveAs(String),
    /// Asks whether the project takes the place of this file, which is there already.
    ReplaceFile(PathBuf),
    /// Asks what to export, and for a folder to export into.
    Export(ExportChoice),
    /// Asks for a folder of label images.
    Import {
        /// The path typed so far.
        path: String,
        /// How far its pixels can be believed.
        trust: Trust,
    },
    /// Asks for another project of the scene to compare with, with the path typed so far.
    Compare(String),
    /// Asks for the name of the first class; the stroke that waited for it is then added.
    FirstClass {
        /// The name typed so far.
        name: String,
        /// The stroke, without its class.
        waiting: Stroke,
        /// Whether it is on a new object.
        new_object: bool,
    },
    /// Adds classes of a data set or a file.
    AddClasses(Box<AddClasses>),
    /// Asks for a file to write the classes to, with the path typed so far.
    SaveClasses(String),
    /// Finds a class by part of its name.
    FindClass(Box<ClassFinder>),
    /// Shows the keys.
    Help,
    /// Shows what the person can choose once for all scenes, with the key that is being chosen.
    Settings(Option<ChosenKey>),
    /// Asks where the scene of a project is now.
    Moved(MovedScene),
}

impl Dialog {
    /// Asks for something to open.
    pub const fn open() -> Self {
        Self::Open(String::new())
    }

    /// Asks what to export; the path, and what was chosen last, are filled in when it is shown.
    pub const fn export() -> Self {
        Self::Export(ExportChoice {
            path: String::new(),
            format: Format::Png,
            ids: None,
            least_percent: None,
        })
    }

    /// What it asks a path for, if it has a field for one; to open something, there are two ways.
    pub const fn purpose(&self) -> Option<Purpose> {
        match self {
            Self::SaveAs(_) => Some(Purpose::SaveAs),
            Self::Export(_) => Some(Purpose::Export),
            Self::Import { .. } => Some(Purpose::Import),
            Self::Compare(_) => Some(Purpose::Compare),
            Self::AddClasses(_) => Some(Purpose::Classes),
            Self::SaveClasses(_) => Some(Purpose::SaveClasses),
            Self::Moved(_) => Some(Purpose::Moved),
            _ => None,
        }
    }

    /// Asks for a folder of label images.
    pub const fn import() -> Self {
        Self::Import {
            path: String::new(),
            trust: Trust::VOTES,
        }
    }
}

/// What is exported, and where to, as chosen so far.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExportChoice {
    /// The folder typed so far.
    pub path: String,
    /// The kind of data set.
    pub format: Format,
    /// The data set whose class numbers are taken, by name.
    pub ids: Option<&'static ClassPalette>,
    /// Pixels whose class is less probable become void, per cent.
    pub least_percent: Option<u8>,
}

/// The path that a person typed, who may write `~` for their home folder.
pub fn typed_path(text: &str) -> PathBuf {
    let path = Path::new(text.trim());
    let home = path.strip_prefix("~").ok().zip(std::env::home_dir());
    home.map_or_else(|| path.to_path_buf(), |(rest, home)| home.join(rest))
}

impl ExportChoice {
    /// The folder.
    pub fn folder(&self) -> PathBuf {
        typed_path(&self.path)
    }

    /// What is exported of each map.
    pub fn options(&self) -> Options {
        Options {
            least_probability: self.least_percent.map(|percent| f32::from(percent) / 100.0),
            ids: self.ids.map(IdMap::of),
        }
    }
}

/// The question where the scene of a project is now, with the answer so far.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MovedScene {
    /// The project file.
    pub project: PathBuf,
    /// Where it is not.
    pub missing: PathBuf,
    /// The folder typed so far.
    pub path: String,
    /// What was wrong with the last answer.
    pub problem: Option<String>,
}

impl MovedScene {
    /// The scene is not at `missing`; `problem` says what was wrong with that as an answer.
    pub fn new(project: PathBuf, missing: PathBuf, problem: Option<String>) -> Self {
        let path = match &problem {
            Some(_) => missing.display().to_string(),
            None => String::new(),
        };
        Self {
            project,
            missing,
            path,
            problem,
        }
    }
}

/// A key being chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChosenKey {
    /// What it does is what this key does by default.
    pub default: Shortcut,
    /// What was pressed, where it cannot simply be taken: the window needs it, or it does something else.
    pub pressed: Option<Shortcut>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_typed_tilde_stands_for_the_home_folder() {
        let home = std::env::home_dir().unwrap();
        let typed = [
            (" ~/labels ", home.join("labels")),
            ("~", home),
            ("a/~/b", PathBuf::from("a/~/b")),
            ("~other", PathBuf::from("~other")),
        ];
        for (text, path) in typed {
            assert_eq!(typed_path(text), path, "{text}");
        }
    }
}
