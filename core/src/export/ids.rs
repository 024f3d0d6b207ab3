//! Other numbers for the classes: those of a data set that the labels are compared with.

use std::borrow::Cow;
use std::collections::HashMap;
use std::path::Path;

use super::ExportError;
use crate::labels::{Class, ClassId, ClassPalette, PALETTES, VOID, parse_class_list};

/// A list of classes whose numbers, names and colours are exported in place of the project's own, by name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct IdMap(Vec<Class>);

impl IdMap {
    /// The list of a well-known data set.
    pub fn of(palette: &ClassPalette) -> Self {
        Self(palette.classes())
    }

    /// The list of a well-known data set ([`PALETTES`], such as "NYU-40"; capitals do not count), or else a JSON file
    /// `[{"id", "name", "color"}]`.
    ///
    /// # Errors
    /// [`ExportError::UnusableIds`].
    pub fn named(name: &str) -> Result<Self, ExportError> {
        let known = PALETTES
            .iter()
            .find(|palette| palette.name.eq_ignore_ascii_case(name));
        match known {
            Some(palette) => Ok(Self::of(palette)),
            None => Self::read(Path::new(name)),
        }
    }

    fn read(path: &Path) -> Result<Self, ExportError> {
        let classes = std::fs::read_to_string(path)
            .map_err(|error| error.to_string())
            .and_then(|text| parse_class_list(&text));
        classes
            .map(Self)
            .map_err(|reason| ExportError::UnusableIds(path.to_path_buf(), reason))
    }

    /// The names of classes that are not in the list, and so become void.
    pub fn missing<'a>(&self, classes: &'a [Class]) -> Vec<&'a str> {
        let is_listed = |class: &&Class| self.0.iter().any(|listed| listed.is_named(&class.name));
        let missing = classes.iter().filter(|class| !is_listed(class));
        missing.map(|class| class.name.as_str()).collect()
    }

    /// What the ids of these classes become. Only classes that are there are exported.
    fn of_classes(&self, classes: &[Class]) -> Ids<'static> {
        let listed = |class: &Class| self.0.iter().find(|listed| listed.is_named(&class.name));
        let new: HashMap<ClassId, ClassId> = classes
            .iter()
            .filter_map(|class| Some((class.id, listed(class)?.id)))
            .collect();
        // Whether a class is a thing is what the project says, as its objects follow from that.
        let is_thing = |id: ClassId| {
            let own = classes.iter().filter(|class| new.get(&class.id) == Some(&id));
            own.map(|class| class.thing).reduce(|a, b| a || b)
        };
        let exported = self.0.iter().filter_map(|class| {
            let thing = is_thing(class.id)?;
            Some(Class {
                thing,
                ..class.clone()
            })
        });
        let exported = exported.collect();
        Ids {
            classes: exported,
            new: Some(new),
        }
    }
}

/// Exported ids by own ids.
pub(super) struct Ids<'a> {
    /// `None` where they are the same.
    new: Option<HashMap<ClassId, ClassId>>,
    classes: Cow<'a, [Class]>,
}

impl<'a> Ids<'a> {
    /// Those of a project's classes, which keep their own unless a list has other ones.
    pub(super) fn new(classes: &'a [Class], list: Option<&IdMap>) -> Self {
        match list {
            Some(list) => list.of_classes(classes),
            None => Self {
                new: None,
                classes: Cow::Borrowed(classes),
            },
        }
    }

    /// The exported id; void for classes without one.
    pub(super) fn of(&self, own: ClassId) -> ClassId {
        match &self.new {
            Some(new) => new.get(&own).copied().unwrap_or(VOID),
            None => own,
        }
    }

    /// The exported classes, in the order of their list.
    pub(super) fn classes(&self) -> &[Class] {
        &self.classes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_of_ones_own_is_read_and_a_bad_one_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("ids.json");
        std::fs::write(&path, r#"[{"id": 300, "name": "lobster"}]"#).unwrap();
        let map = IdMap::named(path.to_str().unwrap()).unwrap();
        assert_eq!(map.of_classes(&[Class::new(3, "lobster")]).of(3), 300);
        std::fs::write(&path, "{").unwrap();
        let error = IdMap::named(path.to_str().unwrap()).unwrap_err().to_string();
        assert!(error.contains("ids.json"), "{error}");
        let error = IdMap::named("nyu-41").unwrap_err().to_string();
        assert!(error.contains("nyu-41") && error.contains("NYU-40"), "{error}");
    }
}
