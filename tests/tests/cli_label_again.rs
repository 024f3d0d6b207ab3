//! Labelling a folder again: what is finished stays as it is, what is not is gone on with, and a failure is told to scripts.
#![allow(clippy::unwrap_used, reason = "a test ends where it fails")]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::SystemTime;

use inplace_tests::{Outcome, Running, Small, class_ids, inplace, one_line};
use serde_json::Value;
use tempfile::TempDir;

/// Seconds that the small scene may take.
const BUDGET: &str = "4";

/// The small capture on disk, with its strokes file.
struct OnDisk {
    root: TempDir,
}

impl OnDisk {
    fn new() -> Self {
        let root = tempfile::tempdir().unwrap();
        Small::get().write(&root.path().join("room"));
        let on_disk = Self { root };
        fs::write(on_disk.path("strokes.json"), Small::get().strokes().to_string()).unwrap();
        on_disk
    }

    fn path(&self, name: &str) -> PathBuf {
        self.root.path().join(name)
    }

    fn command(&self, more: &[&str]) -> Command {
        let mut command = inplace();
        command.arg("label").arg(self.path("room"));
        command.arg("--strokes").arg(self.path("strokes.json"));
        command.arg("--out").arg(self.path("out"));
        command.args(["--budget", BUDGET, "--json"]).args(more);
        command
    }

    /// Labels the capture; the report that was printed.
    fn label(&self, more: &[&str]) -> Value {
        let outcome = Running::to_the_end(&mut self.command(more));
        assert_eq!(outcome.code, Some(0), "{outcome:?}");
        serde_json::from_str(&outcome.stdout).unwrap()
    }

    /// Every file below `out`, with when it was written and what it holds.
    fn files(&self) -> BTreeMap<PathBuf, (SystemTime, Vec<u8>)> {
        let mut found = BTreeMap::new();
        let mut folders = vec![self.path("out")];
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    folders.push(path);
                } else {
                    let written = fs::metadata(&path).unwrap().modified().unwrap();
                    found.insert(path.clone(), (written, fs::read(&path).unwrap()));
                }
            }
        }
        found
    }
}

/// How many images of this kind are there; all of them are whole.
fn whole_images(out: &Path, kind: &str) -> usize {
    let Ok(entries) = fs::read_dir(out.join(kind)) else {
        return 0;
    };
    let paths = entries.map(|entry| entry.unwrap().path());
    let images = paths.filter(|path| path.extension().is_some_and(|end| end == "png"));
    let readable = images.map(|path| image::open(path).unwrap());
    readable.collect::<Vec<_>>().len()
}

#[test]
fn what_is_finished_stays_as_it_is_until_something_else_is_asked_for() {
    let disk = OnDisk::new();
    let first = disk.label(&["--threads", "2"]);
    let files = disk.files();
    assert_eq!(files.len(), 3 * Small::get().scene.frames.len() + 2);
    assert_eq!(disk.label(&["--threads", "2"]), first);
    assert_eq!(disk.label(&["--threads", "1"]), first, "threads change no label");
    assert_eq!(disk.files(), files);

    let forced = disk.label(&["--force"]);
    assert_ne!(forced["total_s"], first["total_s"]);
    let seeded = disk.label(&["--seed", "3"]);
    assert_eq!(seeded["seed"], 3);
    // The same strokes file under its name, with one stroke less.
    let mut strokes = Small::get().strokes();
    strokes["strokes"].as_array_mut().unwrap().pop();
    fs::write(disk.path("strokes.json"), strokes.to_string()).unwrap();
    let fewer = disk.label(&["--seed", "3"]);
    let number = |report: &Value| report["strokes"].as_u64().unwrap();
    assert_eq!(number(&fewer) + 1, number(&seeded));
}

#[test]
fn a_lost_image_is_written_again() {
    let disk = OnDisk::new();
    disk.label(&[]);
    let lost = disk.path("out/labels/rgb_3.png");
    fs::remove_file(&lost).unwrap();
    disk.label(&[]);
    let camera = &Small::get().scene.frames[3].camera;
    let (width, height, _) = class_ids(&lost);
    assert_eq!((width, height), (camera.width, camera.height));
}

#[test]
fn files_of_two_runs_are_never_taken_for_finished() {
    let disk = OnDisk::new();
    disk.label(&[]);
    // A folder in the place of an image: the run that comes to it fails while it writes.
    let place = disk.path("out/entropy/rgb_5.png");
    fs::remove_file(&place).unwrap();
    fs::create_dir(&place).unwrap();
    let failed = Running::to_the_end(&mut disk.command(&["--seed", "1"]));
    assert_eq!(failed.code, Some(1), "{failed:?}");
    assert!(one_line(&failed.stderr).contains("rgb_5.png"), "{failed:?}");
    assert!(!disk.path("out/report.json").exists());
    fs::remove_dir(&place).unwrap();
    let report = disk.label(&[]);
    assert_eq!(report["seed"], 0);
    assert_eq!(
        whole_images(&disk.path("out"), "entropy"),
        Small::get().scene.frames.len()
    );
}

#[cfg(unix)]
#[test]
fn a_run_killed_while_it_writes_leaves_whole_files_and_the_next_one_finishes() {
    let disk = OnDisk::new();
    let out = disk.path("out");
    // The system kills it with SIGXFSZ, in the middle of the first file of more than 2 KiB: an entropy image.
    let command = disk.command(&[]);
    let mut limited = Command::new("sh");
    limited.args(["-c", "ulimit -c 0; ulimit -f 4; exec \"$0\" \"$@\""]);
    limited.arg(command.get_program()).args(command.get_args());
    let killed = Running::to_the_end(&mut limited);
    assert_eq!(killed.code, None, "{killed:?}");
    let begun = |path: &PathBuf| path.extension().is_some_and(|end| end == "inplace-tmp");
    assert!(disk.files().keys().any(begun), "no file was begun");
    assert!(whole_images(&out, "labels") > 0);
    for kind in ["entropy", "color"] {
        whole_images(&out, kind);
    }
    assert!(!out.join("report.json").exists());

    disk.label(&[]);
    let left = disk.files();
    let frames = Small::get().scene.frames.len();
    assert_eq!(left.len(), 3 * frames + 2, "{:?}", left.keys());
}

#[test]
fn a_failure_is_an_object_on_stdout_and_a_sentence_on_stderr() {
    let disk = OnDisk::new();
    let failed = |outcome: Outcome| -> String {
        assert_eq!(outcome.code, Some(1), "{outcome:?}");
        let told: Value = serde_json::from_str(&outcome.stdout).unwrap();
        let sentence = told["error"].as_str().unwrap().to_owned();
        assert_eq!(sentence, one_line(&outcome.stderr));
        sentence
    };
    fs::remove_dir_all(disk.path("room/depth")).unwrap();
    fs::write(disk.path("room/traj_w_c.txt"), "no poses").unwrap();
    let sentence = failed(Running::to_the_end(&mut disk.command(&[])));
    assert!(sentence.contains("traj_w_c.txt"), "{sentence}");
    assert!(!disk.path("out").exists());
    fs::remove_file(disk.path("strokes.json")).unwrap();
    let sentence = failed(Running::to_the_end(&mut disk.command(&[])));
    assert!(sentence.contains("strokes.json"), "{sentence}");
}
