//! Files that are projects by their tables, and hold what no project does.

use super::*;
use rusqlite::Connection;

/// What opening says of a project that was changed by these statements: the error, or the warnings.
fn opened(changes: &str) -> Result<Vec<String>, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("p.inplace");
    let mut whole = contents(folder.path());
    whole.maps = vec![map(0, 1, 1)];
    drop(Project::create(&path, &whole).unwrap());
    let file = Connection::open(&path).unwrap();
    file.execute_batch(changes).unwrap();
    drop(file);
    let opened = Project::open(&path).map_err(|error| error.to_string());
    opened.map(|(_, contents)| contents.warnings)
}

#[test]
fn strokes_that_no_image_can_hold_are_damage_in_the_labels_and_in_the_edits() {
    assert_eq!(opened(""), Ok(Vec::new()));
    // An image may have become smaller since a stroke was drawn.
    let warnings = opened("UPDATE stroke SET lines = '[[[65535, 9]]]'").unwrap();
    assert!(
        warnings[0].contains("differs from its own edit history"),
        "{warnings:?}"
    );
    let edit = |id: u64, frame: usize, x: u32| {
        format!(
            r#"UPDATE edit SET change = '{{"name": "", "classes": null, "strokes": [{{"id": {id}, "before": null,
            "after": {{"frame": {frame}, "class": 1, "radius": 0, "lines": [[[{x}, 0]]]}}}}]}}' WHERE number = 2"#
        )
    };
    assert!(opened(&edit(1, 0, 2)).is_ok());
    for (changes, reason) in [
        (
            "UPDATE stroke SET lines = '[[[0, 0], [4294967295, 0]]]'".to_owned(),
            "outside of every image",
        ),
        (edit(1, 0, 70_000), "a frame or a pixel that there is not"),
        (edit(1, 9, 0), "a frame or a pixel that there is not"),
        (edit(u64::MAX, 0, 0), "with the number 18446744073709551615"),
    ] {
        let error = opened(&changes).unwrap_err();
        assert!(error.contains("damaged") && error.contains(reason), "{error}");
    }
}

#[test]
fn a_map_of_another_size_than_its_frame_is_left_out_with_a_warning() {
    let warnings = opened("UPDATE frame SET width = 4 WHERE number = 0").unwrap();
    assert!(
        warnings.len() == 1 && warnings[0].contains("where its frame has 4x"),
        "{warnings:?}"
    );
}

#[test]
fn a_schema_that_would_run_something_is_refused() {
    for changes in [
        "CREATE TRIGGER t AFTER INSERT ON edit BEGIN DELETE FROM stroke; END",
        "CREATE VIEW v AS SELECT 1",
    ] {
        let error = opened(changes).unwrap_err();
        assert!(error.contains("views or triggers"), "{error}");
    }
}
