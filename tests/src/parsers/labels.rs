//! Files of labels: strokes, class lists and label images.

use std::collections::BTreeSet;
use std::sync::LazyLock;

use inplace_core::export::IdMap;
use inplace_core::labels::{
    Class, ImportedMap, LabelSet, decode_gray, parse_class_list, parse_strokes, rasterise, strokes_json,
};
use inplace_core::scene::Scene;

use super::{Parser, assert_sentence, two_frames, write};

pub(super) const STROKES: Parser = Parser::alone("strokes", |_, bytes| {
    static SCENE: LazyLock<Scene> = LazyLock::new(|| two_frames([64, 48]));
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    let labels = match parse_strokes(text, &SCENE) {
        Ok(labels) => labels,
        Err(reason) => return assert_sentence(&reason),
    };
    let pixels = |labels: &LabelSet, frame: usize| -> Vec<(u32, u16)> {
        let camera = &SCENE.frames[frame].camera;
        let pixels = rasterise(labels, frame, camera.width, camera.height);
        pixels
            .into_iter()
            .map(|(pixel, (class, _))| (pixel, class))
            .collect()
    };
    let back = parse_strokes(&strokes_json(&labels, &SCENE.frames), &SCENE);
    let back = back.expect("what is written can be read");
    assert_eq!(back.classes, labels.classes);
    // A lens rounds.
    assert_eq!(pixels(&back, 0), pixels(&labels, 0));
    pixels(&labels, 1);
});

pub(super) const CLASSES: Parser = Parser::alone("classes", |_, bytes| {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    let classes = match parse_class_list(text) {
        Ok(classes) => classes,
        Err(reason) => return assert_sentence(&reason),
    };
    let ids: BTreeSet<u16> = classes.iter().map(|class| class.id).collect();
    assert!(!ids.contains(&0) && ids.len() == classes.len(), "{classes:?}");
    assert!(classes.iter().all(|class| !class.name.is_empty()), "{classes:?}");
    let written = serde_json::json!(classes).to_string();
    assert_eq!(
        parse_class_list(&written).expect("it is a list of classes"),
        classes
    );
});

/// A list of classes whose numbers exports take in place of the project's.
pub(super) const IDS: Parser = Parser::alone("ids", |folder, bytes| {
    let path = folder.join("ids.json");
    write(&path, bytes);
    let ids = match IdMap::named(&path.to_string_lossy()) {
        Ok(ids) => ids,
        Err(error) => return assert_sentence(&error.to_string()),
    };
    let listed = std::str::from_utf8(bytes).expect("it was read as text");
    let listed = parse_class_list(listed).expect("it is a list of classes");
    let own = [(1, "wall"), (2, "Floor"), (300, "lobster")].map(|(id, name)| Class::new(id, name));
    let missing = ids.missing(&own);
    for name in own.iter().map(|class| class.name.as_str()) {
        let is_listed = listed.iter().any(|class| class.is_named(name));
        assert_ne!(missing.contains(&name), is_listed, "{name}");
    }
});

pub(super) const LABEL_IMAGE: Parser = Parser::alone("label_image", |_, bytes| match decode_gray(bytes) {
    Ok((width, height, values)) => {
        assert_eq!(values.len(), width as usize * height as usize);
        assert_eq!(ImportedMap::new(0, &values).labels(), values);
    }
    Err(reason) => assert_sentence(&reason.to_string()),
});
