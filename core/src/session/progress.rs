//! A progress line on stderr, for people only.

use std::io::{IsTerminal, Write};

/// Prints progress when stderr is a terminal, and nothing otherwise; what was printed is gone when this is.
#[derive(Debug)]
pub struct Progress {
    shown: bool,
    terminal: bool,
}

impl Default for Progress {
    fn default() -> Self {
        Self {
            shown: false,
            terminal: std::io::stderr().is_terminal(),
        }
    }
}

impl Progress {
    /// Replaces the line.
    pub fn show(&mut self, line: &str) {
        if self.terminal {
            // A terminal that went away is no reason to stop working.
            let _ = write!(std::io::stderr(), "\r\x1b[K{line}");
            self.shown = true;
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if self.shown {
            let _ = write!(std::io::stderr(), "\r\x1b[K");
        }
    }
}
