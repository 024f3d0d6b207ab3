//! How classes are treated in the window: which are locked, hidden, and unfolded. Kept in the project with the settings.

use std::collections::BTreeSet;

use inplace_core::labels::ClassId;
use serde_json::Value;

use crate::preferences::each;

/// The classes that are locked, those that are hidden, and those whose objects are listed.
///
/// What a person labelled as a locked class stays as it is: its strokes are not erased, changed or covered, and none
/// is added. Maps go on following all labels. A hidden class is left out of the overlay, with its strokes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ClassView {
    /// The locked classes.
    pub locked: BTreeSet<ClassId>,
    /// The hidden classes.
    pub hidden: BTreeSet<ClassId>,
    /// The classes whose objects are listed below them.
    pub unfolded: BTreeSet<ClassId>,
}

impl ClassView {
    /// Puts these into what a project keeps of the window, a JSON object.
    pub fn keep_in(&self, view: &mut Value) {
        view["locked"] = self.locked.iter().copied().collect();
        view["hidden"] = self.hidden.iter().copied().collect();
        view["unfolded"] = self.unfolded.iter().copied().collect();
    }

    /// What [`ClassView::keep_in`] kept; what is not there is empty.
    pub fn from_json(kept: &Value) -> Self {
        Self {
            locked: each(&kept["locked"]).collect(),
            hidden: each(&kept["hidden"]).collect(),
            unfolded: each(&kept["unfolded"]).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn locks_of_another_version_lock_nothing() {
        for kept in [
            Value::Null,
            json!([]),
            json!({"locked": 3, "hidden": [-1, 70_000, "x"]}),
        ] {
            assert_eq!(ClassView::from_json(&kept), ClassView::default());
        }
    }
}
