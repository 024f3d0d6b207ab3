//! The program's window on a screen of its own.

use std::fs;
use std::path::Path;
use std::time::Duration;

use tempfile::TempDir;

use crate::process::eventually;
use crate::{Running, Screen, inplace, until};

/// Machines that render in software, beside other work, are slow.
pub const PATIENCE: Duration = Duration::from_secs(60);
/// Where set, tests of the window must not be skipped.
const REQUIRED: &str = "INPLACE_REQUIRE_DISPLAY_TEST";

/// The program's window with a home of its own.
#[derive(Debug)]
pub struct Window {
    /// The program.
    pub running: Running,
    /// What it is shown on.
    pub screen: Screen,
    /// The window's number.
    pub id: String,
    /// Where its files are; the scene is in `room`.
    pub home: TempDir,
}

/// Says what is missing for a test of the window, where such a test may be skipped.
pub fn skip(missing: &str) {
    assert!(
        std::env::var_os(REQUIRED).is_none(),
        "the window cannot be tested: {missing} is missing"
    );
    println!("skipped: {missing} is missing here");
}

impl Window {
    /// Opens a scene that `write` makes in the folder that it is given, with these arguments of the program, where
    /// paths are relative to the home; waits until the window has the keyboard.
    ///
    /// # Errors
    /// The word for what is missing here.
    pub fn open(write: impl FnOnce(&Path), arguments: &[&str]) -> Result<Self, String> {
        let screen = Screen::start()?;
        let home = tempfile::Builder::new().prefix("inplace").tempdir();
        let home = home.expect("a temporary folder");
        let scene = home.path().join("room");
        write(&scene);
        let mut command = inplace();
        command.arg(&scene).args(arguments).current_dir(home.path());
        command.env("DISPLAY", screen.display());
        for (variable, folder) in [
            ("XDG_DATA_HOME", "data"),
            ("XDG_CONFIG_HOME", "config"),
            ("XDG_CACHE_HOME", "cache"),
            ("XDG_RUNTIME_DIR", "run"),
            ("HOME", "home"),
        ] {
            let folder = home.path().join(folder);
            fs::create_dir(&folder).expect("the home is empty");
            command.env(variable, folder);
        }
        let mut running = Running::start(&mut command);
        let id = until("there is a window", PATIENCE, || {
            let found = screen.xdotool(&["search", "--onlyvisible", "--name", "room.* - Inplace"]);
            if let Some(id) = found.as_deref().and_then(|ids| ids.lines().next()) {
                return Some(Ok(id.to_owned()));
            }
            running.ended()?;
            let said = running.stderr();
            assert!(said.contains("nothing here can draw a window"), "{said}");
            Some(Err("a Vulkan or OpenGL driver".to_owned()))
        })?;
        let window = Self {
            running,
            screen,
            id,
            home,
        };
        window.until("the window has the keyboard", Self::focus);
        Ok(window)
    }

    /// Gives the window the keyboard; `None` when it does not have it yet.
    pub fn focus(&self) -> Option<()> {
        self.screen.xdotool(&["windowfocus", &self.id])?;
        let focused = self.screen.xdotool(&["getwindowfocus"])?;
        (focused == self.id).then_some(())
    }

    /// Asks again and again, for as long as [`PATIENCE`]; without an answer it keeps a picture of the screen.
    #[track_caller]
    pub fn until<T>(&self, what: &str, mut answer: impl FnMut(&Self) -> Option<T>) -> T {
        let Some(answer) = eventually(PATIENCE, || answer(self)) else {
            let picture = std::env::temp_dir().join("inplace-window-test.png");
            // The picture only helps to find out why.
            let _ = self.screen.picture().save(&picture);
            panic!(
                "not after {PATIENCE:?}: {what}; the screen is in {}, it said: {}",
                picture.display(),
                self.running.stderr()
            );
        };
        answer
    }
}
