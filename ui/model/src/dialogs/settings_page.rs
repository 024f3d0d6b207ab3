//! The settings, as far as keys are chosen in them.

use crate::keymap::Shortcut;

/// The settings, with the key that is being chosen.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SettingsPage {
    /// The key being chosen.
    pub choosing: Option<ChosenKey>,
}

/// A key being chosen.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ChosenKey {
    /// What it does is what this key does by default.
    pub default: Shortcut,
    /// What was pressed, where it cannot simply be taken.
    pub taken: Option<TakenKey>,
}

/// A key that does something else.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TakenKey {
    /// It cannot be chosen at all.
    Fixed(Shortcut),
    /// It does something that can do without it.
    By {
        /// What was pressed.
        pressed: Shortcut,
        /// What it does.
        does: &'static str,
        /// The default key of that.
        default: Shortcut,
    },
}
