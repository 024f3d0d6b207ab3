//! Killing the program at any moment loses nothing that was reported as kept.
#![allow(clippy::unwrap_used, reason = "a test ends where it fails")]

use std::sync::Arc;
use std::time::Duration;

use inplace_core::labels::{
    Edit, FoundObject, History, ImportedLabels, ImportedMap, LabelImages, Stroke, Trust, VOID,
};
use inplace_core::project::{Contents, Journal, Opened, Project, ProjectError, Step};
use inplace_core::session::FrameMap;
use inplace_tests::{Running, child, contents, folder_of_child, until};
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng, rngs::SmallRng};

const FRAMES: usize = 4;
const SIZE: [u32; 2] = [64, 48];
/// Tells the child how many steps may wait for the disk: those that wait share a transaction.
const BURST: &str = "INPLACE_TEST_BURST";
/// How often the child is killed.
const KILLS: u64 = 200;

/// What there is before the first step: a class of things, which have objects, and one of stuff.
fn beginning() -> Contents {
    let mut contents = contents(SIZE);
    let mut history = History::default();
    for class in ["chair", "floor"] {
        history.add_class(class);
    }
    contents.history = History::new(history.labels().clone());
    contents
}

/// Images that give every pixel of a frame this class.
fn images(frame: usize, class: u16) -> LabelImages {
    let map = ImportedMap::new(frame, &[class; (SIZE[0] * SIZE[1]) as usize]);
    ImportedLabels::new(vec![map], Trust::VOTES).into()
}

/// The steps that begin with this sequence number, from 1, and change the history: one of all kinds that a person has, or a
/// click where there is nothing yet that the other could change. Label images are a step of their own before it.
fn steps(history: &mut History, sequence: u64) -> Vec<Step> {
    let random = &mut SmallRng::seed_from_u64(sequence);
    let pixel = SIZE.map(|side| random.random_range(0..side));
    let labels = history.labels();
    let classes = labels.classes.iter().map(|class| class.id);
    let classes: Vec<u16> = classes.chain([VOID]).collect();
    let mut class = || classes.choose(random).copied().unwrap();
    let (class, other_class) = (class(), class());
    let click = Stroke::click(random.random_range(0..FRAMES), class, pixel);
    let strokes: Vec<_> = labels.strokes.keys().copied().collect();
    let stroke = strokes.choose(random).copied();
    let mut object = || -> Option<FoundObject> { labels.objects.choose(random).cloned().map(Into::into) };
    let (one, other) = (object(), object());
    let edit: Option<Edit> = match random.random_range(0..24) {
        0..=5 => None,
        6..=8 => history.add_object(click.clone(), &[]).map(|(_, edit)| edit),
        9 => one.and_then(|object| history.label_object(&object, click.clone())),
        10 => one.and_then(|object| history.rename_object(&object, &format!("object of step {sequence}"))),
        11 => one
            .zip(other)
            .and_then(|(one, other)| history.merge_object(&one, &other)),
        12..=13 => one.and_then(|one| history.delete_object(one.object.id)),
        14 => stroke.and_then(|stroke| history.delete_stroke(stroke)),
        15 => stroke.and_then(|stroke| history.change_stroke_class(stroke, click.class)),
        16 => history.erase_where(click.frame, &[pixel], 6, |_| true),
        17 => Some(history.toggle_checked(click.frame)),
        18 if history.undo().is_some() => return vec![Step::Undo],
        19 if history.redo().is_some() => return vec![Step::Redo],
        18 | 19 => None,
        20 => Some(history.add_class(&format!("class of step {sequence}")).1),
        21 => history.merge_class(class, other_class),
        22 => Some(history.import(images(click.frame, class))),
        _ => history.remove_imported(),
    };
    let edit = edit.unwrap_or_else(|| history.add_stroke(click));
    let brought = history.brought_by(&edit);
    let images = brought.map(|(id, images)| Step::Import(id, Arc::clone(images)));
    images.into_iter().chain([Step::Do(edit)]).collect()
}

/// The history after each of the first steps, that before them first.
fn histories(count: u64) -> Vec<History> {
    let mut history = beginning().history;
    let mut all = vec![history.clone()];
    while all.len() as u64 <= count {
        let before = history.clone();
        let made = steps(&mut history, all.len() as u64);
        all.extend(std::iter::repeat_n(before, made.len() - 1));
        all.push(history.clone());
    }
    all
}

/// After how many steps the history was so, in the end.
fn steps_to(found: &History, all: &[History]) -> Option<usize> {
    let is_it = |history: &History| history.labels() == found.labels() && history.edits() == found.edits();
    all.iter().rposition(is_it)
}

/// A map whose image does not compress well, so that writing it takes a while.
fn map(sequence: u64) -> Arc<FrameMap> {
    let pixels = u64::from(SIZE[0] * SIZE[1]);
    let noise = |i: u64| ((i + sequence).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 48) as u16;
    let labels = (0..pixels).map(|i| noise(i) % 3).collect();
    let entropy = (0..pixels).map(noise).collect();
    Arc::new(FrameMap::new(sequence as usize % FRAMES, sequence, SIZE, labels, entropy).unwrap())
}

/// The child: records steps as fast as it can, and says which are kept, until it is killed.
#[test]
#[ignore = "a process of its own, which the test below starts and kills"]
fn record_until_killed() {
    let Some(folder) = folder_of_child() else {
        return;
    };
    let burst: u64 = std::env::var(BURST).unwrap().parse().unwrap();
    let contents = beginning();
    let project = Project::create(&folder.join("work.inplace"), &contents).unwrap();
    let journal = Journal::start(project, &contents, || ()).unwrap();
    let mut history = contents.history;
    let mut told = 0;
    loop {
        let recorded = journal.recorded();
        if recorded < journal.committed() + burst {
            for step in steps(&mut history, recorded + 1) {
                journal.record(step);
            }
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
fn a_step_that_was_kept_survives_a_kill_at_any_moment_and_a_backup_is_whole_or_not_there() {
    let mut random = SmallRng::seed_from_u64(1);
    let mut next = |below: u64| random.random_range(0..below);
    let mut restored = 0;
    for round in 0..KILLS {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("work.inplace");
        let mut command = child("record_until_killed", folder.path());
        let mut child = Running::start(command.env(BURST, (1 + next(30)).to_string()));
        let enough = 1 + next(60);
        until("steps are kept", Duration::from_secs(60), || {
            assert!(child.ended().is_none(), "{}{}", child.stdout(), child.stderr());
            (kept(&child) >= enough).then_some(())
        });
        std::thread::sleep(Duration::from_micros(next(8_000)));
        child.kill();
        let kept = kept(&child);

        let (mut project, contents) = Project::open(&path).unwrap();
        assert_eq!(contents.warnings, Vec::<String>::new());
        // No more wait for the disk, and to be told, than two bursts.
        let all = histories(kept + 64);
        let labels = contents.history.labels();
        let found = steps_to(&contents.history, &all);
        let found = found.unwrap_or_else(|| panic!("round {round}: after {kept} steps there are {labels:?}"));
        println!(
            "round {round}: {kept} kept, {found} found, {} objects, {} checked frames",
            labels.objects.len(),
            labels.checked.len()
        );
        assert!(found as u64 >= kept);
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
                let history = &opened.contents.history;
                assert!(steps_to(history, &all).is_some(), "{:?}", history.labels());
            }
            // The kill came before the first backup was whole.
            Err(error) => assert_eq!(error, ProjectError::NotAProject(path)),
        }
    }
    println!("opened from a backup: {restored}");
    assert!(restored > 0);
}
