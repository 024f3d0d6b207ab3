//! A damaged project is opened from its newest backup that opens, and says so.

use rand::{Rng, SeedableRng, rngs::SmallRng};

use super::super::backups::write;
use super::*;
use crate::labels::LabelSet;

/// A project on frames a, b, c: 150 strokes of two classes of which some were erased, deleted and undone; imported
/// images, maps and a model.
fn grown(folder: &Path) -> Contents {
    let mut contents = contents(folder);
    let history = &mut contents.history;
    let mut random = SmallRng::seed_from_u64(7);
    for number in 0..150_usize {
        let x = random.random_range(0..300);
        let line = (0..random.random_range(1..41)).map(|step| [x + step, number as u32]);
        history.add_stroke(Stroke {
            lines: vec![line.collect()],
            radius: random.random_range(0..3),
            ..Stroke::click(number % 3, 1 + (number % 2) as u16, [0, 0])
        });
        if number % 20 == 9 {
            history
                .erase_where(number % 3, &[[x, number as u32]], 1, |_| true)
                .unwrap();
        }
        if number % 30 == 11 {
            let last = *history.labels().strokes.last_key_value().unwrap().0;
            history.delete_stroke(last).unwrap();
        }
    }
    history.import(images(1));
    history.add_class("table");
    history.add_stroke(Stroke::click(1, 3, [5, 5]));
    history.undo();
    contents.maps = vec![map(0, 7, 1), map(2, 6, 300)];
    contents.model = Some(Arc::new(ModelState {
        steps: 10,
        tensors: (0..20_000_u32).map(|i| ((i * i) >> 3) as u8).collect(),
    }));
    contents
}

const PAGE: usize = 4096;

/// Flips bits, spoils bytes or pages, or cuts the end off.
fn spoil(bytes: &mut Vec<u8>, round: usize, random: &mut SmallRng) {
    let length = bytes.len();
    let start = PAGE * random.random_range(0..length / PAGE);
    let page = start..start + PAGE;
    match round % 6 {
        0 => bytes[random.random_range(0..length)] ^= 1 << random.random_range(0..8),
        1 => (0..8).for_each(|_| bytes[random.random_range(0..length)] = random.random()),
        2 => bytes.truncate(random.random_range(0..length)),
        3 => bytes[page].fill(0),
        4 => random.fill(&mut bytes[page]),
        _ => {
            let from = random.random_range(0..200);
            bytes[from..from + random.random_range(1..61)].fill(0);
        }
    }
}

#[test]
fn after_any_damage_a_project_is_whole_or_from_its_backup_or_refused_and_says_so() {
    let (folder, path) = place();
    let mut contents = grown(folder.path());
    let backed_up = contents.history.labels().clone();
    write(&path, &contents).unwrap();
    contents.history.add_stroke(Stroke::click(0, 1, [9, 9]));
    let truth = contents.history.labels();
    drop(Project::create(&path, &contents).unwrap());
    let whole = fs::read(&path).unwrap();
    let hidden = folder.path().join(".inplace-backups");
    let aside = folder.path().join("p-damaged.inplace");
    let mut random = SmallRng::seed_from_u64(8);
    let (mut refused, mut restored, mut warned, mut unharmed) = (0, 0, 0, 0);
    for round in 0..120 {
        let mut bytes = whole.clone();
        spoil(&mut bytes, round, &mut random);
        fs::write(&path, &bytes).unwrap();
        let has_backup = round % 4 > 0;
        if !has_backup {
            fs::rename(&hidden, folder.path().join("away")).unwrap();
        }
        let outcome = Opened::open(&path);
        if !has_backup {
            fs::rename(folder.path().join("away"), &hidden).unwrap();
        }
        let entries = names(folder.path()).len();
        match outcome {
            Err(error) => {
                refused += 1;
                let sentence = error.to_string();
                assert!(sentence.starts_with(&path.display().to_string()), "{sentence}");
                assert!(!sentence.contains('\n'), "{sentence}");
                let is_newer = matches!(error, ProjectError::Newer { .. });
                assert!(is_newer || !has_backup, "round {round}: {sentence}");
                assert_eq!((fs::read(&path).unwrap(), entries), (bytes, 2), "round {round}");
            }
            Ok(opened) => {
                let labels = opened.contents.history.labels();
                if let Some(sentence) = opened.damage {
                    restored += 1;
                    let told = format!("{}: is damaged (", path.display());
                    assert!(sentence.starts_with(&told), "{sentence}");
                    assert!(sentence.contains("; its backup of 2"), "{sentence}");
                    let end = format!("the damaged file is now {}", aside.display());
                    assert!(sentence.ends_with(&end), "{sentence}");
                    assert_eq!(labels, &backed_up, "round {round}");
                    assert_eq!((fs::read(&aside).unwrap(), entries), (bytes, 3), "round {round}");
                    assert_eq!(opened.project.unwrap().path(), path);
                    let again = Opened::open(&path).unwrap();
                    assert_eq!(again.contents.history.labels(), &backed_up);
                    assert_eq!(again.damage, None);
                    fs::remove_file(&aside).unwrap();
                } else if opened.contents.warnings.is_empty() {
                    unharmed += 1;
                    assert_eq!(labels, truth, "round {round}");
                } else {
                    warned += 1;
                }
            }
        }
    }
    println!("refused {refused}, restored {restored}, told {warned}, unharmed {unharmed}");
    assert!(refused > 10 && restored > 30 && unharmed > 10);
}

#[test]
fn reading_alone_writes_nothing_and_an_older_backup_stands_in_for_a_damaged_one() {
    let (folder, path) = place();
    let mut contents = contents(folder.path());
    let mut states: Vec<LabelSet> = Vec::new();
    for x in 0..5 {
        contents.history.add_stroke(Stroke::click(0, 1, [x, 1]));
        states.push(contents.history.labels().clone());
        write(&path, &contents).unwrap();
    }
    fs::write(&path, "no project").unwrap();
    let backups = folder.path().join(".inplace-backups/p.inplace");
    assert_eq!(names(&backups), ["3.inplace", "4.inplace", "5.inplace"]);
    for (number, state) in [(5, &states[4]), (4, &states[3]), (3, &states[2])] {
        let read = Contents::read(&path).unwrap();
        assert_eq!(read.history.labels(), state);
        assert!(read.warnings[0].contains("its backup of"), "{:?}", read.warnings);
        assert_eq!(fs::read(&path).unwrap(), b"no project");
        assert_eq!(names(folder.path()).len(), 2);
        fs::write(backups.join(format!("{number}.inplace")), [0; 100]).unwrap();
    }
    let error = Contents::read(&path).unwrap_err();
    assert_eq!(error, ProjectError::NotAProject(path));
}

#[test]
fn a_backup_holds_what_was_said_and_finds_the_scene_where_the_folder_has_moved() {
    let root = tempfile::tempdir().unwrap();
    let (old, new) = (root.path().join("old"), root.path().join("new"));
    let scene = old.join("scene");
    fs::create_dir_all(&scene).unwrap();
    let mut contents = grown(&scene);
    let project = Project::create(&old.join("p.inplace"), &contents).unwrap();
    let journal = Journal::start(project, &contents, || ()).unwrap();
    journal.record(click(&mut contents.history, 1));
    journal.close().unwrap();
    fs::write(old.join("p.inplace"), "").unwrap();
    fs::rename(&old, &new).unwrap();
    let read = Contents::read(&new.join("p.inplace")).unwrap();
    assert_eq!(read.history.labels(), contents.history.labels());
    assert_eq!(read.history.edits(), contents.history.edits());
    assert_eq!(read.history.imports(), contents.history.imports());
    assert!(read.maps.is_empty() && read.model.is_none());
    let place = location::absolute(&new.join("scene"));
    assert_eq!(read.scene.source, SceneSource::Folder(place));
}

#[test]
fn backups_follow_the_edits_and_the_last_one_has_them_all() {
    let (folder, path) = place();
    let backups = folder.path().join(".inplace-backups/p.inplace");
    // As a killed process leaves it.
    fs::create_dir_all(&backups).unwrap();
    fs::write(backups.join(".1.inplace.77.tmp"), "half").unwrap();
    let (journal, mut history) = start(&path);
    for x in 0..8 {
        journal.record(click(&mut history, x));
        std::thread::sleep(Duration::from_millis(15));
    }
    wait_for(|| names(&backups).iter().any(|name| !name.starts_with('.')));
    journal.record(click(&mut history, 9));
    journal.close().unwrap();
    let kept = names(&backups);
    let none_is_half = kept.iter().all(|name| !name.starts_with('.'));
    assert!(kept.len() <= 3 && none_is_half, "{kept:?}");
    fs::write(&path, "").unwrap();
    let opened = Opened::open(&path).unwrap();
    assert_eq!(opened.contents.history.labels(), history.labels());
    assert_eq!(opened.contents.history.edits(), history.edits());
}

#[test]
fn a_backup_that_cannot_be_written_is_told_once_and_stops_nothing() {
    let (folder, path) = place();
    let hidden = folder.path().join(".inplace-backups");
    fs::write(&hidden, "in the way").unwrap();
    let (journal, mut history) = start(&path);
    journal.record(click(&mut history, 0));
    let JournalEvent::Problem(sentence) = event(&journal) else {
        panic!("it is told");
    };
    let told = "p.inplace: no backup of it could be written: ";
    assert!(sentence.contains(told), "{sentence}");
    let last = journal.record(click(&mut history, 1));
    wait_for(|| journal.committed() == last);
    std::thread::sleep(Duration::from_millis(100));
    fs::remove_file(&hidden).unwrap();
    wait_for(|| hidden.join("p.inplace/1.inplace").exists());
    assert!(journal.events().is_empty());
    journal.close().unwrap();
    assert_saved(&path, &history);
}
