//! A keyboard and a mouse on a test's screen, faster than a program that is called for each key.

use std::io::Write;
use std::process::{Child, ChildStdin, Command, Stdio};

use crate::Screen;

/// One xdotool that does what it is told, line by line.
#[derive(Debug)]
pub struct Hands {
    xdotool: Child,
    lines: Option<ChildStdin>,
}

impl Hands {
    /// Hands on a screen.
    pub fn new(screen: &Screen) -> Self {
        let mut xdotool = Command::new("xdotool");
        xdotool.arg("-").env("DISPLAY", screen.display());
        let mut xdotool = xdotool.stdin(Stdio::piped()).spawn().expect("xdotool starts");
        let lines = xdotool.stdin.take();
        Self { xdotool, lines }
    }

    /// Does these commands of xdotool, such as `mousemove 3 4 mousedown 1`, one after the other.
    pub fn act(&self, commands: &str) {
        let mut lines = self.lines.as_ref().expect("they are taken when it is dropped");
        writeln!(lines, "{commands}").expect("xdotool takes commands");
    }

    /// Presses and releases a key, such as `Return` or `ctrl+z`.
    pub fn press(&self, key: &str) {
        self.act(&format!("key --delay 0 {key}"));
    }
}

impl Drop for Hands {
    fn drop(&mut self) {
        // It ends where the lines end; it may have ended by itself.
        drop(self.lines.take());
        let _ = self.xdotool.wait();
    }
}
