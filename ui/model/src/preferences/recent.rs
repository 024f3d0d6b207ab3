//! What was opened lately.

use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use serde_json::{Value, json};

/// Most entries kept.
pub const MOST: usize = 12;

/// What can be opened again.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum RecentPlace {
    /// The folder of a capture.
    Scene(PathBuf),
    /// A project file.
    Project(PathBuf),
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
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Recent {
    /// Where it is.
    pub place: RecentPlace,
    /// Name for people.
    pub name: String,
    /// When it was last open, in seconds since 1970.
    pub opened: u64,
    /// Number of frames.
    pub frames: usize,
    /// Number of classes.
    pub classes: usize,
    /// Number of strokes.
    pub strokes: usize,
}

/// What was opened lately, newest first, at most [`MOST`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
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

    /// As kept in the preferences.
    pub(super) fn to_json(&self) -> Value {
        let entry = |recent: &Recent| {
            let kind = match recent.place {
                RecentPlace::Scene(_) => "scene",
                RecentPlace::Project(_) => "project",
            };
            json!({
                "kind": kind,
                "path": recent.place.path().to_string_lossy(),
                "name": recent.name,
                "opened": recent.opened,
                "frames": recent.frames,
                "classes": recent.classes,
                "strokes": recent.strokes,
            })
        };
        self.0.iter().map(entry).collect()
    }

    /// Reads what [`Recents::to_json`] wrote; entries that make no sense are left out.
    pub(super) fn from_json(json: &Value) -> Self {
        let read = |entry: &Value| {
            let path = PathBuf::from(entry["path"].as_str()?);
            let place = match entry["kind"].as_str()? {
                "scene" => RecentPlace::Scene(path),
                "project" => RecentPlace::Project(path),
                _ => return None,
            };
            let count = |key: &str| entry[key].as_u64().and_then(|count| count.try_into().ok());
            Some(Recent {
                place,
                name: entry["name"].as_str()?.to_owned(),
                opened: entry["opened"].as_u64().unwrap_or(0),
                frames: count("frames").unwrap_or(0),
                classes: count("classes").unwrap_or(0),
                strokes: count("strokes").unwrap_or(0),
            })
        };
        let entries = json.as_array().into_iter().flatten();
        Self(entries.filter_map(read).take(MOST).collect())
    }
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
        assert_eq!(Recents::from_json(&recents.to_json()), recents);
    }

    #[test]
    fn a_scene_and_a_project_of_one_path_are_two() {
        let mut recents = Recents::default();
        recents.add(recent("/a", 0));
        recents.add(Recent {
            place: RecentPlace::Project(PathBuf::from("/a")),
            ..recent("/a", 1)
        });
        recents.forget(&RecentPlace::Scene(PathBuf::from("/a")));
        assert!(recents.iter().map(|recent| recent.strokes).eq([1]));
    }
}
