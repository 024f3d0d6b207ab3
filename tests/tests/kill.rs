//! Killing the program at any moment loses nothing that was reported as kept.
#![allow(clippy::unwrap_used, reason = "a test ends where it fails")]

use std::sync::Arc;
use std::time::Duration;

use inplace_core::labels::Stroke;
use inplace_core::project::{Journal, Opened, Project, ProjectError, Step};
use inplace_core::session::FrameMap;
use inplace_tests::{Running, child, contents, folder_of_child, strokes_of, until};
use rand::{Rng, SeedableRng, rngs::SmallRng};

const FRAMES: usize = 4;
const SIZE: [u32; 2] = [64, 48];
/// Tells the child how many strokes may wait for the disk: those that wait share a transaction.
const BURST: &str = "INPLACE_TEST_BURST";
/// How often the child is killed.
const KILLS: u64 = 200;

/// The stroke with this sequence number, from 1.
fn stroke(sequence: u64) -> Stroke {
    let [width, height] = SIZE.map(u64::from);
    Stroke::click(
        sequence as usize % FRAMES,
        1 + (sequence % 2) as u16,
        [(sequence % width) as u32, (sequence / width % height) as u32],
    )
}

/// A map whose image does not compress well, so that writing it takes a while.
fn map(sequence: u64) -> Arc<FrameMap> {
    let pixels = u64::from(SIZE[0] * SIZE[1]);
    let noise = |i: u64| ((i + sequence).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 48) as u16;
    let labels = (0..pixels).map(|i| noise(i) % 3).collect();
    let entropy = (0..pixels).map(noise).collect();
    Arc::new(FrameMap::new(sequence as usize % FRAMES, sequence, SIZE, labels, entropy).unwrap())
}

/// The child: records strokes as fast as it can, and says which are kept, until it is killed.
#[test]
#[ignore = "a process of its own, which the test below starts and kills"]
fn record_until_killed() {
    let Some(folder) = folder_of_child() else {
        return;
    };
    let burst: u64 = std::env::var(BURST).unwrap().parse().unwrap();
    let contents = contents(SIZE);
    let project = Project::create(&folder.join("work.inplace"), &contents).unwrap();
    let journal = Journal::start(project, &contents, || ()).unwrap();
    let mut history = contents.history;
    let mut told = 0;
    loop {
        let recorded = journal.recorded();
        if recorded < journal.committed() + burst {
            let edit = history.add_stroke(stroke(recorded + 1));
            journal.record(Step::Do(edit));
            if recorded.is_multiple_of(16) {
                journal.save_maps(vec![map(recorded)]);
            }
        } else {
            std::thread::sleep(Duration::from_micros(100));
        }
        let committed = journal.committed();
        if committed > told {
            told = committed;
            println!("kept {committed}");
        }
    }
}

/// The highest number that the child said was kept.
fn kept(child: &Running) -> u64 {
    let printed = child.stdout();
    let complete = printed.rsplit_once('\n').map_or("", |(lines, _)| lines);
    let numbers = complete.lines().filter_map(|line| {
        let (_, number) = line.split_once("kept ")?;
        number.parse().ok()
    });
    numbers.max().unwrap_or(0)
}

#[test]
fn a_stroke_that_was_kept_survives_a_kill_at_any_moment_and_a_backup_is_whole_or_not_there() {
    let mut random = SmallRng::seed_from_u64(1);
    let mut next = |below: u64| random.random_range(0..below);
    let mut restored = 0;
    for round in 0..KILLS {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("work.inplace");
        let mut command = child("record_until_killed", folder.path());
        let mut child = Running::start(command.env(BURST, (1 + next(30)).to_string()));
        let enough = 1 + next(30);
        until("strokes are kept", Duration::from_secs(60), || {
            assert!(child.ended().is_none(), "{}{}", child.stdout(), child.stderr());
            (kept(&child) >= enough).then_some(())
        });
        std::thread::sleep(Duration::from_micros(next(8_000)));
        child.kill();
        let kept = kept(&child);

        let (mut project, contents) = Project::open(&path).unwrap();
        assert_eq!(contents.warnings, Vec::<String>::new());
        let strokes = strokes_of(&contents);
        println!("round {round}: {kept} kept, {} found", strokes.len());
        assert!(strokes.len() as u64 >= kept);
        let expected: Vec<Stroke> = (1..=strokes.len() as u64).map(stroke).collect();
        assert_eq!(strokes, expected);
        assert_eq!(contents.history.edits().0.len(), strokes.len());
        project.record(&[Step::Undo]).unwrap();
        drop(project);
        let database = rusqlite::Connection::open(&path).unwrap();
        let verdict: String = database
            .query_row("PRAGMA integrity_check", [], |row| row.get(0))
            .unwrap();
        assert_eq!(verdict, "ok");
        drop(database);

        std::fs::write(&path, "damaged").unwrap();
        match Opened::open(&path) {
            Ok(opened) => {
                restored += 1;
                assert!(opened.damage.is_some());
                let strokes = strokes_of(&opened.contents);
                assert!(!strokes.is_empty());
                assert_eq!(strokes, expected[..strokes.len()]);
            }
            // The kill came before the first backup was whole.
            Err(error) => assert_eq!(error, ProjectError::NotAProject(path)),
        }
    }
    println!("opened from a backup: {restored}");
    assert!(restored > 0);
}
