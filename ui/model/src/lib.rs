//! What the window of Inplace knows and does, without the window itself.
//!
//! [`Model`] is the whole state. Views read it and return [`Command`]s; [`Model::update`] is the one place where state
//! changes. What has to be done outside (ask the worker, run a job, close the window) comes back as [`Effect`]s; the
//! journal of the project file alone is told from here. Nothing here waits, and nothing here draws.
#![forbid(unsafe_code)]

pub mod class_view;
pub mod command;
pub mod comparison;
pub mod dialogs;
pub mod document;
pub mod effect;
pub mod exporting;
pub mod frames;
pub mod hints;
pub mod hover;
pub mod jobs;
pub mod keymap;
pub mod layer;
pub mod messages;
pub mod model;
pub mod opening;
pub mod overview;
pub mod palette;
pub mod preferences;
pub mod progress_log;
pub mod project_session;
pub mod settings;
pub mod space;
pub mod suggestions;
pub mod text;
pub mod tool;
mod update;
pub mod versioned;
pub mod view;
pub mod workspace;

pub use command::{Command, Commands};
pub use effect::Effect;
pub use model::Model;
pub use update::Input;
