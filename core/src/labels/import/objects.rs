//! `objects.json`: the objects that images of their numbers show.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use serde::Deserialize;

use super::ImportError;
use crate::labels::{Class, ClassId, Label, Object, ObjectId, VOID};
use crate::scene::in_one_line;

/// An entry of `objects.json`. What else it holds, such as the number of pixels, follows from the images.
#[derive(Deserialize)]
struct Record {
    id: ObjectId,
    class_id: ClassId,
    class_name: Option<String>,
    thing: Option<bool>,
    name: Option<String>,
}

/// What the numbers in images of objects stand for.
pub(super) struct ObjectList {
    /// The things.
    pub objects: Vec<Object>,
    /// The label of each number: all of a class that is stuff says only the class.
    labels: BTreeMap<u16, Label>,
}

impl ObjectList {
    /// Reads the file. The classes of `listed` are named already; those that are not are added, and which of them are things
    /// is what the objects say. Other classes may be `known` by their ids.
    pub fn read(path: &Path, listed: &mut Vec<Class>, known: &[Class]) -> Result<Self, ImportError> {
        let text = fs::read_to_string(path).map_err(|error| error.to_string());
        // Some editors save a byte order mark before the text.
        let json = |text: String| serde_json::from_str(text.trim_start_matches('\u{feff}'));
        let records = text.and_then(|text| json(text).map_err(in_one_line));
        let list = records.and_then(|records| Self::new(records, listed, known));
        list.map_err(|reason| {
            let expected =
                r#"it must hold [{"id": 2, "class_id": 5, "class_name": "chair", "name": "chair 1"}, ...]"#;
            ImportError::new(path, format!("cannot be used: {reason}; {expected}"))
        })
    }

    fn new(records: Vec<Record>, listed: &mut Vec<Class>, known: &[Class]) -> Result<Self, String> {
        for record in &records {
            let id = record.class_id;
            if id == VOID {
                return Err(format!(
                    "object {} is of class 0, which is void",
                    record.id.number()
                ));
            }
            let class = listed.iter_mut().find(|class| class.id == id);
            match (class, &record.class_name) {
                (Some(class), Some(name)) if !class.is_named(name) => {
                    return Err(format!("class {id} is called {} and {name}", class.name));
                }
                (Some(class), _) => class.thing = record.thing.unwrap_or(class.thing),
                (None, Some(name)) => {
                    let class = Class::new(id, name.trim());
                    let thing = record.thing.unwrap_or(class.thing);
                    listed.push(Class { thing, ..class });
                }
                (None, None) => {}
            }
        }
        let mut names: BTreeSet<String> = records.iter().filter_map(|record| record.name.clone()).collect();
        let mut numbers: BTreeMap<ClassId, u32> = BTreeMap::new();
        let (mut objects, mut labels) = (Vec::new(), BTreeMap::new());
        for record in records {
            let mut classes = listed.iter().chain(known);
            let class = classes.find(|class| class.id == record.class_id);
            let is_thing = class.map_or(record.thing != Some(false), |class| class.thing);
            let label = Label::new(record.class_id, is_thing.then_some(record.id));
            if labels.insert(record.id.number(), label).is_some() {
                return Err(format!("object {} is there twice", record.id.number()));
            }
            if !is_thing {
                continue;
            }
            let named = record.name.filter(|name| !name.trim().is_empty());
            let name = named.unwrap_or_else(|| {
                let class = class.map_or("object", |class| class.name.as_str());
                let number = numbers.entry(record.class_id).or_default();
                loop {
                    *number += 1;
                    let name = format!("{class} {number}");
                    if names.insert(name.clone()) {
                        return name;
                    }
                }
            });
            objects.push(Object {
                id: record.id,
                class: record.class_id,
                name,
            });
        }
        Ok(Self { objects, labels })
    }

    /// The label of a pixel with this number; `None` for a number that is not listed.
    pub fn label(&self, number: u16) -> Option<Label> {
        self.labels.get(&number).copied()
    }
}
