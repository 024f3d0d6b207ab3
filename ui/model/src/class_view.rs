//! How classes and objects are treated in the window: which are locked, hidden, and unfolded. Kept in the project with the
//! settings.

use std::collections::BTreeSet;

use inplace_core::labels::{ClassId, ObjectId};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::preferences::each;

/// A class or an object: what has a line of its own in the class list.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Named {
    /// A class; void is one here.
    Class(ClassId),
    /// An object of a class.
    Object(ObjectId),
}

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
    /// Locks a class or an object, or unlocks it.
    pub fn set_locked(&mut self, named: Named, locked: bool) {
        match named {
            Named::Class(id) => set(&mut self.locked, id, locked),
            Named::Object(id) => set(&mut self.locked_objects, id, locked),
        }
    }

    /// Hides a class or an object, or shows it again. After an object, none is shown alone, unless it is this one and
    /// shown.
    pub fn set_hidden(&mut self, named: Named, hidden: bool) {
        match named {
            Named::Class(id) => set(&mut self.hidden.classes, id, hidden),
            Named::Object(id) => {
                set(&mut self.hidden.objects, id, hidden);
                let all_but = &mut self.hidden.all_but;
                if all_but.is_some_and(|shown| (shown == id) == hidden) {
                    *all_but = None;
                }
            }
        }
    }

    /// Puts these into what a project keeps of the window, a JSON object.
    pub fn keep_in(&self, view: &mut Value) {
        view["locked"] = json!(self.locked);
        view["locked_objects"] = json!(self.locked_objects);
        view["hidden"] = json!(self.hidden.classes);
        view["hidden_objects"] = json!(self.hidden.objects);
        view["all_but"] = json!(self.hidden.all_but);
        view["unfolded"] = json!(self.unfolded);
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

/// Puts an id among others, or takes it away.
pub(crate) fn set<Id: Ord>(ids: &mut BTreeSet<Id>, id: Id, present: bool) {
    if present {
        ids.insert(id);
    } else {
        ids.remove(&id);
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
