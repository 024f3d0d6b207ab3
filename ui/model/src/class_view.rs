//! How classes and objects are treated in the window: which are locked, hidden, and unfolded. Kept in the project with the
//! settings.

use std::collections::BTreeSet;

use inplace_core::labels::{ClassId, ObjectId};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::preferences::each;

/// The classes and objects that are locked, those that are hidden, and the classes whose objects are listed.
///
/// What a person labelled as a locked class or object stays as it is: its strokes are not erased, changed or covered, and
/// none is added. Maps go on following all labels.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ClassView {
    /// The locked classes.
    pub locked: BTreeSet<ClassId>,
    /// The locked objects.
    pub locked_objects: BTreeSet<ObjectId>,
    /// What is hidden.
    pub hidden: Hidden,
    /// The classes whose objects are listed below them.
    pub unfolded: BTreeSet<ClassId>,
}

/// What is left out of the overlay, with its strokes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Hidden {
    /// The hidden classes.
    pub classes: BTreeSet<ClassId>,
    /// The hidden objects.
    pub objects: BTreeSet<ObjectId>,
    /// The object beside which all others are hidden.
    pub all_but: Option<ObjectId>,
}

impl Hidden {
    /// Whether an object is hidden, whatever its class is.
    pub fn has(&self, object: ObjectId) -> bool {
        self.objects.contains(&object) || self.all_but.is_some_and(|shown| shown != object)
    }

    /// Whether anything is.
    pub fn is_some(&self) -> bool {
        *self != Self::default()
    }
}

impl ClassView {
    /// Puts these into what a project keeps of the window, a JSON object.
    pub fn keep_in(&self, view: &mut Value) {
        view["locked"] = self.locked.iter().copied().collect();
        view["locked_objects"] = json!(self.locked_objects);
        view["hidden"] = self.hidden.classes.iter().copied().collect();
        view["hidden_objects"] = json!(self.hidden.objects);
        view["all_but"] = json!(self.hidden.all_but);
        view["unfolded"] = self.unfolded.iter().copied().collect();
    }

    /// What [`ClassView::keep_in`] kept; what is not there is empty.
    pub fn from_json(kept: &Value) -> Self {
        Self {
            locked: each(&kept["locked"]).collect(),
            locked_objects: each(&kept["locked_objects"]).collect(),
            hidden: Hidden {
                classes: each(&kept["hidden"]).collect(),
                objects: each(&kept["hidden_objects"]).collect(),
                all_but: Option::deserialize(&kept["all_but"]).unwrap_or_default(),
            },
            unfolded: each(&kept["unfolded"]).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn locks_of_another_version_lock_nothing() {
        for kept in [
            Value::Null,
            json!([]),
            json!({"locked": 3, "hidden": [-1, 70_000, "x"], "locked_objects": [0], "all_but": 0}),
        ] {
            assert_eq!(ClassView::from_json(&kept), ClassView::default());
        }
    }
}
