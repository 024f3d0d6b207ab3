//! A file of every version is kept, and opens.

use super::*;

const FIXTURES: [&str; VERSION as usize] = [
    include_str!("../fixtures/v1.sql"),
    include_str!("../fixtures/v2.sql"),
    include_str!("../fixtures/v3.sql"),
    include_str!("../fixtures/v4.sql"),
];

/// A file of this version, changed by these statements.
fn file(folder: &Path, version: usize, changes: &str) -> PathBuf {
    let path = folder.join("p.inplace");
    let old = Connection::open(&path).unwrap();
    old.execute_batch(FIXTURES[version - 1]).unwrap();
    assert_eq!(schema::version(&old).unwrap(), version as i64);
    old.execute_batch(changes).unwrap();
    path
}

#[test]
fn a_file_of_every_version_opens_and_reads_the_same_where_it_cannot_be_written() {
    for version in 1..=FIXTURES.len() {
        for trust in ["", "UPDATE import SET trust = 'trusted'"] {
            let folder = tempfile::tempdir().unwrap();
            let path = file(folder.path(), version, if version == 2 { trust } else { "" });
            let uri = format!("file:{}?immutable=1", path.display());
            let flags = rusqlite::OpenFlags::SQLITE_OPEN_READ_ONLY | rusqlite::OpenFlags::SQLITE_OPEN_URI;
            let connection = Connection::open_with_flags(uri, flags).unwrap();
            schema::check(&connection).unwrap();
            let as_it_is = rows::read(&connection, &path).unwrap();
            drop(connection);
            let opened = Opened::open(&path).unwrap();
            assert_eq!(opened.damage, None);
            assert!(opened.contents.warnings.is_empty());
            assert_same(&opened.contents, &as_it_is);
            let project = opened.project.unwrap();
            assert_eq!(schema::version(&project.connection).unwrap(), VERSION);
        }
    }
}

#[test]
fn files_of_version_1_come_with_their_history() {
    let folder = tempfile::tempdir().unwrap();
    let path = file(folder.path(), 1, "");
    let (mut project, mut saved) = Project::open(&path).unwrap();
    let expected = [("rgb_0", 1), ("rgb_5", 2)].map(|(stem, class)| (stem.to_owned(), class));
    assert_eq!(labelled(&saved), expected);
    assert_eq!(saved.history.undo_name(), Some("scribble floor"));
    assert_eq!(saved.history.redo_name(), Some("erase"));
    assert_eq!(saved.view.as_deref(), Some("{}"));
    assert!(saved.history.imports().0.is_empty());
    saved.history.redo().unwrap();
    project.record(&[Step::Redo]).unwrap();
    drop(project);
    assert_same(&Project::open(&path).unwrap().1, &saved);
}

#[test]
fn classes_of_earlier_versions_are_things_by_their_names_and_later_ones_have_objects_and_checked_frames() {
    for version in 1..=FIXTURES.len() {
        let folder = tempfile::tempdir().unwrap();
        let change = if version < 4 {
            "UPDATE class SET name = 'door' WHERE id = 2"
        } else {
            ""
        };
        let (_project, saved) = Project::open(&file(folder.path(), version, change)).unwrap();
        let labels = saved.history.labels();
        let things: Vec<bool> = labels.classes.iter().map(|class| class.thing).collect();
        if version < 4 {
            assert_eq!((things, labels.objects.len()), (vec![false, true], 0));
            continue;
        }
        assert_eq!(things, [false, false, true]);
        let of_chair = labels
            .strokes
            .values()
            .filter_map(|stroke| Some((stroke.class, stroke.object?)));
        assert_eq!(of_chair.collect::<Vec<_>>(), [(3, labels.objects[0].id)]);
        assert_eq!(labels.objects[0].name, "chair 1");
        let checked: Vec<usize> = labels.checked.iter().copied().collect();
        assert_eq!(checked, [1]);
    }
}

#[test]
fn files_of_later_versions_come_with_their_label_images() {
    for (version, changes, trust) in [
        (2, "", Trust::VOTES),
        (2, "UPDATE import SET trust = 'trusted'", Trust::RIGHT),
        (3, "", Trust::new(0.25).unwrap()),
        (4, "", Trust::new(0.25).unwrap()),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let (_project, saved) = Project::open(&file(folder.path(), version, changes)).unwrap();
        assert_eq!(saved.history.undo_name(), Some("import predictions"));
        let images = saved.history.labels().imported.clone().unwrap();
        let told = images.maps.iter().map(|map| map.frame);
        let frames: &[usize] = if version < 4 { &[1] } else { &[0, 1] };
        assert_eq!((images.trust, told.collect::<Vec<_>>()), (trust, frames.to_vec()));
        let map = images.of_frame(1).unwrap();
        if let [of_objects, _] = images.maps.as_slice() {
            let said = of_objects.objects().unwrap();
            let chair = saved.history.labels().objects[0].id;
            assert_eq!(
                (of_objects.labels()[200], said[159], said[160]),
                (3, Some(chair), None)
            );
        }
        if version == 2 {
            let labels = map.labels();
            assert_eq!((labels[0], labels[320 * 240 - 1]), (1, 2));
            continue;
        }
        let grid = map.probabilities().unwrap();
        assert_eq!((grid.size(), map.pixels()), ([2, 1], 320 * 240));
        let cells: Vec<Vec<(u16, f32)>> = grid.cells().iter().map(|cell| cell.iter().collect()).collect();
        let first = vec![(1, 204.0 / 255.0), (2, 51.0 / 255.0)];
        assert_eq!(cells, [first, vec![(2, 1.0)]]);
    }
}
