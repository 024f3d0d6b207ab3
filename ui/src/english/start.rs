//! The start page, and what was opened lately.

use super::counted;
use crate::preferences::Recent;

/// What the program is for.
pub const CLAIM: &str = "Label a whole scene from a few clicks";
/// Asks for the folder of a scene.
pub const OPEN_FOLDER: &str = "Open a folder...";
/// Asks for a project.
pub const OPEN_PROJECT: &str = "Open a project...";
/// Opens the demo scene.
pub const DEMO: &str = "Try the demo";
/// Name of the path field.
pub const PATH: &str = "Path to open";
/// In the empty path field.
pub const PATH_HINT: &str = "or type a path: /data/room, /work/room.inplace";
/// Opens the path typed.
pub const OPEN: &str = "Open";
/// That things can be dropped.
pub const DROP: &str = "Drop a folder or a project file anywhere on this window";
/// Heading of what can be opened.
pub const FORMATS: &str = "What can be opened";
/// Formats by name, and what to look for.
pub const FORMAT_LIST: [(&str, &str); 5] = [
    (
        "Replica, Semantic-NeRF",
        "rgb/, traj_w_c.txt, and depth/ where there is depth",
    ),
    ("COLMAP", "images/ and sparse/"),
    (
        "7-Scenes, TUM RGB-D, ScanNet",
        "frame-000000.color.png, rgb.txt, or color/ and pose/",
    ),
    (
        "nerfstudio, instant-ngp",
        "transforms.json and the images it lists",
    ),
    ("Inplace project", "a file .inplace that was saved here"),
];
/// Where to find more about formats.
pub const FORMATS_MORE: &str =
    "docs/formats.md describes them; \"inplace info FOLDER\" says what is found in a folder.";
/// Heading of what was opened lately.
pub const RECENT: &str = "Recent";
/// The menu of what was opened lately.
pub const OPEN_RECENT: &str = "Open recent";
/// There is nothing in it yet.
pub const NO_RECENTS: &str = "Nothing was opened yet";
/// Heading for who is new.
pub const FIRST_STEPS: &str = "First steps";
/// What to do in the first minutes.
pub const STEPS: [(&str, &str); 3] = [
    ("Open a scene", "The demo is a small room that needs no files."),
    (
        "Click on things",
        "Click on something and name its class. All frames follow.",
    ),
    (
        "Go where it is unclear",
        "The list on the right shows what to label next; then export.",
    ),
];

/// A recent entry that is not where it was.
pub fn not_found(name: &str) -> String {
    format!("{name} (not found)")
}

/// Name of an entry for screen readers.
pub fn open_recent(recent: &Recent, there: bool) -> String {
    if there {
        format!("Open {}", recent.name)
    } else {
        not_found(&recent.name)
    }
}

/// Name of the button that takes an entry off the list.
pub fn forget(name: &str) -> String {
    format!("Remove {name} from the list")
}

/// How much there is, and when it was last open; `now` in seconds since 1970.
pub fn details(recent: &Recent, now: u64) -> String {
    format!(
        "{}, {}, {}  -  {}",
        counted(recent.frames, "frame", "frames"),
        counted(recent.classes, "class", "classes"),
        counted(recent.strokes, "stroke", "strokes"),
        ago(now.saturating_sub(recent.opened)),
    )
}

fn ago(seconds: u64) -> String {
    let of = |count: u64, unit: &str| format!("{count} {unit}{} ago", if count == 1 { "" } else { "s" });
    match seconds {
        0..60 => "just now".to_owned(),
        60..3600 => of(seconds / 60, "minute"),
        3600..86_400 => of(seconds / 3600, "hour"),
        86_400..5_184_000 => of(seconds / 86_400, "day"),
        _ => of(seconds / 2_592_000, "month"),
    }
}

/// The keys that help at the start.
pub fn keys(help: &str, open: &str, settings: &str) -> String {
    format!("{help} shows all keys    {open} opens    {settings} settings")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_told_roughly() {
        for (seconds, words) in [
            (5, "just now"),
            (60, "1 minute ago"),
            (7200, "2 hours ago"),
            (86_400 * 3, "3 days ago"),
            (86_400 * 90, "3 months ago"),
        ] {
            assert_eq!(ago(seconds), words);
        }
    }
}
