//! The window by accessible names, with a stand-in for the worker.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "a test ends where it fails"
)]

mod classes;
mod comparison;
mod files;
mod hover;
#[path = "../../src/tests.rs"]
mod images;
mod labelling;
mod layers;
mod names;
mod objects;
mod opening;
mod order;
mod pictures;
mod preferences;
mod progress;
mod projects;
mod space;
mod stand;
mod strokes;
mod suggestions;
