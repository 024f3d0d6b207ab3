//! Measurements tell what they are of, and are fit to be read.
#![allow(clippy::unwrap_used, reason = "a test ends where it fails")]

use std::fs;
use std::path::Path;

use inplace_tests::{Running, inplace, one_line};
use serde_json::Value;

/// Writes the demo, photographed in a small way.
fn small_demo(folder: &Path, options: &[&str]) {
    let mut command = inplace();
    command
        .args(["demo", "--frames", "8", "--size", "64x48"])
        .args(options);
    let outcome = Running::to_the_end(command.arg("--out").arg(folder));
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
}

#[test]
fn several_rooms_share_the_frames() {
    let root = tempfile::tempdir().unwrap();
    let length = |rooms: &str| {
        let folder = root.path().join(rooms);
        small_demo(&folder, &["--rooms", rooms]);
        let info = Running::to_the_end(inplace().arg("info").arg(&folder).arg("--json"));
        assert_eq!(info.code, Some(0), "{info:?}");
        let facts: Value = serde_json::from_str(&info.stdout).unwrap();
        assert_eq!(facts["frames"], 8);
        facts["bounds_max_m"][0].as_f64().unwrap() - facts["bounds_min_m"][0].as_f64().unwrap()
    };
    assert!(length("2") > 1.5 * length("1"));
}

#[test]
fn captures_of_one_name_are_not_measured_together() {
    let root = tempfile::tempdir().unwrap();
    let folders = ["a/room", "b/room"].map(|name| root.path().join(name));
    for folder in &folders {
        fs::create_dir_all(folder.parent().unwrap()).unwrap();
        small_demo(folder, &[]);
    }
    for protocol in ["all", "latency", "pareto", "paper"] {
        let mut command = inplace();
        command.args(["bench", protocol]).args(&folders);
        let outcome = Running::to_the_end(command.arg("--out").arg(root.path().join("out")));
        assert_eq!(outcome.code, Some(1), "{outcome:?}");
        assert!(
            one_line(&outcome.stderr).contains("room: two captures have this name"),
            "{outcome:?}"
        );
    }
}

#[test]
fn a_condition_is_tried_and_its_page_says_how_it_went() {
    let root = tempfile::tempdir().unwrap();
    let (scene, out) = (root.path().join("scene"), root.path().join("out"));
    small_demo(&scene, &[]);
    let mut command = inplace();
    command.args(["bench", "stability"]).arg(&scene);
    command.args([
        "--conditions",
        "labels-one-click",
        "--seeds",
        "2",
        "--seconds",
        "0.2",
    ]);
    let outcome = Running::to_the_end(command.arg("--out").arg(&out));
    assert_eq!(
        (outcome.code, outcome.stderr.as_str()),
        (Some(0), ""),
        "{outcome:?}"
    );
    let page = fs::read_to_string(out.join("stability.md")).unwrap();
    assert_eq!(page, outcome.stdout);
    assert!(page.contains("Every line is met."), "{page}");
    assert!(page.contains("| labels-one-click |"), "{page}");
    let table = fs::read_to_string(out.join("stability.csv")).unwrap();
    assert_eq!(table.lines().count(), 3, "{table}");
}
