//! Classes: the list, the dialog that adds many of them, the finder, locks.

use inplace_core::labels::{AddedClasses, Class, ClassId};

use super::counted;

/// Heading of the list.
pub const HEADING: &str = "Classes";
/// Name of the field for a new class.
pub const NEW: &str = "New class";
/// The button beside it.
pub const ADD: &str = "Add class";
/// Name of the field that narrows the list down.
pub const SEARCH: &str = "Search classes";
/// Nothing in the list has the text of the search field in its name.
pub const NOT_FOUND: &str = "No class has this in its name.";
/// There is no class yet.
pub const EMPTY: &str = "No classes yet. Type a name and press Enter, click on something in the image, or start from \
                         the classes of a data set:";
/// What class 0 is called.
pub const VOID_NAME: &str = "void";
/// What void is.
pub const VOID: &str = "Nothing here: not trained on, and exported as 0";

/// Menu of the whole list.
pub const LIST_MENU: &str = "Class list";
/// Adds classes of a data set or a file.
pub const ADD_MANY: &str = "Add classes...";
/// Writes the classes to a file.
pub const SAVE_AS_FILE: &str = "Save classes as a file...";
/// Opens the finder.
pub const FIND: &str = "Find a class";
/// Shows hidden classes again.
pub const SHOW_ALL: &str = "Show all classes";
/// Unlocks all classes.
pub const UNLOCK_ALL: &str = "Unlock all classes";

/// Begins to rename a class.
pub const RENAME: &str = "Rename";
/// Menu of the classes to merge into.
pub const MERGE: &str = "Merge into";
/// Moves a class one line up.
pub const UP: &str = "Move up";
/// Moves a class one line down.
pub const DOWN: &str = "Move down";
/// Keeps what is labelled as a class as it is.
pub const LOCK: &str = "Lock";
/// Ends that.
pub const UNLOCK: &str = "Unlock";
/// Leaves a class out of the overlay.
pub const HIDE: &str = "Hide in the overlay";
/// Ends that.
pub const UNHIDE: &str = "Show in the overlay";

/// Title of the dialog that adds many classes.
pub const ADD_MANY_TITLE: &str = "Add classes";
/// A source of classes in that dialog.
pub const FROM_FILE: &str = "From a file";
/// What such a file holds.
pub const FILE_HOLDS: &str = "A list such as [{\"id\": 1, \"name\": \"wall\", \"color\": [200, 200, 190]}, ...]; colours may be left \
                              out. An export's classes.json is one.";
/// Name of the path field.
pub const FILE: &str = "Class list file";
/// Reads that file.
pub const READ: &str = "Read";
/// Name of the field that narrows the dialog's list down.
pub const SEARCH_SOURCE: &str = "Search in the list";
/// Ticks what is shown.
pub const TICK_ALL: &str = "Tick all";
/// Unticks what is shown.
pub const TICK_NONE: &str = "Tick none";
/// Beside a class that the project has.
pub const THERE: &str = "already there";
/// Title of the dialog that writes the classes to a file.
pub const SAVE_TITLE: &str = "Save classes";
/// What that is good for.
pub const SAVE_EXPLAINED: &str = "Names, numbers and colours, for another scene or for a script.";

/// Name of the finder's field.
pub const FINDER: &str = "Find class";
/// What stands in the empty field.
pub const FINDER_HINT: &str = "Part of a name";
/// The keys of the finder.
pub const FINDER_KEYS: &str = "Up and Down, Enter, Escape";

/// Name of the menu of a class.
pub fn actions_for(name: &str) -> String {
    format!("Actions for {name}")
}

/// Name of the field that renames a class.
pub fn rename(name: &str) -> String {
    format!("Rename {name}")
}

/// Name of the swatch of a class.
pub fn color_of(name: &str) -> String {
    format!("Colour of {name}")
}

/// Name of a colour to choose.
pub fn color(number: u16) -> String {
    format!("Colour {number}")
}

/// Name of the field for any other colour.
pub const COLOR_DIGITS: &str = "Colour as hexadecimal digits";
/// Gives the class that colour.
pub const USE_COLOR: &str = "Use";

/// A class that is not in the list any more.
pub fn nameless(id: ClassId) -> String {
    format!("class {id}")
}

/// Name of the padlock of a class.
pub fn padlock(name: &str, locked: bool) -> String {
    format!("{} {name}", if locked { UNLOCK } else { LOCK })
}

/// Name of the eye of a hidden class.
pub fn show_again(name: &str) -> String {
    format!("Show {name} in the overlay")
}

/// A class as a line of the list.
pub fn line(name: &str, strokes: usize, locked: bool, hidden: bool) -> String {
    let mut words = format!("{name}, {}", counted(strokes, "stroke", "strokes"));
    if locked {
        words += ", locked";
    }
    if hidden {
        words += ", hidden";
    }
    words
}

/// Deletes a class with its strokes.
pub fn delete(strokes: usize) -> String {
    match strokes {
        0 => "Delete".to_owned(),
        1 => "Delete with its stroke".to_owned(),
        many => format!("Delete with its {many} strokes"),
    }
}

/// The finder's line that makes a new class.
pub fn make(name: &str) -> String {
    format!("New class \"{name}\"")
}

/// How many classes a palette has, and for what.
pub fn about(scenes: &str, count: usize) -> String {
    format!("{count} classes: {scenes}")
}

/// The button that adds the ticked classes.
pub fn add_ticked(count: usize) -> String {
    format!("Add {}", counted(count, "class", "classes"))
}

/// What became of the classes that were to be added.
pub fn added(outcome: &AddedClasses) -> String {
    let mut sentence = match outcome.added.len() {
        0 => "No class was added.".to_owned(),
        some => format!("Added {}.", counted(some, "class", "classes")),
    };
    if !outcome.known.is_empty() {
        let names = outcome.known.iter().map(|class| class.name.clone());
        sentence += &format!(" Already there: {}.", some_of(names.collect()));
    }
    if !outcome.renumbered.is_empty() {
        let numbers = outcome.renumbered.iter();
        let numbers = numbers.map(|(asked, class)| format!("{} ({asked} is now {})", class.name, class.id));
        sentence += &format!(
            " With another number, because theirs is taken: {}.",
            some_of(numbers.collect())
        );
    }
    sentence
}

/// The first of many names, and how many more there are.
fn some_of(names: Vec<String>) -> String {
    const FEW: usize = 4;
    let shown = names[..names.len().min(FEW)].join(", ");
    match names.len().saturating_sub(FEW) {
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}

/// The classes were written to a file.
pub fn saved(count: usize, path: &str) -> String {
    format!("Saved {} to {path}", counted(count, "class", "classes"))
}

/// Labelling with a locked class is refused.
pub fn no_label(class: &Class) -> String {
    format!(
        "\"{}\" is locked: unlock it in the class list to label with it.",
        class.name
    )
}

/// Covering a locked class is refused.
pub fn no_cover(class: &Class) -> String {
    format!(
        "This would cover what is labelled \"{}\", which is locked: unlock it, or draw beside it.",
        class.name
    )
}

/// Erasing a locked class is refused.
pub fn no_erase(class: &Class) -> String {
    format!(
        "\"{}\" is locked, so its strokes stay: unlock it in the class list to erase them.",
        class.name
    )
}

/// Renaming, merging and deleting a locked class are refused.
pub fn no_change(class: &Class) -> String {
    format!(
        "\"{}\" is locked: unlock it in the class list to rename, merge or delete it.",
        class.name
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_added_is_said_without_endless_lists() {
        let classes = |count| {
            (1..=count)
                .map(|id| Class::new(id, format!("c{id}")))
                .collect::<Vec<_>>()
        };
        let mut outcome = AddedClasses {
            added: classes(2),
            ..AddedClasses::default()
        };
        assert_eq!(added(&outcome), "Added 2 classes.");
        outcome.known = classes(6);
        outcome.renumbered = vec![(3, Class::new(9, "lamp"))];
        assert_eq!(
            added(&outcome),
            "Added 2 classes. Already there: c1, c2, c3, c4 and 2 more. With another number, because theirs is taken: \
             lamp (3 is now 9)."
        );
    }
}
