//! Edits that find no room.

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use inplace_core::labels::Stroke;
use inplace_core::project::{Journal, JournalEvent, Opened, Project, Step};
use inplace_tests::{Running, contents};

use crate::{FOLDER, SIZE, assert_done, child, copy_environment, folder_of_child, save_elsewhere, scribble};

/// Tells a child process on a full disk of a folder on another one.
const ELSEWHERE: &str = "INPLACE_TEST_ELSEWHERE";
/// Where set, tests that mount a small disk must not be skipped.
const REQUIRE_MOUNT: &str = "INPLACE_REQUIRE_MOUNT_TEST";

#[test]
fn on_a_full_disk_nothing_is_said_to_be_saved_that_is_not() {
    let folder = tempfile::tempdir().unwrap();
    // 256 KiB a file; without the signal, writing more is an error.
    let inner = child("full_disk::work_until_the_disk_is_full", folder.path());
    let mut limited = Command::new("sh");
    limited
        .args(["-c", "trap '' XFSZ; ulimit -f 512; exec \"$0\" \"$@\""])
        .arg(inner.get_program())
        .args(inner.get_args());
    copy_environment(&inner, &mut limited);
    assert_done(&Running::to_the_end(&mut limited));
}

#[test]
fn work_on_a_full_disk_is_rescued_to_another_one() {
    let folder = tempfile::tempdir().unwrap();
    let elsewhere = tempfile::tempdir().unwrap();
    let can_mount = Command::new("unshare")
        .args(["-rm", "mount", "-t", "tmpfs", "-o", "size=64k", "none"])
        .arg(folder.path())
        .output()
        .is_ok_and(|output| output.status.success());
    if !can_mount {
        assert!(
            std::env::var_os(REQUIRE_MOUNT).is_none(),
            "a small disk cannot be mounted with `unshare -rm`"
        );
        println!("skipped: a small disk cannot be mounted here");
        return;
    }
    let inner = child("full_disk::work_until_the_disk_is_full", folder.path());
    let mut mounted = Command::new("unshare");
    mounted
        .args(["-rm", "sh", "-c"])
        .arg(format!(
            "mount -t tmpfs -o size=512k none \"${FOLDER}\" && exec \"$0\" \"$@\""
        ))
        .arg(inner.get_program())
        .args(inner.get_args());
    copy_environment(&inner, &mut mounted);
    mounted.env(ELSEWHERE, elsewhere.path());
    let outcome = Running::to_the_end(&mut mounted);
    assert_done(&outcome);
    assert!(outcome.stdout.contains("the disk is full"), "{}", outcome.stdout);
}

#[test]
#[ignore = "a process of its own, which the tests above start"]
fn work_until_the_disk_is_full() {
    let Some(folder) = folder_of_child() else {
        return;
    };
    let path = folder.join("work.inplace");
    let contents = contents(SIZE);
    let project = Project::create(&path, &contents).unwrap();
    let journal = Journal::start(project, &contents, || ()).unwrap();
    let mut history = contents.history;
    let mut sentence = None;
    for number in 0..1000 {
        let last = journal.record(Step::Do(history.add_stroke(scribble(number))));
        while journal.committed() < last && sentence.is_none() {
            sentence = journal.events().recv_timeout(Duration::from_millis(1)).ok();
        }
        if sentence.is_some() {
            break;
        }
    }
    let Some(JournalEvent::Failed(sentence)) = sentence else {
        panic!("{sentence:?}");
    };
    println!("{sentence}");
    assert!(sentence.contains("work.inplace: cannot be saved"), "{sentence}");
    let kept = journal.committed();
    assert_eq!(kept + 1, journal.recorded());
    assert!(kept > 5, "{kept}");
    if let Some(elsewhere) = std::env::var_os(ELSEWHERE) {
        save_elsewhere(&journal, Path::new(&elsewhere), &history);
        journal.close().unwrap();
    } else {
        assert!(journal.close().is_err());
    }

    let opened = Opened::open(&path).unwrap();
    assert_eq!(opened.damage, None);
    assert_eq!(opened.contents.warnings, Vec::<String>::new());
    let strokes = opened.contents.history.labels().strokes.values();
    let strokes: Vec<Stroke> = strokes.map(|stroke| stroke.as_ref().clone()).collect();
    let expected: Vec<Stroke> = (0..kept as u32).map(scribble).collect();
    assert_eq!(strokes, expected);
    println!("all of it holds");
}
