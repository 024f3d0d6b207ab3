//! A screen of the test's own: Xvfb, used through xdotool.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

use image::RgbImage;
use x11rb::connection::Connection;
use x11rb::protocol::xproto::{ClientMessageEvent, ConnectionExt, EventMask, ImageFormat, Window};
use x11rb::rust_connection::RustConnection;

/// Size in pixels.
const WIDTH: u16 = 1280;
const HEIGHT: u16 = 800;
/// How often a display is started before it is given up.
const STARTS: usize = 5;

/// A display with nothing on it: no window manager, so a window has the keyboard only when it is given.
#[derive(Debug)]
pub struct Screen {
    server: Child,
    display: String,
}

impl Screen {
    /// Starts a display of 1280x800 pixels.
    ///
    /// # Errors
    /// The word for what is missing here.
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
        // A server that resets itself after its first client refuses others meanwhile.
        let options = format!("-noreset -displayfd 1 -screen 0 {WIDTH}x{HEIGHT}x24 -nolisten tcp");
        let mut server = Command::new("Xvfb")
            .args(options.split(' '))
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

    /// A connection to the display, and its root window.
    fn connect(&self) -> (RustConnection, Window) {
        let connected = RustConnection::connect(Some(&self.display));
        let (display, number) = connected.expect("the display can be connected to");
        let root = display.setup().roots[number].root;
        (display, root)
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

    fn act(&self, arguments: &[&str]) {
        let done = self.xdotool(arguments);
        done.unwrap_or_else(|| panic!("xdotool fails: {arguments:?}"));
    }

    /// Clicks with the left button.
    pub fn click(&self, [x, y]: [u32; 2]) {
        // In steps, as a hand does.
        let click = format!("mousemove {x} {y} sleep 0.02 mousedown 1 sleep 0.02 mouseup 1");
        self.act(&click.split(' ').collect::<Vec<_>>());
    }

    /// Types a text.
    pub fn type_text(&self, text: &str) {
        self.act(&["type", "--delay", "25", "--", text]);
    }

    /// Presses a key, such as `ctrl+e`.
    pub fn key(&self, key: &str) {
        self.act(&["key", "--delay", "25", key]);
    }

    /// Asks a window to close, as a window manager does when its cross is clicked.
    pub fn close_window(&self, id: &str) {
        let window: u32 = id.parse().expect("a window has a number");
        let (display, _) = self.connect();
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
    pub fn picture(&self) -> RgbImage {
        let (display, root) = self.connect();
        let image = display
            .get_image(ImageFormat::Z_PIXMAP, root, 0, 0, WIDTH, HEIGHT, u32::MAX)
            .expect("the display takes requests");
        let image = image.reply().expect("the display answers");
        // Blue, green, red and nothing.
        let pixels = image.data.chunks_exact(4);
        let rgb = pixels.flat_map(|pixel| [pixel[2], pixel[1], pixel[0]]).collect();
        RgbImage::from_raw(WIDTH.into(), HEIGHT.into(), rgb).expect("four bytes a pixel")
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}
