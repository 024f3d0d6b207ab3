//! A screen of the test's own: Xvfb, looked at through its frame buffer file, used through xdotool.

use std::fs;
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use image::RgbImage;
use tempfile::TempDir;
use x11rb::connection::Connection;
use x11rb::protocol::xproto::{ClientMessageEvent, ConnectionExt, EventMask};
use x11rb::rust_connection::RustConnection;

use crate::until;

/// How often a display is started before it is given up.
const STARTS: usize = 5;

/// A display with nothing on it: no window manager, so a window has the keyboard only when it is given.
#[derive(Debug)]
pub struct Screen {
    server: Child,
    display: String,
    frame_buffer: TempDir,
}

impl Screen {
    /// Starts a display of 1280x800 pixels.
    ///
    /// # Errors
    /// The word for what is missing here.
    ///
    /// # Panics
    /// When there is no temporary folder.
    pub fn start() -> Result<Self, String> {
        // Of servers that start at the same moment, one may be told a number that another one has got.
        for _ in 0..STARTS {
            let screen = Self::serve()?;
            if RustConnection::connect(Some(&screen.display)).is_ok() {
                return Ok(screen);
            }
        }
        Err("Xvfb (nothing can connect to it)".to_owned())
    }

    fn serve() -> Result<Self, String> {
        Command::new("xdotool")
            .arg("version")
            .output()
            .map_err(|error| format!("xdotool ({error})"))?;
        let frame_buffer = tempfile::tempdir().expect("a temporary folder");
        let mut server = Command::new("Xvfb")
            .args([
                // A server that resets itself after its first client refuses others meanwhile.
                "-noreset",
                "-displayfd",
                "1",
                "-screen",
                "0",
                "1280x800x24",
                "-nolisten",
                "tcp",
            ])
            .arg("-fbdir")
            .arg(frame_buffer.path())
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .map_err(|error| format!("Xvfb ({error})"))?;
        let mut number = String::new();
        if let Some(stdout) = server.stdout.take() {
            // The server tells its number when it is ready, and nothing when it fails.
            let _ = BufReader::new(stdout).read_line(&mut number);
        }
        let screen = Self {
            server,
            display: format!(":{}", number.trim()),
            frame_buffer,
        };
        if number.trim().is_empty() {
            return Err("Xvfb (it does not start)".to_owned());
        }
        Ok(screen)
    }

    /// Name of the display.
    pub fn display(&self) -> &str {
        &self.display
    }

    /// Runs xdotool on this display; returns what it prints, or `None` when it fails.
    pub fn xdotool(&self, arguments: &[&str]) -> Option<String> {
        let output = Command::new("xdotool")
            .args(arguments)
            .env("DISPLAY", &self.display)
            .output()
            .ok()?;
        let text = String::from_utf8_lossy(&output.stdout).trim().to_owned();
        output.status.success().then_some(text)
    }

    /// Clicks with the left button.
    ///
    /// # Panics
    /// When xdotool fails.
    pub fn click(&self, [x, y]: [u32; 2]) {
        let (x, y) = (x.to_string(), y.to_string());
        self.xdotool(&["mousemove", &x, &y])
            .expect("the pointer can be moved");
        // Press and release in two steps, as a hand does.
        self.xdotool(&["mousedown", "1"])
            .expect("a button can be pressed");
        self.xdotool(&["mouseup", "1"]).expect("a button can be released");
    }

    /// Types a text.
    ///
    /// # Panics
    /// When xdotool fails.
    pub fn type_text(&self, text: &str) {
        self.xdotool(&["type", "--delay", "25", "--", text])
            .expect("text can be typed");
    }

    /// Presses a key, such as `ctrl+e`.
    ///
    /// # Panics
    /// When xdotool fails.
    pub fn key(&self, key: &str) {
        self.xdotool(&["key", "--delay", "25", key])
            .expect("a key can be pressed");
    }

    /// Asks a window to close, as a window manager does when its cross is clicked.
    ///
    /// # Panics
    /// When the display does not answer.
    pub fn close_window(&self, id: &str) {
        let window: u32 = id.parse().expect("a window has a number");
        let (display, _) =
            RustConnection::connect(Some(&self.display)).expect("the display can be connected to");
        let atom = |name: &[u8]| {
            let request = display
                .intern_atom(false, name)
                .expect("the display takes requests");
            request.reply().expect("the display answers").atom
        };
        let delete = [atom(b"WM_DELETE_WINDOW"), 0, 0, 0, 0];
        let message = ClientMessageEvent::new(32, window, atom(b"WM_PROTOCOLS"), delete);
        display
            .send_event(false, window, EventMask::NO_EVENT, message)
            .expect("the display takes requests")
            .check()
            .expect("the window is there");
        display.flush().expect("the display takes requests");
    }

    /// What is on the screen.
    ///
    /// # Panics
    /// When the server writes no picture.
    pub fn picture(&self) -> RgbImage {
        let path = self.frame_buffer.path().join("Xvfb_screen0");
        until("the screen has a picture", Duration::from_secs(20), || {
            fs::read(&path).ok().and_then(|bytes| read_xwd(&bytes))
        })
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// Reads an X window dump of 32-bit pixels: a header of big-endian words, colours of 12 bytes, rows.
fn read_xwd(bytes: &[u8]) -> Option<RgbImage> {
    let word = |index: usize| -> Option<u32> {
        let field = bytes.get(4 * index..4 * index + 4)?;
        Some(u32::from_be_bytes(field.try_into().ok()?))
    };
    let (header, width, height) = (word(0)?, word(4)?, word(5)?);
    let (little_endian, bits, row_bytes) = (word(7)? == 0, word(11)?, word(12)? as usize);
    let colors = word(19)? as usize;
    if bits != 32 {
        return None;
    }
    let pixels = bytes.get(header as usize + 12 * colors..)?;
    if pixels.len() < row_bytes * height as usize {
        return None;
    }
    Some(RgbImage::from_fn(width, height, |x, y| {
        let at = y as usize * row_bytes + 4 * x as usize;
        let [a, b, c, d] = [pixels[at], pixels[at + 1], pixels[at + 2], pixels[at + 3]];
        image::Rgb(if little_endian { [c, b, a] } else { [b, c, d] })
    }))
}
