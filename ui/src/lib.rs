//! The window of Inplace: canvas, panels and input.
//!
//! Data flows one way: views read the [`Model`](inplace_model::Model) and push [`Command`](inplace_model::Command)s;
//! [`app::App`] hands these to the model and carries out its effects: it talks to the session's worker and the project's
//! journal, starts threads, and draws. The UI thread never waits for any of them, never touches a file and never a tensor.
#![forbid(unsafe_code)]

pub mod app;
pub mod background;
pub mod canvas;
pub mod dialogs;
mod gpu;
mod input_order;
pub mod jobs;
pub mod keys;
mod numbers;
pub mod panels;
pub mod pictures;
mod run;
pub mod stats;
#[cfg(test)]
mod tests;
pub mod theme;
pub mod thumbnails;
pub mod trace;
pub mod view3d;
pub mod widgets;

pub use app::UiOptions;
pub use inplace_model::opening::Target;
pub use run::{UiError, run};
