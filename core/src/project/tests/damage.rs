//! Damaged files, files of other programs, and files that are projects by their tables and hold what no project does.

use super::*;

/// What opening says of a project that was changed by these statements: the error, or the warnings.
fn opened(changes: &str) -> Result<Vec<String>, ProjectError> {
    let (folder, path) = place();
    let mut whole = contents(folder.path());
    whole.history.import(images(1));
    whole.history.import(probabilities());
    whole.maps = vec![map(0, 1, 1)];
    drop(Project::create(&path, &whole).unwrap());
    let file = Connection::open(&path).unwrap();
    file.execute_batch(changes).unwrap();
    drop(file);
    Project::open(&path).map(|(_, contents)| contents.warnings)
}

/// Changes to a project, each with what is said of it: `statements -> words`.
fn cases(table: &str) -> impl Iterator<Item = (&str, &str)> {
    table.trim().lines().map(|line| {
        let (changes, words) = line.split_once("->").unwrap();
        (changes.trim(), words.trim())
    })
}

/// What no project holds. Nothing in a file is run: views and triggers are none of ours.
const DAMAGES: &str = r"
DELETE FROM project ->
DELETE FROM edit -> edits are missing
PRAGMA user_version = 0 -> there never was a file version 0
UPDATE stroke SET lines = '[[1' ->
UPDATE stroke SET radius = -1 ->
UPDATE stroke SET frame = 9 -> is on a frame that it does not list
UPDATE stroke SET class = 9 -> is of a class that it does not list
UPDATE stroke SET lines = '[[[0, 0], [4294967295, 0]]]' -> outside of every image
UPDATE stroke SET id = 9223372036854775807 WHERE id = 1 -> no stroke has the number
UPDATE import SET id = 9223372036854775807 WHERE id = 1 -> no import has the number
UPDATE project SET imported = 5 -> imported label images are missing
INSERT INTO imported_map VALUES (1, 1, x'00', NULL, NULL) -> an imported label image is unusable
UPDATE imported_map SET objects = x'00' WHERE import = 1 -> an imported label image is unusable
UPDATE imported_map SET shares = labels -> an imported label image is unusable
UPDATE project SET scene = 'folder', relative_path = NULL, absolute_path = NULL -> it does not say where its scene is
CREATE TRIGGER t AFTER INSERT ON edit BEGIN DELETE FROM stroke; END -> views or triggers
CREATE VIEW v AS SELECT 1 -> views or triggers
";

#[test]
fn what_no_project_holds_is_damage() {
    assert_eq!(opened(""), Ok(Vec::new()));
    let edit = |id: u64, frame: usize, x: u32| {
        format!(
            r#"UPDATE edit SET change = '{{"name": "", "classes": null, "strokes": [{{"id": {id}, "before": null,
            "after": {{"frame": {frame}, "class": 1, "radius": 0, "lines": [[[{x}, 0]]]}}}}]}}' WHERE number = 2"#
        )
    };
    assert!(opened(&edit(1, 0, 2)).is_ok());
    let edits = [
        (&*edit(1, 0, 70_000), "a frame or a pixel that there is not"),
        (&*edit(1, 9, 0), "a frame or a pixel that there is not"),
        // There must be numbers for new strokes and imports.
        (&*edit(u64::MAX, 0, 0), "with the number 18446744073709551615"),
    ];
    for (changes, reason) in cases(DAMAGES).chain(edits) {
        let error = opened(changes).unwrap_err();
        let is_damage = matches!(error, ProjectError::Damaged { .. });
        assert!(
            is_damage && error.to_string().contains(reason),
            "{changes}: {error}"
        );
    }
    let newer = opened("PRAGMA user_version = 5").unwrap_err().to_string();
    let told = "newer Inplace (file version 5, this program reads up to 4)";
    assert!(newer.contains(told), "{newer}");
}

/// What can be made again or differs from the history. An image may have become smaller since a stroke was drawn.
const DIFFERENCES: &str = r"
UPDATE frame SET stem = 'a' || char(10, 0) || 'z' WHERE number = 0; UPDATE stroke SET lines = '[[[8,8]]]' WHERE frame = 0 -> differs from its own edit history in strokes on a z (1)
UPDATE stroke SET lines = '[[[65535, 9]]]' -> differs from its own edit history in strokes on a, c (2)
UPDATE class SET name = 'roof' WHERE id = 1 -> edit history in the classes
UPDATE map SET labels = x'00' -> the saved map of frame 0 is left out
UPDATE map SET entropy = (SELECT labels FROM imported_map WHERE import = 2 AND frame = 0) -> the saved map of frame 0 is left out
";

#[test]
fn what_can_be_made_again_or_differs_from_the_history_is_a_warning() {
    for (changes, warning) in cases(DIFFERENCES) {
        let warnings = opened(changes).unwrap();
        let is_told = warnings.len() == 1 && warnings[0].contains(warning);
        assert!(is_told, "{changes}: {warnings:?}");
    }
}

#[test]
fn files_of_others_are_refused_with_a_sentence_and_left_alone() {
    let (folder, path) = place();
    let missing = ProjectError::Missing(path.clone());
    assert_eq!(Opened::open(&path).unwrap_err(), missing);
    let refused = || {
        let before = fs::read(&path).unwrap();
        let error = Opened::open(&path).unwrap_err();
        assert_eq!(error, ProjectError::NotAProject(path.clone()));
        assert_eq!(fs::read(&path).unwrap(), before);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    };
    for bytes in [&b""[..], b"hello", b"SQLite format 3\0", &[13; 3 * 4096]] {
        fs::write(&path, bytes).unwrap();
        refused();
    }
    fs::remove_file(&path).unwrap();
    let other = Connection::open(&path).unwrap();
    other.execute_batch("CREATE TABLE t (x)").unwrap();
    drop(other);
    refused();
}
