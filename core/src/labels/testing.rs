//! Labels for the core's own tests.

use super::{
    ClassId, History, ImportedLabels, ImportedMap, LabelImages, Object, ObjectId, Pixel, Stroke, Trust,
};

/// A click on a frame.
pub type Click = (usize, ClassId, Pixel);

/// A history of classes 1, 2, ... with these names, and clicks.
pub fn clicked(names: &[&str], clicks: &[Click]) -> History {
    let mut history = History::default();
    for name in names {
        history.add_class(name);
    }
    for &(frame, class, pixel) in clicks {
        history.add_stroke(Stroke::click(frame, class, pixel));
    }
    history
}

/// An object with this number.
pub fn object(number: u16, class: ClassId, name: &str) -> Object {
    Object {
        id: ObjectId::new(number).unwrap(),
        class,
        name: name.to_owned(),
    }
}

/// Numbers and names of objects.
pub fn named(objects: &[Object]) -> Vec<(u16, &str)> {
    let named = objects.iter();
    named
        .map(|object| (object.id.number(), object.name.as_str()))
        .collect()
}

/// Label images that bring neither classes nor objects along.
pub fn label_images(maps: Vec<ImportedMap>, trust: Trust) -> LabelImages {
    ImportedLabels::new(maps, trust).into()
}

/// Imports images that give every pixel of the first three frames, of 64 x 48 pixels, the same class.
pub fn import_plain(history: &mut History, class: ClassId, trust: Trust) {
    let maps = (0..3).map(|frame| ImportedMap::new(frame, &[class; 64 * 48]));
    history.import(label_images(maps.collect(), trust));
}
