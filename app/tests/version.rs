//! The binary starts, says what it is, and refuses wrong arguments.
#![allow(clippy::expect_used, reason = "a test ends where it fails")]

use std::process::{Command, Output};

fn inplace(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_inplace"))
        .args(arguments)
        .output()
        .expect("the program starts")
}

#[test]
fn the_version_is_that_of_the_package() {
    let output = inplace(&["--version"]);
    let text = String::from_utf8_lossy(&output.stdout);
    assert_eq!(text.trim(), concat!("inplace ", env!("CARGO_PKG_VERSION")));
    assert!(output.status.success());
}

#[test]
fn wrong_arguments_exit_with_2_and_do_nothing() {
    for arguments in [
        &["--no-such-option"][..],
        &["label", "demo", "--out", "x", "--budget", "never"],
        &["label", "demo", "--out", "x", "--preset", "best"],
        &["label", "demo", "--out", "x", "--threads", "0"],
    ] {
        let output = inplace(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(output.stdout.is_empty(), "{arguments:?}");
        let usage = String::from_utf8_lossy(&output.stderr);
        assert!(usage.contains("error:"), "{arguments:?}: {usage}");
        assert!(usage.contains("--help"), "{arguments:?}: {usage}");
    }
}
