//! The window of Inplace: canvas, 3D view, panels, dialogs and input.
//!
//! Data flows one way: views read the [`Model`](inplace_model::Model) and push [`Command`](inplace_model::Command)s;
//! [`app::App`] hands these to the model and carries out its effects: it talks to the session's worker and the project's
//! journal, starts threads, and draws. The UI thread never waits for any of them, never touches a file and never a tensor.
#![forbid(unsafe_code)]

pub mod app;
mod background;
pub mod canvas;
mod dialogs;
mod gpu;
mod input_order;
mod jobs;
mod keys;
mod numbers;
mod panels;
mod pictures;
mod run;
mod stats;
#[cfg(test)]
mod tests;
mod theme;
mod thumbnails;
mod trace;
mod view3d;
mod widgets;

pub use app::UiOptions;
pub use inplace_model::model::Start;
pub use inplace_model::opening::Target;
pub use run::{UiError, run};
