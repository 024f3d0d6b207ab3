//! What the whole-program tests share: the program as a process, a small capture, a screen of their own, what holds of parsers.
#![forbid(unsafe_code)]
#![allow(clippy::expect_used, reason = "a test ends where it fails, with the reason")]

mod capture;
mod disk;
mod hands;
mod parsers;
mod process;
mod screen;
mod trace;
mod window;

pub use capture::{Small, class_ids, miou_with_clicks};
pub use disk::{
    OnDisk, contents, contents_of, files_below, info, json, label, open, projects_below, propagated,
    strokes_of, succeed,
};
pub use hands::Hands;
pub use parsers::Fuzzed;
pub use process::{
    FOLDER, Outcome, Running, behind, child, folder_of_child, inplace, inplace_lab, number, one_line,
    program, until,
};
pub use screen::Screen;
pub use trace::{TRACE, Trace};
pub use window::{PATIENCE, Window, skip};
