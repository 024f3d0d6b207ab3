//! Damaged files open whole, or with what is readable and a sentence, or are refused; and stay as they are.

use std::path::PathBuf;

use super::*;

/// Numbers that are the same in every run.
struct Random(u64);

impl Random {
    fn below(&mut self, limit: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % limit as u64) as usize
    }
}

/// A project on frames a, b, c: 150 strokes of two classes of which some were erased, moved to another class, deleted
/// and undone; imported images, maps and a model.
fn grown(folder: &Path) -> Contents {
    let mut contents = contents(folder);
    let history = &mut contents.history;
    let mut random = Random(7);
    for number in 0..150_usize {
        let x = random.below(300) as u32;
        let line = (0..1 + random.below(40) as u32).map(|step| [x + step, number as u32]);
        history.add_stroke(Stroke {
            lines: vec![line.collect()],
            radius: random.below(3) as u32,
            ..Stroke::click(number % 3, 1 + (number % 2) as u16, [0, 0])
        });
        if number % 20 == 9 {
            history.erase(number % 3, &[[x, number as u32]], 1).unwrap();
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

/// A grown project in a file, with the file's bytes.
fn in_a_file(folder: &Path) -> (PathBuf, Contents, Vec<u8>) {
    let path = folder.join("p.inplace");
    let contents = grown(folder);
    drop(Project::create(&path, &contents).unwrap());
    let bytes = fs::read(&path).unwrap();
    (path, contents, bytes)
}

/// Number of the first page that holds rows of a table.
fn root(path: &Path, table: &str) -> usize {
    let sql = "SELECT rootpage FROM sqlite_schema WHERE name = ?1";
    let connection = Connection::open(path).unwrap();
    connection
        .query_row(sql, [table], |row| row.get::<_, i64>(0))
        .unwrap() as usize
}

const PAGE: usize = 4096;

fn page(bytes: &mut [u8], number: usize) -> &mut [u8] {
    &mut bytes[(number - 1) * PAGE..number * PAGE]
}

#[test]
fn every_kind_of_damage_is_told_and_no_stroke_is_lost_or_changed_in_silence() {
    let folder = tempfile::tempdir().unwrap();
    let (path, contents, whole) = in_a_file(folder.path());
    let pages = whole.len() / PAGE;
    assert!(pages > 20, "{pages}");
    let truth = contents.history.labels();
    let mut random = Random(0x2545_f491_4f6c_dd1d);
    let (mut refused, mut salvaged, mut unharmed, mut warned, mut kept) = (0, 0, 0, 0, 0);
    for round in 0..600 {
        let mut bytes = whole.clone();
        let number = 1 + random.below(pages);
        match round % 6 {
            0 => bytes[random.below(whole.len())] ^= 1 << random.below(8),
            1 => (0..8).for_each(|_| bytes[random.below(whole.len())] = random.below(256) as u8),
            2 => bytes.truncate(random.below(whole.len())),
            3 => page(&mut bytes, number).fill(0),
            4 => page(&mut bytes, number)
                .iter_mut()
                .for_each(|byte| *byte = random.below(256) as u8),
            _ => {
                let from = random.below(200);
                bytes[from..from + 1 + random.below(60)].fill(0);
            }
        }
        fs::write(&path, &bytes).unwrap();
        match Contents::read(&path) {
            Err(error) => {
                refused += 1;
                let sentence = error.to_string();
                assert!(sentence.starts_with(&path.display().to_string()), "{sentence}");
                assert!(!sentence.contains('\n'), "{sentence}");
            }
            Ok(read) => {
                let labels = read.history.labels();
                let told = !read.warnings.is_empty();
                let found = truth.strokes.iter();
                let same = found.filter(|&(id, stroke)| labels.strokes.get(id) == Some(stroke));
                kept += same.count();
                if read.warnings.iter().any(|warning| warning.contains("is damaged")) {
                    salvaged += 1;
                    assert_eq!(fs::read(&path).unwrap(), bytes, "round {round}");
                } else if told {
                    warned += 1;
                } else {
                    unharmed += 1;
                    assert_eq!(labels, truth, "round {round}");
                }
            }
        }
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "round {round}");
    }
    println!("refused {refused}, salvaged {salvaged}, told {warned}, unharmed {unharmed}");
    let share = kept as f64 / ((600 - refused) * truth.strokes.len()) as f64;
    println!("strokes kept: {share:.4}");
    assert!(refused < 60 && salvaged > 100 && unharmed > 50);
    assert!(share > 0.9, "{share}");
}

#[test]
fn what_is_recovered_goes_on_in_a_new_file_beside_the_damaged_one() {
    let folder = tempfile::tempdir().unwrap();
    let (path, contents, mut bytes) = in_a_file(folder.path());
    page(&mut bytes, 1).fill(0);
    fs::write(&path, &bytes).unwrap();
    for name in ["p-recovered.inplace", "p-recovered-2.inplace"] {
        let opened = Opened::open(&path, Owner::Person).unwrap();
        let recovered = folder.path().join(name);
        let sentence = opened.damage.unwrap();
        assert!(
            sentence.starts_with(&format!("{}: is damaged", path.display())),
            "{sentence}"
        );
        assert!(
            sentence.contains(&format!("the work goes on in {}", recovered.display())),
            "{sentence}"
        );
        let mut project = opened.project.unwrap();
        assert_eq!(project.path(), recovered);
        let mut history = opened.contents.history;
        assert_eq!(history.labels(), contents.history.labels());
        assert_eq!(history.edits(), contents.history.edits());
        let edit = history.add_stroke(Stroke::click(0, 1, [9, 9]));
        project.record(&[Step::Do(edit)]).unwrap();
        drop(project);
        let again = Project::open(&recovered).unwrap().1;
        assert_eq!(again.history.labels(), history.labels());
        assert_eq!(fs::read(&path).unwrap(), bytes);
    }
}

#[test]
fn damaged_work_without_a_name_is_put_aside_and_found_again_under_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let (path, contents, mut bytes) = in_a_file(folder.path());
    let strokes = root(&path, "stroke");
    page(&mut bytes, strokes).fill(0xff);
    fs::write(&path, &bytes).unwrap();
    let opened = Opened::open(&path, Owner::Program).unwrap();
    let aside = folder.path().join("p-damaged.inplace");
    let sentence = opened.damage.unwrap();
    assert!(
        sentence.ends_with(&format!("the damaged file is now {}", aside.display())),
        "{sentence}"
    );
    assert_eq!(opened.project.unwrap().path(), path);
    assert_eq!(fs::read(&aside).unwrap(), bytes);
    let opened = Opened::open(&path, Owner::Program).unwrap();
    assert_eq!(opened.damage, None);
    assert_eq!(opened.contents.history.labels(), contents.history.labels());
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
}

#[test]
fn strokes_whose_rows_are_lost_come_back_from_the_edit_history() {
    let folder = tempfile::tempdir().unwrap();
    let (path, contents, _) = in_a_file(folder.path());
    let spoilt = Connection::open(&path).unwrap();
    spoilt
        .execute_batch(
            "DELETE FROM stroke WHERE id > 20; DELETE FROM class WHERE id = 2;
             UPDATE stroke SET lines = '[[' WHERE id = 4; DELETE FROM edit WHERE number = 10",
        )
        .unwrap();
    drop(spoilt);
    let read = Contents::read(&path).unwrap();
    assert_eq!(read.history.labels().strokes, contents.history.labels().strokes);
    let mut classes = read.history.labels().classes.clone();
    classes.sort_by_key(|class| class.id);
    assert_eq!(classes, contents.history.labels().classes);
    let (edits, cursor) = contents.history.edits();
    assert_eq!(read.history.edits(), (&edits[11..], cursor - 11));
    let warning = &read.warnings[0];
    assert!(
        warning.contains("of the strokes from the edit history; lost: 11 edits"),
        "{warning}"
    );
}

#[test]
fn frames_without_names_are_found_by_their_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let (path, contents, mut bytes) = in_a_file(folder.path());
    let frames = root(&path, "frame");
    page(&mut bytes, frames).fill(0);
    fs::write(&path, &bytes).unwrap();
    let options = OpenOptions::default();
    let read = Contents::read(&path).unwrap();
    assert!(
        read.warnings[0].contains("3 names of frames"),
        "{:?}",
        read.warnings
    );
    let same = scene(folder.path(), &["a", "b", "c", "d"]);
    let matched = read.clone().matched(&same, options).unwrap();
    assert_eq!(labelled(&matched), labelled(&contents));
    assert!(matched.warnings[1].contains("taken to be those of the same number: 3"));
    // There are too few frames to tell.
    let fewer = scene(folder.path(), &["a", "b"]);
    assert!(matches!(
        read.matched(&fewer, options),
        Err(ProjectError::OtherScene { .. })
    ));
}

#[test]
fn a_changed_stroke_in_a_whole_file_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let (path, ..) = in_a_file(folder.path());
    let spoilt = Connection::open(&path).unwrap();
    let sql =
        "UPDATE stroke SET lines = '[[[8,8]]]' WHERE id = (SELECT id FROM stroke WHERE frame = 1 LIMIT 1);
               UPDATE frame SET stem = 'b' || char(10, 0) || 'c' WHERE stem = 'b'";
    spoilt.execute_batch(sql).unwrap();
    drop(spoilt);
    let (_project, contents) = Project::open(&path).unwrap();
    assert!(
        contents.warnings[0].contains("differs from its own edit history in strokes on b c (1)"),
        "{:?}",
        contents.warnings
    );
}

#[test]
fn strokes_that_would_take_forever_are_damage() {
    let folder = tempfile::tempdir().unwrap();
    let (path, ..) = in_a_file(folder.path());
    let spoilt = Connection::open(&path).unwrap();
    spoilt
        .execute_batch("UPDATE stroke SET lines = '[[[0,0],[4000000000,4000000000]]]' WHERE id = 5")
        .unwrap();
    drop(spoilt);
    let error = Project::open(&path).unwrap_err().to_string();
    assert!(
        error.contains("stroke 5 is far outside of every image"),
        "{error}"
    );
    let read = Contents::read(&path).unwrap();
    assert!(
        read.history
            .labels()
            .strokes
            .values()
            .all(|stroke| consistency::is_sane(stroke))
    );
}

#[test]
fn numbers_that_leave_none_for_new_strokes_and_imports_are_damage() {
    let endless = u64::MAX;
    for (table, spoilt, said) in [
        (
            "edit",
            format!("change = replace(change, '\"id\":5,', '\"id\":{endless},')"),
            "an import with the number",
        ),
        (
            "edit",
            format!(
                "change = json_insert(change, '$.imported', json('{{\"before\":null,\"after\":{endless}}}'))"
            ),
            "an import with the number",
        ),
        (
            "stroke",
            format!("id = {} WHERE id = 5", i64::MAX),
            "no stroke has the number",
        ),
        ("import", format!("id = {}", i64::MAX), "no import has the number"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let (path, ..) = in_a_file(folder.path());
        let file = Connection::open(&path).unwrap();
        assert!(file.execute(&format!("UPDATE {table} SET {spoilt}"), []).unwrap() > 0);
        drop(file);
        let error = Project::open(&path).unwrap_err().to_string();
        assert!(error.contains(said), "{spoilt}: {error}");
        let mut history = Contents::read(&path).unwrap().history;
        let id = history.add_stroke(Stroke::click(0, 1, [1, 1])).strokes[0].id.0;
        assert!(i64::try_from(id).is_ok(), "{spoilt}: {id}");
    }
}

#[test]
fn files_of_others_are_refused_and_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("p.inplace");
    let refused = || {
        let before = fs::read(&path).unwrap();
        let error = Opened::open(&path, Owner::Person).unwrap_err();
        assert_eq!(error, ProjectError::NotAProject(path.clone()));
        assert_eq!(fs::read(&path).unwrap(), before);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    };
    fs::write(&path, "").unwrap();
    refused();
    fs::write(&path, b"SQLite format 3\0").unwrap();
    refused();
    fs::write(&path, vec![13; 3 * PAGE]).unwrap();
    refused();
    fs::remove_file(&path).unwrap();
    let other = Connection::open(&path).unwrap();
    other
        .execute_batch(
            "CREATE TABLE point (id INTEGER PRIMARY KEY, x INTEGER, y INTEGER, z INTEGER, name TEXT);
             INSERT INTO point VALUES (1, 2, 3, 4, 'a'); CREATE TABLE note (id INTEGER PRIMARY KEY, text TEXT);
             INSERT INTO note VALUES (1, 'hello')",
        )
        .unwrap();
    drop(other);
    refused();
}

#[test]
fn lengths_in_the_file_take_no_memory() {
    let folder = tempfile::tempdir().unwrap();
    let (path, _, whole) = in_a_file(folder.path());
    let edits = root(&path, "edit");
    // Every byte of a page of rows in turn says that something is very long.
    for at in (0..200).chain((0..PAGE).step_by(37)) {
        let mut bytes = whole.clone();
        let rows = page(&mut bytes, edits);
        let end = PAGE.min(at + 9);
        rows[at..end].fill(0xff);
        fs::write(&path, &bytes).unwrap();
        let read = Contents::read(&path).unwrap();
        assert!(read.scene.frames.len() < 2000);
    }
}
