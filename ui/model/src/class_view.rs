//! How classes are treated in the window: which are locked, which are hidden. Kept in the project with the settings.

use std::collections::BTreeSet;

use inplace_core::labels::ClassId;
use serde_json::Value;

/// The classes that are locked, and those that are hidden.
///
/// What a person labelled as a locked class stays as it is: its strokes are not erased, changed or covered, and none
/// is added. Maps go on following all labels. A hidden class is left out of the overlay, with its strokes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ClassView {
    locked: BTreeSet<ClassId>,
    hidden: BTreeSet<ClassId>,
}

impl ClassView {
    /// The locked classes.
    pub fn locked(&self) -> &BTreeSet<ClassId> {
        &self.locked
    }

    /// The hidden classes.
    pub fn hidden(&self) -> &BTreeSet<ClassId> {
        &self.hidden
    }

    /// Locks a class or unlocks it.
    pub fn set_locked(&mut self, class: ClassId, locked: bool) {
        set(&mut self.locked, class, locked);
    }

    /// Hides a class or shows it again.
    pub fn set_hidden(&mut self, class: ClassId, hidden: bool) {
        set(&mut self.hidden, class, hidden);
    }

    /// Unlocks all classes.
    pub fn unlock_all(&mut self) {
        self.locked.clear();
    }

    /// Shows all classes.
    pub fn show_all(&mut self) {
        self.hidden.clear();
    }

    /// The settings of the window, a JSON object, together with these.
    pub fn with_settings(&self, settings: &str) -> String {
        let mut kept: Value =
            serde_json::from_str(settings).unwrap_or_else(|_| Value::Object(Default::default()));
        if let Some(object) = kept.as_object_mut() {
            object.insert("locked".to_owned(), self.locked.iter().copied().collect());
            object.insert("hidden".to_owned(), self.hidden.iter().copied().collect());
        }
        kept.to_string()
    }

    /// What [`ClassView::with_settings`] kept; what is not there is empty.
    pub fn of_json(json: &str) -> Self {
        let kept: Value = serde_json::from_str(json).unwrap_or_default();
        let classes = |name: &str| {
            let ids = kept[name].as_array().into_iter().flatten();
            ids.filter_map(|id| ClassId::try_from(id.as_u64()?).ok())
                .collect()
        };
        Self {
            locked: classes("locked"),
            hidden: classes("hidden"),
        }
    }
}

fn set(classes: &mut BTreeSet<ClassId>, class: ClassId, present: bool) {
    if present {
        classes.insert(class);
    } else {
        classes.remove(&class);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn locks_survive_the_project_file_beside_the_settings() {
        let mut view = ClassView::default();
        view.set_locked(3, true);
        view.set_locked(4, true);
        view.set_locked(4, false);
        view.set_hidden(65_535, true);
        let json = view.with_settings(r#"{"brush": 7}"#);
        assert_eq!(ClassView::of_json(&json), view);
        assert_eq!(serde_json::from_str::<Value>(&json).unwrap()["brush"], 7);
    }

    #[test]
    fn settings_of_another_version_lock_nothing() {
        for json in ["", "[]", "{}", r#"{"locked": 3, "hidden": [-1, 70000, "x"]}"#] {
            assert_eq!(ClassView::of_json(json), ClassView::default());
        }
    }
}
