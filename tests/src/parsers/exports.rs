//! What exports are told by files: the numbers of a data set's classes.

use std::collections::BTreeMap;
use std::fs;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::{Arc, LazyLock};

use inplace_core::export::{Format, IdMap, LabelledScene, Options, export};
use inplace_core::labels::{Class, ClassId, VOID, decode_gray, parse_class_list};
use inplace_core::scene::Scene;
use inplace_core::session::FrameMap;

use super::{Parser, SIZE, assert_sentence, two_frames};

static SCENE: LazyLock<Scene> = LazyLock::new(|| two_frames(SIZE));
/// Labels of the pixels of every frame, one after the other.
const LABELS: [ClassId; 4] = [VOID, 1, 2, 300];

fn own_classes() -> [Class; 3] {
    [(1, "wall"), (2, "Floor"), (300, "lobster")].map(|(id, name)| Class::new(id, name))
}

fn map(frame: usize) -> Arc<FrameMap> {
    let camera = &SCENE.frames[frame].camera;
    let labels = LABELS.iter().copied().cycle().take(camera.pixels()).collect();
    let size = [camera.width, camera.height];
    let map = FrameMap::new(frame, 1, size, labels, vec![0; camera.pixels()]);
    Arc::new(map.expect("a value for each pixel"))
}

/// A list of classes whose numbers take the place of the project's.
pub(super) const IDS: Parser = Parser {
    name: "ids",
    prepare: |_| {},
    check: |folder, bytes| {
        let path = folder.join("ids.json");
        fs::write(&path, bytes).expect("the temporary folder can be written");
        let ids = match IdMap::named(&path.to_string_lossy()) {
            Ok(ids) => ids,
            Err(error) => return assert_sentence(&error.to_string()),
        };
        let listed = std::str::from_utf8(bytes).expect("it was read as text");
        let listed = parse_class_list(listed).expect("it is a list of classes");
        let own = own_classes();
        let expected: BTreeMap<ClassId, Class> = own
            .iter()
            .filter_map(|class| {
                let found = listed.iter().find(|listed| listed.is_named(&class.name))?;
                Some((class.id, found.clone()))
            })
            .collect();
        let missing = ids.missing(&own);
        assert!(
            own.iter()
                .all(|class| missing.contains(&class.name.as_str()) != expected.contains_key(&class.id))
        );
        check_exported(&folder.join("exported"), ids, &expected);
    },
};

/// Asserts that exported label images have the expected classes in place of the project's, and void for the others.
fn check_exported(folder: &Path, ids: IdMap, expected: &BTreeMap<ClassId, Class>) {
    let labelled = LabelledScene {
        scene: &SCENE,
        classes: &own_classes(),
        maps: &[map(0), map(1)],
    };
    let options = Options {
        ids: Some(ids),
        ..Options::default()
    };
    let progress = |_, _| ControlFlow::Continue(());
    export(folder, labelled, Format::Png, &options, &progress).expect("label images have any ids");
    let png = fs::read(folder.join("labels/rgb_0.png")).expect("the label image was written");
    let (_, _, values) = decode_gray(&png).expect("it is a label image");
    let id = |own: ClassId| expected.get(&own).map_or(VOID, |class| class.id);
    assert_eq!(values[..LABELS.len()], LABELS.map(id));
    let text = fs::read_to_string(folder.join("classes.json")).expect("the list was written");
    let written = parse_class_list(&text).expect("it is a list of classes");
    assert_eq!(written.len(), expected.len());
    assert!(
        expected.values().all(|class| written.contains(class)),
        "{written:?}"
    );
}
