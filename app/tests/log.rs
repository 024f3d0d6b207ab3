//! The log that a bug report attaches.
#![allow(clippy::expect_used, reason = "a test ends where it fails")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn info(scene: &str, data: &Path, more: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_inplace"));
    command.args(["info", scene]).args(more);
    command.env("XDG_DATA_HOME", data).env_remove("RUST_LOG");
    command.output().expect("the program starts")
}

#[test]
fn the_log_has_what_was_done_in_the_file_asked_for_or_else_in_the_folder_of_the_users_data() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let data = folder.path().join("data");
    let file = folder.path().join("asked.log");
    let file = file.to_str().expect("a path in UTF-8");
    let output = info("demo", &data, &["--log", file]);
    assert!(output.status.success() && output.stderr.is_empty(), "{output:?}");
    let log = fs::read_to_string(file).expect("a log");
    for part in [
        "INFO",
        "arguments=[\"info\"",
        "a scene is open",
        "format=\"demo\" frames=60",
    ] {
        assert!(log.contains(part), "{part} is not in: {log}");
    }
    assert!(!data.exists(), "a log was asked for elsewhere");
    let failed = info("no-such-folder", &data, &[]);
    let stderr = String::from_utf8_lossy(&failed.stderr);
    assert_eq!(stderr.lines().count(), 1, "said once: {stderr}");
    if cfg!(target_os = "linux") {
        let log = fs::read_to_string(data.join("inplace/inplace.log")).expect("the rolling log");
        assert!(log.contains("ERROR") && log.contains("no such folder"), "{log}");
    }
}

#[test]
fn a_log_that_cannot_be_written_is_said_and_stops_nothing() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let data = folder.path().join("file");
    fs::write(&data, "").expect("a file");
    let output = info("no-such-folder", &data, &[]);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(stderr.contains("no such folder"), "{stderr}");
    if cfg!(target_os = "linux") {
        assert!(stderr.contains("the log cannot be written"), "{stderr}");
        assert_eq!(stderr.lines().count(), 2, "{stderr}");
    }
}
