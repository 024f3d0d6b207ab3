//! What was opened lately.

use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize, Serializer};
use serde_json::Value;

use super::each;

/// Most entries kept.
pub const MOST: usize = 12;

/// What can be opened again.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(tag = "kind", content = "path", rename_all = "lowercase")]
pub enum RecentPlace {
    /// The folder of a capture.
    Scene(#[serde(serialize_with = "lossy")] PathBuf),
    /// A project file.
    Project(#[serde(serialize_with = "lossy")] PathBuf),
}

impl RecentPlace {
    /// The folder or file.
    pub fn path(&self) -> &Path {
        match self {
            Self::Scene(path) | Self::Project(path) => path,
        }
    }

    /// Whether it is where it was; touches the disk.
    pub fn is_there(&self) -> bool {
        match self {
            Self::Scene(path) => path.is_dir(),
            Self::Project(path) => path.is_file(),
        }
    }
}

/// Something that was opened lately.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Recent {
    /// Where it is.
    #[serde(flatten)]
    pub place: RecentPlace,
    /// Name for people.
    pub name: String,
    /// When it was last open, in seconds since 1970.
    #[serde(default)]
    pub opened: u64,
    /// Number of frames.
    #[serde(default)]
    pub frames: usize,
    /// Number of classes.
    #[serde(default)]
    pub classes: usize,
    /// Number of strokes.
    #[serde(default)]
    pub strokes: usize,
}

/// What was opened lately, newest first, at most [`MOST`].
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Recents(Vec<Recent>);

impl Recents {
    /// The entries, newest first.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &Recent> {
        self.0.iter()
    }

    /// Whether nothing was opened yet.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Puts an entry in front, in place of an earlier one about the same place.
    pub fn add(&mut self, recent: Recent) {
        self.forget(&recent.place);
        self.0.insert(0, recent);
        self.0.truncate(MOST);
    }

    /// Takes an entry away.
    pub fn forget(&mut self, place: &RecentPlace) {
        self.0.retain(|recent| recent.place != *place);
    }

    /// Reads the entries of the preferences; those that make no sense are left out.
    pub(super) fn from_json(json: &Value) -> Self {
        Self(each(json).take(MOST).collect())
    }
}

fn lossy<S: Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&path.to_string_lossy())
}

/// Now, in seconds since 1970.
pub fn now() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0, |since| since.as_secs())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recent(path: &str, strokes: usize) -> Recent {
        Recent {
            place: RecentPlace::Scene(PathBuf::from(path)),
            name: path.to_owned(),
            opened: 7,
            frames: 5,
            classes: 2,
            strokes,
        }
    }

    #[test]
    fn the_newest_is_first_each_place_is_there_once_and_old_ones_make_room() {
        let mut recents = Recents::default();
        for index in 0..MOST + 3 {
            recents.add(recent(&format!("/{index}"), 0));
        }
        recents.add(recent("/9", 4));
        assert_eq!(recents.iter().len(), MOST);
        let first = recents.iter().next().unwrap();
        assert_eq!((first.name.as_str(), first.strokes), ("/9", 4));
        assert_eq!(recents.iter().filter(|recent| recent.name == "/9").count(), 1);
        assert_eq!(Recents::from_json(&serde_json::json!(recents)), recents);
        // A scene and a project of one path are two.
        recents.add(Recent {
            place: RecentPlace::Project(PathBuf::from("/9")),
            ..recent("/9", 1)
        });
        recents.forget(&RecentPlace::Scene(PathBuf::from("/9")));
        let left = recents.iter().filter(|recent| recent.name == "/9");
        assert!(left.map(|recent| recent.strokes).eq([1]));
    }
}
