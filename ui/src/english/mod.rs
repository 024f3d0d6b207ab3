//! What the window says, in English: one file for each part of the window, and no word that a person reads elsewhere.

pub mod classes;
pub mod dialogs;
pub mod export;
pub mod frames;
pub mod guidance;
pub mod hint;
pub mod keys;
pub mod layers;
pub mod layout;
pub mod measurements;
pub mod menu;
pub mod opening;
pub mod preferences;
pub mod progress;
pub mod saving;
pub mod settings;
pub mod start;
pub mod status;
pub mod strokes;
pub mod toasts;
pub mod tools;
pub mod view3d;
pub mod work;

#[cfg(test)]
mod elsewhere;

/// Name of the program.
pub const PROGRAM: &str = "Inplace";

/// A number of things: "1 stroke", "2 strokes".
fn counted(count: usize, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}
