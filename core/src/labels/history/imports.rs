//! Edits of the label images from elsewhere, and those images themselves.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::History;
use crate::labels::{Class, Edit, ImportChange, ImportId, ImportedLabels, LabelImages};

impl History {
    /// The same history with the label images that its edits name; `imported` are those in force.
    #[must_use]
    pub fn with_imports(
        mut self,
        imports: BTreeMap<ImportId, Arc<ImportedLabels>>,
        imported: Option<ImportId>,
    ) -> Self {
        self.labels.imported = imported.and_then(|id| imports.get(&id)).cloned();
        self.imported = imported.filter(|id| imports.contains_key(id));
        let named = self.edits.iter().filter_map(|edit| edit.imported);
        let named = named.flat_map(|change| [change.before, change.after]).flatten();
        let ever = named.chain(imports.keys().copied()).map(|id| id.0);
        self.last_import = ever.max().unwrap_or(0);
        self.imports = imports;
        self
    }

    /// The label images that the edits name, and which of them are in force.
    pub fn imports(&self) -> (&BTreeMap<ImportId, Arc<ImportedLabels>>, Option<ImportId>) {
        (&self.imports, self.imported)
    }

    /// The label images that an edit brings.
    pub fn brought_by(&self, edit: &Edit) -> Option<(ImportId, &Arc<ImportedLabels>)> {
        let id = edit.imported?.after?;
        Some((id, self.imports.get(&id)?))
    }

    /// Takes label images over that an edit to [`History::adopt`] names.
    pub fn adopt_import(&mut self, id: ImportId, images: Arc<ImportedLabels>) {
        self.last_import = self.last_import.max(id.0);
        self.imports.insert(id, images);
    }

    /// Takes label images from elsewhere over, in place of earlier ones.
    ///
    /// An id that comes with a name is the class of that name (capitals aside), and otherwise a new class, with
    /// another id if its own is taken. An id without a name is the class with that id, or a new one.
    pub fn import(&mut self, images: LabelImages) -> Edit {
        let what = if images.labels.trust.is_right() {
            "labels"
        } else {
            "predictions"
        };
        let before = self.labels.classes.clone();
        let mut classes = before.clone();
        let mut becomes = BTreeMap::new();
        let mut displaced = Vec::new();
        for id in images.labels.classes() {
            let has = |class: &Class| class.id == id;
            match images.classes.iter().find(|class| class.id == id) {
                Some(named) => match classes.iter().find(|known| known.is_named(&named.name)) {
                    Some(known) => {
                        becomes.insert(id, known.id);
                    }
                    None if classes.iter().any(has) => displaced.push(named),
                    None => classes.push(named.clone()),
                },
                None if classes.iter().any(has) => {}
                None => classes.push(Class::new(id, format!("class {id}"))),
            }
        }
        // Only now, so that no id is given that an image uses.
        for named in displaced {
            let id = self.unused_class_id(&classes);
            becomes.insert(named.id, id);
            classes.push(Class { id, ..named.clone() });
        }
        let images = images
            .labels
            .relabelled(|class| becomes.get(&class).copied().unwrap_or(class));
        let imported = self.change_import(Some(images));
        self.commit(Edit {
            name: format!("import {what}"),
            classes: (before != classes).then_some((before, classes)),
            imported: Some(imported),
            ..Edit::default()
        })
    }

    /// Removes the label images from elsewhere; `None` when there are none.
    pub fn remove_imported(&mut self) -> Option<Edit> {
        self.imported?;
        let imported = self.change_import(None);
        Some(self.commit(Edit {
            name: "remove imported labels".to_owned(),
            imported: Some(imported),
            ..Edit::default()
        }))
    }

    /// A change to these images, which get an id.
    pub(super) fn change_import(&mut self, images: Option<ImportedLabels>) -> ImportChange {
        let after = images.map(|images| {
            self.last_import += 1;
            let id = ImportId(self.last_import);
            self.imports.insert(id, Arc::new(images));
            id
        });
        ImportChange {
            before: self.imported,
            after,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::history::tests::history;
    use crate::labels::{ImportedMap, Trust};

    #[test]
    fn an_import_is_undone_redone_merged_and_removed_like_any_edit() {
        let (mut history, wall, floor) = history();
        let images = ImportedLabels {
            maps: vec![ImportedMap::new(1, &[wall, floor, 9])],
            trust: Trust::VOTES,
        };
        let mut classes = history.labels().classes.clone();
        classes.push(Class::new(9, "lamp"));
        let mut mirror = history.clone();
        let edit = history.import(LabelImages {
            labels: images.clone(),
            classes: vec![Class::new(9, "lamp")],
            unmatched: 0,
        });
        let (id, brought) = history.brought_by(&edit).unwrap();
        mirror.adopt_import(id, Arc::clone(brought));
        mirror.adopt(edit);
        assert_eq!(mirror.labels(), history.labels());
        let imported = history.labels().clone();
        assert_eq!(imported.imported.as_deref(), Some(&images));
        assert_eq!(imported.classes, classes);
        history.undo().unwrap();
        assert_eq!(history.labels().classes.len(), 2);
        assert!(!history.labels().says_anything());
        history.redo().unwrap();
        assert_eq!(history.labels(), &imported);

        history.merge_class(floor, wall).unwrap();
        let merged = history.labels().imported.clone().unwrap();
        assert_eq!(merged.maps[0].labels(), [wall, wall, 9]);
        history.remove_imported().unwrap();
        assert!(history.labels().imported.is_none() && history.remove_imported().is_none());
        assert_eq!(history.imports().0.len(), 2);
        for _ in 0..3 {
            history.undo().unwrap();
        }
        assert!(history.labels().imported.is_none());
        history.add_class("door");
        assert!(history.imports().0.is_empty(), "images of forgotten edits stay");
    }
}
