//! Label images and probabilities from elsewhere.

use std::path::Path;
use std::sync::LazyLock;

use inplace_core::labels::{
    Class, History, ImportedMap, LabelImages, LabelSet, Trust, VOID, read_label_images,
};
use inplace_core::scene::Scene;

use super::{Parser, SIZE, assert_sentence, make, two_frames, write};

static SCENE: LazyLock<Scene> = LazyLock::new(|| two_frames(SIZE));

/// The classes of the project that the images come to, one of which the images' colours can mean.
fn known() -> Vec<Class> {
    let door = Class {
        color: [200, 0, 0],
        ..Class::new(9, "door")
    };
    vec![Class::new(1, "wall"), door]
}

/// `classes.json` of a folder: void among them, so that an array may have a channel for it or not.
const LISTED: &str = r#"[{"id": 0, "name": "void"}, {"id": 4, "name": "floor", "color": [10, 20, 30]},
    {"id": 9, "name": "door", "color": [200, 0, 0]}]"#;

/// `objects.json` of a folder.
const OBJECTS_LISTED: &str = r#"[{"id": 1, "class_id": 4, "class_name": "floor", "thing": false},
    {"id": 2, "class_id": 9, "name": "the door"}, {"id": 300, "class_id": 5, "class_name": "chair"}]"#;

/// Writes the folders `plain`, `listed`, with a list of classes, and `numbers`, with a list of objects.
fn prepare(folder: &Path) {
    make(folder, &["plain", "listed", "numbers"]);
    write(&folder.join("listed/classes.json"), LISTED);
    write(&folder.join("numbers/objects.json"), OBJECTS_LISTED);
}

/// Writes a folder `objects` with numbers from 0 to 5 for each frame.
fn prepare_numbers(folder: &Path) {
    let [width, height] = SIZE;
    let image = image::GrayImage::from_fn(width, height, |x, _| image::Luma([x as u8 % 6]));
    make(folder, &["objects"]);
    for frame in &SCENE.frames {
        let path = folder.join(format!("objects/{}.png", frame.stem));
        image.save(path).expect("the temporary folder can be written");
    }
}

/// Reads a folder as a person would, and asserts what holds of whatever comes of it.
fn read(folder: &Path, trust: Trust) -> Option<LabelImages> {
    let images = match read_label_images(folder, &SCENE, &known(), trust) {
        Ok(images) => images,
        Err(error) => {
            assert_sentence(&error.to_string());
            return None;
        }
    };
    assert_eq!(images.unmatched, 0);
    let classes = images.labels.classes();
    assert!(!classes.is_empty() && !classes.contains(&VOID), "{classes:?}");
    for map in &images.labels.maps {
        check_map(map);
    }
    let mut history = History::new(LabelSet::of_classes(known()));
    history.import(images.clone());
    let labels = history.labels();
    let imported = labels.imported.as_ref().expect("the images were imported");
    let named = |id| labels.class(id).is_some_and(|class| !class.name.is_empty());
    assert!(imported.classes().into_iter().all(named), "{:?}", labels.classes);
    let listed = |id| {
        labels
            .object(id)
            .is_some_and(|object| labels.class(object.class).is_some())
    };
    assert!(imported.objects().into_iter().all(listed), "{:?}", labels.objects);
    assert!(history.undo().is_some());
    assert_eq!(
        (&history.labels().classes, history.labels().objects.len()),
        (&known(), 0)
    );
    Some(images)
}

fn check_map(map: &ImportedMap) {
    let camera = &SCENE.frames[map.frame].camera;
    assert_eq!(map.pixels(), camera.pixels());
    let labels = map.labels();
    assert_eq!(labels.len(), camera.pixels());
    let Some(grid) = map.probabilities() else {
        return;
    };
    let [columns, rows] = grid.size();
    assert!((1..=camera.width).contains(&columns) && (1..=camera.height).contains(&rows));
    assert_eq!(grid.cells().len(), columns as usize * rows as usize);
    for cell in grid.cells() {
        let said: Vec<(u16, f32)> = cell.iter().collect();
        assert!(said.is_sorted_by(|a, b| a.1 >= b.1), "{said:?}");
        for &(class, p) in &said {
            assert!(class != VOID && p > 0.0 && p <= 1.0, "{said:?}");
        }
        // Four roundings, and what the sum of a file's values may be off by.
        assert!(said.iter().map(|&(_, p)| p).sum::<f32>() < 1.06, "{said:?}");
    }
}

/// Asserts what holds of the same file of both frames, in a folder without a list, in one with a list of classes, and in one
/// with a list of objects.
fn check(folder: &Path, extension: &str, bytes: &[u8]) {
    for name in ["plain", "listed", "numbers"] {
        let folder = folder.join(name);
        for frame in &SCENE.frames {
            write(&folder.join(format!("{}.{extension}", frame.stem)), bytes);
        }
        let maps = |trust| read(&folder, trust).map(|images| images.labels.maps);
        let (votes, right) = (maps(Trust::VOTES), maps(Trust::RIGHT));
        assert!(extension != "png" || votes == right);
    }
}

/// A PNG of ids, indices of a palette or colours.
pub(super) const IMAGE: Parser = Parser::new("imported_image", prepare, |folder, bytes| {
    check(folder, "png", bytes);
});

/// An array of probabilities.
pub(super) const ARRAY: Parser = Parser::new("imported_npy", prepare, |folder, bytes| {
    check(folder, "npy", bytes);
});

/// An archive with an array of probabilities.
pub(super) const ARCHIVE: Parser = Parser::new("imported_npz", prepare, |folder, bytes| {
    check(folder, "npz", bytes);
});

/// A list of objects.
pub(super) const OBJECTS: Parser = Parser::new("imported_objects", prepare_numbers, |folder, bytes| {
    write(&folder.join("objects.json"), bytes);
    read(folder, Trust::VOTES);
});
