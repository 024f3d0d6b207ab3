//! The settings dialog.

use crate::keymap::Shortcut;

/// Its title.
pub const TITLE: &str = "Settings";
/// Section: looks.
pub const APPEARANCE: &str = "Appearance";
/// Colours of the window.
pub const THEME: &str = "Theme";
/// Dark colours.
pub const DARK: &str = "Dark";
/// Light colours.
pub const LIGHT: &str = "Light";
/// Whichever the system has.
pub const AS_THE_SYSTEM: &str = "As the system";
/// Size of everything.
pub const SCALE: &str = "Scale";
/// How much the layer covers.
pub const OPACITY: &str = "Overlay opacity";
/// Section: training.
pub const TRAINING: &str = "Training";
/// Threads of the worker.
pub const THREADS: &str = "Threads";
/// When that holds.
pub const THREADS_EXPLANATION: &str =
    "Used from the next scene that you open on. Fewer leave more of the computer to other programs.";
/// Section: hints.
pub const HINTS: &str = "Hints";
/// Shows all of them again.
pub const RESET_HINTS: &str = "Show all hints again";
/// Section: keys.
pub const KEYS: &str = "Keys";
/// How keys are changed.
pub const KEYS_EXPLANATION: &str =
    "Press a button, then the new key; Escape leaves it as it is. The digits always choose classes.";
/// On the button of the key that is waited for.
pub const PRESS_A_KEY: &str = "Press a key...";
/// On the button of an action without a key.
pub const NO_KEY: &str = "no key";
/// Gives one key back.
pub const RESET: &str = "Reset";
/// Gives all keys back.
pub const RESET_KEYS: &str = "Reset all keys";
/// Takes a key from what has it.
pub const USE_IT_HERE: &str = "Use it here";
/// Tries again.
pub const ANOTHER_KEY: &str = "Another key";
/// Changes nothing.
pub const LEAVE_IT: &str = "Leave it";

/// A scale.
pub fn percent(percent: u16) -> String {
    format!("{percent}%")
}

/// The keys for the scale: larger, smaller, as it comes.
pub fn scale_keys([larger, smaller, usual]: &[String; 3]) -> String {
    format!("{larger}  {smaller}  {usual}")
}

/// As many threads as leave a core to the window.
pub fn automatic(threads: usize) -> String {
    format!("Automatic ({threads})")
}

/// How many hints are not shown any more.
pub fn hints_seen(seen: usize, all: usize) -> String {
    format!("{seen} of {all} seen")
}

/// Name of the button of a key; `default` tells those of one action apart.
pub fn key_name(does: &str, present: Option<&str>, default: Shortcut) -> String {
    match present {
        Some(present) => format!("{does}: {present}"),
        None => format!("{does}: {NO_KEY}, by default {default}"),
    }
}

/// Name of the button that gives a key back.
pub fn reset_name(does: &str, default: Shortcut) -> String {
    format!("Reset {does} to {default}")
}

/// What that button does.
pub fn reset_tip(default: Shortcut) -> String {
    format!("Back to {default}")
}

/// A key that cannot be chosen.
pub fn fixed(pressed: Shortcut) -> String {
    format!("{pressed} cannot be given away: the window needs it.")
}

/// A key that does something else.
pub fn taken(pressed: Shortcut, does: &str) -> String {
    format!("{pressed} is taken: {does}.")
}
