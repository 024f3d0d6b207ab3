//! What the window says, in English: one file for each part of the window.

pub mod hint;
