//! The window of Inplace: canvas, panels and input.
//!
//! Data flows one way: panels read [`state::AppState`] and push [`action::Action`]s; the [`app::App`]
//! carries them out, sends commands to the session's worker, records edits in the project's journal, and
//! drains what both tell. The UI thread never waits for either, never touches a file and never a tensor.
#![forbid(unsafe_code)]

pub mod action;
pub mod app;
mod apply;
pub mod background;
pub mod canvas;
pub mod class_view;
pub mod dialogs;
pub mod document;
pub mod english;
pub mod exporting;
pub mod frames;
pub mod guidance;
pub mod hints;
pub mod jobs;
pub mod keeper;
pub mod keymap;
pub mod keys;
pub mod opening;
pub mod overview;
pub mod panels;
pub mod pictures;
pub mod preferences;
pub mod progress;
pub mod readiness;
mod run;
pub mod session_link;
pub mod shown;
pub mod state;
pub mod stats;
pub mod surroundings;
#[cfg(test)]
mod testing;
pub mod theme;
pub mod thumbnails;
pub mod toasts;
pub mod trace;
pub mod view3d;
pub mod widgets;
pub mod workspace;

pub use opening::Target;
pub use run::{UiError, UiOptions, run};
