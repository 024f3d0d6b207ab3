//! A keyboard and a mouse on a test's screen, faster than a program that is called for each key.

use std::collections::HashMap;

use x11rb::connection::Connection;
use x11rb::protocol::xproto::{
    BUTTON_PRESS_EVENT, BUTTON_RELEASE_EVENT, ConnectionExt as _, KEY_PRESS_EVENT, KEY_RELEASE_EVENT,
    MOTION_NOTIFY_EVENT, Window,
};
use x11rb::protocol::xtest::ConnectionExt as _;
use x11rb::rust_connection::RustConnection;

use crate::Screen;

/// Keys with names, and their keysyms; a letter, digit or sign is its own.
const NAMED: &[(&str, u32)] = &[
    ("space", 0x20),
    ("plus", 0x2b),
    ("comma", 0x2c),
    ("minus", 0x2d),
    ("question", 0x3f),
    ("bracketleft", 0x5b),
    ("bracketright", 0x5d),
    ("BackSpace", 0xff08),
    ("Tab", 0xff09),
    ("Return", 0xff0d),
    ("Escape", 0xff1b),
    ("Home", 0xff50),
    ("Left", 0xff51),
    ("Up", 0xff52),
    ("Right", 0xff53),
    ("Down", 0xff54),
    ("End", 0xff57),
    ("F1", 0xffbe),
    ("Shift_L", 0xffe1),
    ("Control_L", 0xffe3),
    ("Delete", 0xffff),
];
const BUTTONS: std::ops::RangeInclusive<u8> = 1..=5;

/// Sends input events through the XTEST extension. Panics where the display is gone.
#[derive(Debug)]
pub struct Hands {
    display: RustConnection,
    root: Window,
    /// Keycodes by keysym, and whether they need Shift.
    codes: HashMap<u32, (u8, bool)>,
}

impl Hands {
    /// Hands on a screen.
    ///
    /// # Panics
    /// When the display cannot be connected to.
    pub fn new(screen: &Screen) -> Self {
        let (display, number) =
            RustConnection::connect(Some(screen.display())).expect("the display can be connected to");
        let setup = display.setup();
        let (first, last) = (setup.min_keycode, setup.max_keycode);
        let root = setup.roots[number].root;
        let mapping = display
            .get_keyboard_mapping(first, last - first + 1)
            .expect("the display takes requests")
            .reply()
            .expect("the display has a keyboard");
        let per_key = usize::from(mapping.keysyms_per_keycode);
        let mut codes = HashMap::new();
        for (code, keysyms) in (first..=last).zip(mapping.keysyms.chunks(per_key)) {
            for (shifted, &keysym) in [false, true].into_iter().zip(keysyms) {
                codes.entry(keysym).or_insert((code, shifted));
            }
        }
        Self { display, root, codes }
    }

    /// Moves the pointer.
    pub fn move_to(&self, [x, y]: [i16; 2]) {
        self.fake(MOTION_NOTIFY_EVENT, 0, [x, y]);
    }

    /// Presses or releases a mouse button: 1 left, 2 middle, 3 right, 4 and 5 the wheel.
    pub fn button(&self, button: u8, pressed: bool) {
        let event = if pressed {
            BUTTON_PRESS_EVENT
        } else {
            BUTTON_RELEASE_EVENT
        };
        self.fake(event, button, [0, 0]);
    }

    /// Presses and releases a key: a character, or the name of its keysym.
    ///
    /// # Panics
    /// When the keyboard lacks the key.
    pub fn press(&self, key: &str) {
        let (code, shifted) = self.code(key);
        if shifted {
            return self.with("Shift_L", key);
        }
        self.fake(KEY_PRESS_EVENT, code, [0, 0]);
        self.fake(KEY_RELEASE_EVENT, code, [0, 0]);
    }

    /// Presses and releases a key while another one is held.
    ///
    /// # Panics
    /// When the keyboard lacks one of them.
    pub fn with(&self, held: &str, key: &str) {
        let (held, _) = self.code(held);
        let (code, _) = self.code(key);
        self.fake(KEY_PRESS_EVENT, held, [0, 0]);
        self.fake(KEY_PRESS_EVENT, code, [0, 0]);
        self.fake(KEY_RELEASE_EVENT, code, [0, 0]);
        self.fake(KEY_RELEASE_EVENT, held, [0, 0]);
    }

    /// Releases all buttons.
    pub fn let_go(&self) {
        for button in BUTTONS {
            self.button(button, false);
        }
    }

    fn code(&self, key: &str) -> (u8, bool) {
        let named = NAMED
            .iter()
            .find(|(name, _)| *name == key)
            .map(|&(_, keysym)| keysym);
        let keysym = named.or_else(|| key.chars().next().map(u32::from)).unwrap_or(0);
        *self
            .codes
            .get(&keysym)
            .unwrap_or_else(|| panic!("there is no key {key}"))
    }

    fn fake(&self, event: u8, detail: u8, [x, y]: [i16; 2]) {
        self.display
            .xtest_fake_input(event, detail, 0, self.root, x, y, 0)
            .expect("the display takes requests")
            .check()
            .expect("the display has the XTEST extension");
    }
}
