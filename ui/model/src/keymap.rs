//! Which key does what for this person: the keys that were changed from their defaults.

use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

use serde_json::{Map, Value};

/// A key by its name, such as `S`, `+` or `Left`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Key(&'static str);

/// The names of all keys but those that are held beside others.
const KEYS: &str = "\
    Down Left Right Up Escape Tab Backspace Enter Space Insert Delete Home End PageUp PageDown Copy Cut Paste \
    : , - . + = ; [ ] { } ` \\ / | ? ! Quote 0 1 2 3 4 5 6 7 8 9 A B C D E F G H I J K L M N O P Q R S T U V W \
    X Y Z F1 F2 F3 F4 F5 F6 F7 F8 F9 F10 F11 F12 F13 F14 F15 F16 F17 F18 F19 F20 F21 F22 F23 F24 F25 F26 F27 \
    F28 F29 F30 F31 F32 F33 F34 F35 BrowserBack BrowserForward BrowserRefresh BrowserSearch BrowserHome \
    BrowserFavorites BrowserStop MediaPlayPause MediaTrackNext MediaTrackPrevious MediaStop AudioVolumeMute \
    AudioVolumeDown AudioVolumeUp LaunchMail LaunchApp1 LaunchApp2 IntlBackslash CapsLock NumLock ScrollLock \
    PrintScreen Pause Menu Fn Eject Help Power Sleep Clear";

impl Key {
    /// The key with this name, if there is one.
    pub fn named(name: &str) -> Option<Self> {
        KEYS.split(' ').find(|known| *known == name).map(Self)
    }
}

/// A key with the modifiers that count: Ctrl (Cmd on macOS) and Shift.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Shortcut {
    /// Whether Ctrl is held, or Cmd on macOS.
    pub command: bool,
    /// Whether Shift is held.
    pub shift: bool,
    /// The key.
    pub key: Key,
}

/// Keys that the window itself needs: to move the focus, to press what has it, to leave, to pan.
const RESERVED: [&str; 4] = ["Tab", "Enter", "Escape", "Space"];

impl Shortcut {
    /// A key alone, by its name; one that does not exist is never pressed.
    pub const fn key(name: &'static str) -> Self {
        Self {
            command: false,
            shift: false,
            key: Key(name),
        }
    }

    /// The same key with Ctrl.
    pub const fn with_ctrl(self) -> Self {
        Self {
            command: true,
            ..self
        }
    }

    /// The same key with Shift.
    pub const fn with_shift(self) -> Self {
        Self { shift: true, ..self }
    }

    /// The same key without Shift.
    pub fn without_shift(self) -> Self {
        Self { shift: false, ..self }
    }

    /// The same without Shift where the key is a sign: layouts differ in which of those need it.
    pub fn of_layout(self) -> Self {
        let is_sign = self.key.0.chars().count() == 1 && !self.key.0.chars().all(char::is_alphanumeric);
        match is_sign && !self.command {
            true => self.without_shift(),
            false => self,
        }
    }

    /// The digit that was pressed without Ctrl.
    pub fn digit(self) -> Option<usize> {
        let Key(name) = self.key;
        let is_digit = matches!(name.as_bytes(), [b'0'..=b'9']) && !self.command;
        is_digit.then(|| name.parse().ok()).flatten()
    }

    /// Whether this key keeps its meaning whatever the person chooses: the digits choose classes.
    pub fn is_fixed(self) -> bool {
        RESERVED.contains(&self.key.0) || self.digit().is_some()
    }
}

impl fmt::Display for Shortcut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.command {
            write!(f, "Ctrl+")?;
        }
        if self.shift {
            write!(f, "Shift+")?;
        }
        f.write_str(self.key.0)
    }
}

impl FromStr for Shortcut {
    type Err = ();

    /// Reads what [`fmt::Display`] writes.
    fn from_str(text: &str) -> Result<Self, ()> {
        let (command, text) = text
            .strip_prefix("Ctrl+")
            .map_or((false, text), |rest| (true, rest));
        let (shift, text) = text
            .strip_prefix("Shift+")
            .map_or((false, text), |rest| (true, rest));
        let key = Key::named(text).ok_or(())?;
        Ok(Self { command, shift, key })
    }
}

/// What the person changed: the default key of an action, and the key that it has instead, if any. A
/// default names its action, since no key is bound twice.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct KeyMap {
    moved: BTreeMap<Shortcut, Option<Shortcut>>,
}

impl KeyMap {
    /// The key that does what `default` does by default; `None` where it was taken away.
    pub fn present(&self, default: Shortcut) -> Option<Shortcut> {
        self.moved.get(&default).copied().unwrap_or(Some(default))
    }

    /// Whether this default holds no longer.
    pub fn is_moved(&self, default: Shortcut) -> bool {
        self.moved.contains_key(&default)
    }

    /// Whether nothing was changed.
    pub fn is_default(&self) -> bool {
        self.moved.is_empty()
    }

    /// Gives what `default` does another key, or none.
    pub fn set(&mut self, default: Shortcut, present: Option<Shortcut>) {
        if present == Some(default) {
            self.moved.remove(&default);
        } else {
            self.moved.insert(default, present);
        }
    }

    /// Everything as it comes.
    pub fn reset(&mut self) {
        self.moved.clear();
    }

    /// As kept in the preferences: `{"Ctrl+S": "Ctrl+K", "E": null}`.
    pub fn to_json(&self) -> Value {
        let entry = |(default, present): (&Shortcut, &Option<Shortcut>)| {
            let present = present.map_or(Value::Null, |present| present.to_string().into());
            (default.to_string(), present)
        };
        Value::Object(self.moved.iter().map(entry).collect::<Map<_, _>>())
    }

    /// Reads what [`KeyMap::to_json`] wrote; keys that nobody knows are left out.
    pub fn from_json(json: &Value) -> Self {
        let mut map = Self::default();
        for (default, present) in json.as_object().into_iter().flatten() {
            let Ok(default) = default.parse() else { continue };
            match present.as_str().map(str::parse) {
                Some(Ok(present)) => map.set(default, Some(present)),
                None if present.is_null() => map.set(default, None),
                _ => {}
            }
        }
        map
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shortcut(text: &str) -> Shortcut {
        text.parse().unwrap()
    }

    #[test]
    fn every_key_is_read_as_it_is_written() {
        for key in KEYS.split(' ') {
            for written in [Shortcut::key(key), Shortcut::key(key).with_ctrl().with_shift()] {
                assert_eq!(written.to_string().parse(), Ok(written), "{written}");
            }
        }
        assert_eq!(shortcut("Ctrl++"), Shortcut::key("+").with_ctrl());
        assert_eq!("Ctrl+Nonsense".parse::<Shortcut>(), Err(()));
    }

    #[test]
    fn changed_keys_survive_and_unknown_ones_do_no_harm() {
        let mut map = KeyMap::default();
        map.set(shortcut("Ctrl+S"), Some(shortcut("Ctrl+K")));
        map.set(shortcut("E"), None);
        assert_eq!(KeyMap::from_json(&map.to_json()), map);
        let odd = serde_json::json!({"E": "Nonsense", "Nonsense": "E", "Q": 3, "P": "K"});
        let read = KeyMap::from_json(&odd);
        assert_eq!(read.present(shortcut("P")), Some(shortcut("K")));
        assert_eq!(read.present(shortcut("E")), Some(shortcut("E")));
    }

    #[test]
    fn digits_and_the_keys_of_the_focus_stay_what_they_are() {
        for fixed in ["1", "0", "Escape", "Tab", "Ctrl+Enter"] {
            assert!(shortcut(fixed).is_fixed(), "{fixed}");
        }
        for free in ["Ctrl+0", "K", "F5", "Shift+N"] {
            assert!(!shortcut(free).is_fixed(), "{free}");
        }
    }
}
