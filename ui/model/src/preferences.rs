//! What a person prefers, in every scene: looks, keys, and what was opened lately.
//!
//! [`Preferences`] is the value, [`Store`] the file that it is kept in.

mod layout;
mod recent;
mod store;

use std::collections::BTreeSet;
use std::path::PathBuf;

use inplace_core::cores;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

pub use layout::{Layout, Pane};
pub use recent::{MOST, Recent, RecentPlace, Recents, now};
pub use store::Store;

use crate::hints::Hint;
use crate::keymap::{KeyMap, Shortcut};
use crate::layer::Layer;
use crate::settings::Settings;

/// Smallest and largest scale of the window, in percent.
pub const SCALES: std::ops::RangeInclusive<u16> = 100..=300;
/// How far a key changes the scale, in percentage points.
const SCALE_STEP: i16 = 10;

/// The colours of the window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Theme {
    /// Light on dark.
    #[default]
    Dark,
    /// Dark on light.
    Light,
    /// Whichever the system has.
    System,
}

/// What a person prefers, in every scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Preferences {
    /// Dark, light, or as the system.
    pub theme: Theme,
    /// Size of everything in the window, in percent, within [`SCALES`].
    pub scale: u16,
    /// Threads of the worker's pool; `None` = as [usual](usual_threads).
    pub threads: Option<usize>,
    /// File of a pretrained network that tells what looks alike.
    pub features: Option<PathBuf>,
    /// How frames are shown and drawn on in scenes that have no settings of their own yet: some of the
    /// keys of [`Settings::to_json`].
    pub look: Map<String, Value>,
    /// Which key does what.
    pub keys: KeyMap,
    /// What was opened lately.
    pub recents: Recents,
    /// Hints that need not be shown again.
    pub hints_seen: BTreeSet<Hint>,
    /// Which panels are shown.
    pub layout: Layout,
    /// Width and height of the window in points of the screen, whatever the scale.
    pub window: Option<[f32; 2]>,
}

impl Default for Preferences {
    fn default() -> Self {
        Self {
            theme: Theme::Dark,
            scale: 100,
            threads: None,
            features: None,
            look: Map::new(),
            keys: KeyMap::default(),
            recents: Recents::default(),
            hints_seen: BTreeSet::new(),
            layout: Layout::default(),
            window: None,
        }
    }
}

/// A change of the preferences.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PreferenceChange {
    /// The colours of the window.
    Theme(Theme),
    /// The size of everything, in percent.
    Scale(u16),
    /// Larger (positive) or smaller by so many steps.
    StepScale(i8),
    /// Threads of the worker's pool from the next opening on; `None` = as [usual](usual_threads).
    Threads(Option<usize>),
    /// File of a pretrained network, used from the next opening on.
    Features(Option<PathBuf>),
    /// What the first key does by default gets the second one, or none.
    Key(Shortcut, Option<Shortcut>),
    /// All keys as they come.
    ResetKeys,
    /// Takes something off the list of what was opened lately.
    Forget(RecentPlace),
    /// A hint need not be shown again.
    HintSeen(Hint),
    /// All hints are shown again.
    ResetHints,
    /// Shows or hides a panel, or (`None`) leaves that to the room that there is.
    Pane(Pane, Option<bool>),
}

impl Preferences {
    /// Carries out a change.
    pub fn change(&mut self, change: PreferenceChange) {
        match change {
            PreferenceChange::Theme(theme) => self.theme = theme,
            PreferenceChange::Scale(percent) => self.scale = percent.clamp(*SCALES.start(), *SCALES.end()),
            PreferenceChange::StepScale(steps) => {
                let percent = self.scale.saturating_add_signed(i16::from(steps) * SCALE_STEP);
                self.change(PreferenceChange::Scale(percent));
            }
            PreferenceChange::Threads(threads) => self.threads = threads,
            PreferenceChange::Features(file) => self.features = file,
            PreferenceChange::Key(default, present) => self.keys.set(default, present),
            PreferenceChange::ResetKeys => self.keys.reset(),
            PreferenceChange::Forget(place) => self.recents.forget(&place),
            PreferenceChange::HintSeen(hint) => {
                self.hints_seen.insert(hint);
            }
            PreferenceChange::ResetHints => self.hints_seen.clear(),
            PreferenceChange::Pane(pane, shown) => self.layout.set(pane, shown),
        }
    }

    /// The settings that a scene without settings of its own starts with.
    pub fn settings(&self) -> Settings {
        let mut settings = Settings::default();
        settings.take_json(&Value::Object(self.look.clone()));
        settings
    }

    /// Notes which settings differ from those of before; no layer of a comparison is kept.
    pub(crate) fn note_settings(&mut self, before: Settings, mut now: Settings) {
        for (layer, before) in [
            (&mut now.layer, before.layer),
            (&mut now.other_layer, before.other_layer),
        ] {
            if *layer == Layer::Differences {
                *layer = before;
            }
        }
        let (before, now) = (before.to_json(), now.to_json());
        let entries = now.as_object().into_iter().flatten();
        let changed = entries.filter(|(key, value)| before[key.as_str()] != **value);
        self.look
            .extend(changed.map(|(key, value)| (key.clone(), value.clone())));
    }

    /// As kept in the file.
    fn to_json(&self) -> Map<String, Value> {
        let entries = [
            ("theme", json!(self.theme)),
            ("scale", json!(self.scale)),
            ("threads", json!(self.threads)),
            (
                "features",
                json!(self.features.as_ref().map(|path| path.to_string_lossy())),
            ),
            ("look", Value::Object(self.look.clone())),
            ("keys", self.keys.to_json()),
            ("recents", json!(self.recents)),
            ("hints", json!(self.hints_seen)),
            ("layout", json!(self.layout)),
            ("window", json!(self.window)),
        ];
        entries
            .map(|(key, value)| (key.to_owned(), value))
            .into_iter()
            .collect()
    }

    /// Reads what [`Preferences::to_json`] wrote; what is missing or makes no sense is as it comes.
    fn from_json(json: &Map<String, Value>) -> Self {
        let value = |key: &str| json.get(key).unwrap_or(&Value::Null);
        let mut read = Self {
            theme: Theme::deserialize(value("theme")).unwrap_or_default(),
            threads: usize::deserialize(value("threads")).ok(),
            features: PathBuf::deserialize(value("features")).ok(),
            look: Map::deserialize(value("look")).unwrap_or_default(),
            keys: KeyMap::from_json(value("keys")),
            recents: Recents::from_json(value("recents")),
            hints_seen: each(value("hints")).collect(),
            layout: Layout::from_json(value("layout")),
            window: <[f32; 2]>::deserialize(value("window")).ok(),
            ..Self::default()
        };
        if let Ok(scale) = u16::deserialize(value("scale")) {
            read.change(PreferenceChange::Scale(scale));
        }
        read.threads = read.threads.filter(|&threads| threads > 0);
        read.window = read.window.filter(|size| size.iter().all(|&side| side >= 1.0));
        read
    }
}

/// The entries of a list, without those that make no sense.
pub(crate) fn each<'a, Entry: Deserialize<'a>>(list: &'a Value) -> impl Iterator<Item = Entry> {
    let entries = list.as_array().into_iter().flatten();
    entries.filter_map(|entry| Entry::deserialize(entry).ok())
}

/// Threads of the worker's pool unless somebody chose otherwise: one for each core where they give way to the window's,
/// which is on Linux; elsewhere one core is the window's.
pub fn usual_threads() -> usize {
    let kept_free = usize::from(!cfg!(target_os = "linux"));
    cores().saturating_sub(kept_free).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_that_make_no_sense_are_as_they_come() {
        let json = json!({
            "theme": 3, "scale": "x", "threads": 0, "features": 5, "look": [], "keys": 1, "recents": {}, "hints": [1, "?"],
            "window": [0, "x"],
        });
        let read = Preferences::from_json(json.as_object().unwrap());
        assert_eq!(read, Preferences::default());
    }
}
