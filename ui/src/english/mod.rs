//! What the window says, in English: one file for each part of the window.

pub mod classes;
pub mod frames;
pub mod guidance;
pub mod hint;
pub mod layers;
pub mod layout;
pub mod opening;
pub mod preferences;
pub mod progress;
pub mod settings;
pub mod start;
pub mod strokes;
pub mod toasts;
pub mod tools;
pub mod view3d;
pub mod work;
