//! Where things are: the scene as seen from its project file, and the projects that nobody has named yet.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use crate::scene::SceneSource;

/// Where the edits on a scene live until the person saves them under a name of their own: one file per
/// scene in the user's data folder. Opening the scene again finds them there.
///
/// The folder is `$XDG_DATA_HOME` (or `~/.local/share`) on Linux, `~/Library/Application Support` on
/// macOS and `%LOCALAPPDATA%` on Windows, or else the temporary folder; below it `inplace/autosave`,
/// which the caller makes where it is not there yet.
pub fn autosave_path(source: &SceneSource) -> PathBuf {
    user_folder(Kind::Data)
        .join("autosave")
        .join(autosave_name(source))
}

/// Where small pictures of recent scenes and projects are kept: `inplace/pictures` in the folder that
/// [`autosave_path`] is in. The caller makes it where it is not there yet.
pub fn pictures_folder() -> PathBuf {
    user_folder(Kind::Data).join("pictures")
}

/// Where the log is kept that a bug report can attach: `inplace/inplace.log` in the folder that [`autosave_path`] is in.
pub fn log_path() -> PathBuf {
    user_folder(Kind::Data).join("inplace.log")
}

/// File name of the small picture of the scene or project at a path: always the same for one path, and
/// another one for every other.
pub fn picture_name(of: &Path) -> String {
    format!("{}.png", name_by_place(&absolute(of)))
}

/// Where the person's preferences are kept: `inplace` in `$XDG_CONFIG_HOME` (or `~/.config`) on Linux,
/// `~/Library/Application Support` on macOS and `%APPDATA%` on Windows, or else in the temporary folder.
/// The caller makes it where it is not there yet.
pub fn configuration_folder() -> PathBuf {
    user_folder(Kind::Configuration)
}

/// What a user's folder is for.
#[derive(Clone, Copy)]
enum Kind {
    Data,
    Configuration,
}

fn user_folder(kind: Kind) -> PathBuf {
    let folder = base_folder(kind, std::env::consts::OS, |name| std::env::var_os(name));
    folder.unwrap_or_else(std::env::temp_dir).join("inplace")
}

fn base_folder(kind: Kind, os: &str, variable: impl Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
    let absolute = |name: &str| {
        variable(name)
            .map(PathBuf::from)
            .filter(|path| path.is_absolute())
    };
    let (windows, freedesktop, below_home) = match kind {
        Kind::Data => ("LOCALAPPDATA", "XDG_DATA_HOME", ".local/share"),
        Kind::Configuration => ("APPDATA", "XDG_CONFIG_HOME", ".config"),
    };
    match os {
        "windows" => absolute(windows),
        "macos" => absolute("HOME").map(|home| home.join("Library/Application Support")),
        _ => absolute(freedesktop).or_else(|| absolute("HOME").map(|home| home.join(below_home))),
    }
}

fn autosave_name(source: &SceneSource) -> String {
    let folder = match source {
        SceneSource::Demo => return "demo.inplace".to_owned(),
        SceneSource::Folder(folder) => absolute(folder),
    };
    format!("{}.inplace", name_by_place(&folder))
}

/// A name for what is at an absolute path, readable and its own.
fn name_by_place(path: &Path) -> String {
    let name = path.file_name().map_or_else(String::new, |name| {
        name.to_string_lossy().chars().take(40).collect()
    });
    let hash = fnv1a(path.as_os_str().as_encoded_bytes());
    format!("{name}-{hash:016x}")
}

/// FNV-1a: the same in every release, unlike the standard library's hashers.
fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    })
}

/// The path without symbolic links where it exists, else just absolute.
pub(super) fn absolute(path: &Path) -> PathBuf {
    path.canonicalize()
        .or_else(|_| std::path::absolute(path))
        .unwrap_or_else(|_| path.to_path_buf())
}

/// `target` as seen from the folder of `file`, with `/` between the parts; `None` where there is no such
/// way (another drive).
pub(super) fn relative_to(file: &Path, target: &Path) -> Option<String> {
    let from = absolute(folder_of(file));
    let to = absolute(target);
    let (from, to): (Vec<_>, Vec<_>) = (from.components().collect(), to.components().collect());
    let shared = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    if shared == 0 {
        return None;
    }
    let up = std::iter::repeat_n("..", from.len() - shared);
    let down = to[shared..].iter().map(|part| part.as_os_str().to_str());
    let parts: Option<Vec<&str>> = up.map(Some).chain(down).collect();
    let parts = parts?;
    Some(if parts.is_empty() {
        ".".to_owned()
    } else {
        parts.join("/")
    })
}

/// The scene's folder from what a project file says: beside the project where it is there, else the
/// absolute place, whether or not it is there. `None` where the file says neither.
pub(super) fn resolve(file: &Path, relative: Option<&str>, absolute_path: Option<&str>) -> Option<PathBuf> {
    let beside = relative.map(|relative| absolute(&absolute(folder_of(file)).join(relative)));
    let fixed = absolute_path.map(PathBuf::from);
    match (beside, fixed) {
        (Some(beside), _) if beside.is_dir() => Some(beside),
        (beside, None) => beside,
        (_, fixed) => fixed,
    }
}

/// The folder with the backups of a project file. It lies beside the file, so that both move together.
pub(super) fn backups_folder(file: &Path) -> PathBuf {
    let file = absolute(file);
    let name = file.file_name().unwrap_or_default();
    folder_of(&file).join(".inplace-backups").join(name)
}

/// Whether two paths lead to one file.
pub fn same_file(a: &Path, b: &Path) -> bool {
    a == b || matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// The folder that a file is in.
pub(super) fn folder_of(file: &Path) -> &Path {
    match file.parent() {
        Some(parent) if parent.as_os_str().is_empty() => Path::new("."),
        Some(parent) => parent,
        None => file,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scene_is_found_beside_a_project_that_moved_with_it_or_else_where_it_was() {
        let root = tempfile::tempdir().unwrap();
        let (old, new) = (root.path().join("old"), root.path().join("new"));
        std::fs::create_dir_all(old.join("scene")).unwrap();
        let relative = relative_to(&old.join("work/p.inplace"), &old.join("scene"));
        assert_eq!(relative.as_deref(), Some("../scene"));
        std::fs::rename(&old, &new).unwrap();
        std::fs::create_dir(new.join("work")).unwrap();
        let gone = old.join("scene");
        let found = resolve(&new.join("work/p.inplace"), relative.as_deref(), gone.to_str());
        assert_eq!(found, Some(absolute(&new.join("scene"))));
        // One that moved alone.
        let (alone, scene) = (root.path().join("elsewhere/deep/p.inplace"), new.join("scene"));
        assert_eq!(resolve(&alone, relative.as_deref(), scene.to_str()), Some(scene));
    }

    #[test]
    fn every_scene_has_its_own_autosave_and_always_the_same() {
        let name = |path: &str| autosave_name(&SceneSource::Folder(PathBuf::from(path)));
        assert_eq!(name("/a/room"), name("/a/room"));
        assert_ne!(name("/a/room"), name("/b/room"));
        assert!(name("/a/room").starts_with("room-"));
        assert_eq!(autosave_name(&SceneSource::Demo), "demo.inplace");
    }

    #[cfg(unix)]
    #[test]
    fn data_and_preferences_live_in_the_folders_of_the_platform() {
        let all = |name: &str| match name {
            "HOME" => Some("/home/ann".into()),
            "XDG_DATA_HOME" => Some("/data".into()),
            "XDG_CONFIG_HOME" => Some("/config".into()),
            _ => None,
        };
        let home = |name: &str| all(name).filter(|_| name == "HOME");
        for (kind, named, usual) in [
            (Kind::Data, "/data", "/home/ann/.local/share"),
            (Kind::Configuration, "/config", "/home/ann/.config"),
        ] {
            assert_eq!(base_folder(kind, "linux", all), Some(named.into()));
            assert_eq!(base_folder(kind, "linux", home), Some(usual.into()));
            assert_eq!(
                base_folder(kind, "macos", home),
                Some("/home/ann/Library/Application Support".into())
            );
            assert_eq!(base_folder(kind, "windows", home), None);
        }
    }
}
