//! Labelling a folder again: what is finished stays as it is, what is not is gone on with, and a failure is told to scripts.
#![allow(clippy::unwrap_used, reason = "a test ends where it fails")]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::SystemTime;

use inplace_tests::{OnDisk, Running, Small, behind, files_below, one_line, succeed};
use serde_json::Value;

/// The command that labels the capture and prints its report.
fn command(disk: &OnDisk, more: &[&str]) -> Command {
    disk.label(&[&["--json", "--budget", "2"], more].concat())
}

/// Labels the capture; the report that was printed.
fn label(disk: &OnDisk, more: &[&str]) -> Value {
    serde_json::from_str(&succeed(&mut command(disk, more)).stdout).unwrap()
}

/// Every file of the results, with when it was written and what it holds.
fn files(disk: &OnDisk) -> BTreeMap<PathBuf, (SystemTime, Vec<u8>)> {
    let found = files_below(&disk.path("out")).into_iter().map(|path| {
        let written = fs::metadata(&path).unwrap().modified().unwrap();
        let bytes = fs::read(&path).unwrap();
        (path, (written, bytes))
    });
    found.collect()
}

/// How many images of this kind are there; all of them are whole.
fn whole_images(out: &Path, kind: &str) -> usize {
    let mut paths = files_below(&out.join(kind));
    paths.retain(|path| path.extension().is_some_and(|end| end == "png"));
    paths.iter().for_each(|path| drop(image::open(path).unwrap()));
    paths.len()
}

#[test]
fn what_is_finished_stays_as_it_is_until_something_else_is_asked_for() {
    let disk = OnDisk::default();
    let first = label(&disk, &["--threads", "2"]);
    let before = files(&disk);
    assert_eq!(before.len(), 4 * Small::get().scene.frames.len() + 3);
    for threads in ["2", "1"] {
        assert_eq!(label(&disk, &["--threads", threads]), first);
    }
    assert_eq!(files(&disk), before);

    let forced = label(&disk, &["--force"]);
    assert_ne!(forced["total_s"], first["total_s"]);
    let seeded = label(&disk, &["--seed", "3"]);
    assert_eq!(seeded["seed"], 3);
    // The same strokes file under its name, with one stroke less.
    let mut strokes = Small::get().strokes();
    strokes["strokes"].as_array_mut().unwrap().pop();
    disk.write_strokes(&strokes);
    let fewer = label(&disk, &["--seed", "3"]);
    let number = |report: &Value| report["strokes"].as_u64().unwrap();
    assert_eq!(number(&fewer) + 1, number(&seeded));
}

#[cfg(unix)]
#[test]
fn a_run_killed_while_it_writes_leaves_whole_files_and_the_next_one_finishes() {
    let disk = OnDisk::default();
    let out = disk.path("out");
    // The system kills it with SIGXFSZ, in the middle of the first file of more than 2 KiB: an entropy image.
    let mut limited = behind(&["sh", "-c"], "ulimit -c 0; ulimit -f 4", &command(&disk, &[]));
    // The log may be longer than that.
    let killed = Running::to_the_end(limited.env("RUST_LOG", "off"));
    assert_eq!(killed.code, None, "{killed:?}");
    let begun = |path: &PathBuf| path.extension().is_some_and(|end| end == "inplace-tmp");
    assert!(files(&disk).keys().any(begun), "no file was begun");
    assert!(whole_images(&out, "labels") > 0);
    for kind in ["entropy", "color"] {
        whole_images(&out, kind);
    }
    assert!(!out.join("report.json").exists());

    label(&disk, &[]);
    let left = files(&disk);
    let frames = Small::get().scene.frames.len();
    assert_eq!(left.len(), 4 * frames + 3, "{:?}", left.keys());
}

#[test]
fn a_failure_is_an_object_on_stdout_and_a_sentence_on_stderr() {
    let disk = OnDisk::default();
    fs::remove_dir_all(disk.path("room/depth")).unwrap();
    fs::write(disk.path("room/traj_w_c.txt"), "no poses").unwrap();
    let outcome = Running::to_the_end(&mut command(&disk, &[]));
    assert_eq!(outcome.code, Some(1), "{outcome:?}");
    let told: Value = serde_json::from_str(&outcome.stdout).unwrap();
    let sentence = one_line(&outcome.stderr);
    assert_eq!(told["error"], sentence);
    assert!(sentence.contains("traj_w_c.txt"), "{sentence}");
    assert!(!disk.path("out").exists());
}
