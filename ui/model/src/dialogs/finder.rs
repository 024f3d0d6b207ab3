//! Finding a class by part of its name.

use inplace_core::labels::{Class, VOID};

use crate::palette::{VOID_COLOR, VOID_NAME};

/// What happens with the class that was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClassUse {
    /// It becomes the class to label with.
    Choose,
    /// It answers the suggestion at hand.
    Answer,
}

/// A popup that finds a class by part of its name, or makes one.
#[derive(Clone, Debug, PartialEq)]
pub struct ClassFinder {
    /// What happens with the class.
    pub purpose: ClassUse,
    /// The project's classes and void.
    pub classes: Vec<Class>,
    /// The text typed so far.
    pub text: String,
    /// The line that Enter takes.
    pub line: usize,
}

/// A line of the list.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FoundClass {
    /// A class, by its place in the list.
    Class(usize),
    /// A new class of the name typed.
    New,
}

impl ClassFinder {
    /// A finder among a project's classes.
    pub fn new(purpose: ClassUse, mut classes: Vec<Class>) -> Self {
        classes.push(Class {
            id: VOID,
            name: VOID_NAME.to_owned(),
            color: VOID_COLOR,
            thing: false,
        });
        Self {
            purpose,
            classes,
            text: String::new(),
            line: 0,
        }
    }

    /// The digit that chooses a class without the finder.
    pub fn digit(&self, index: usize) -> Option<usize> {
        match self.classes[index].id {
            VOID => Some(0),
            _ => (index < 9).then_some(index + 1),
        }
    }

    /// Names that begin with the text, then those with a word that does, then those that hold it; a new class at the
    /// end unless one is named so.
    pub fn found(&self) -> Vec<FoundClass> {
        let text = self.text.trim().to_lowercase();
        let ranked = |index: &usize| rank(&self.classes[*index].name.to_lowercase(), &text);
        let mut indices: Vec<usize> = (0..self.classes.len()).collect();
        indices.retain(|index| ranked(index).is_some());
        indices.sort_by_key(ranked);
        let mut found: Vec<FoundClass> = indices.into_iter().map(FoundClass::Class).collect();
        if !text.is_empty() && !self.classes.iter().any(|class| class.is_named(&text)) {
            found.push(FoundClass::New);
        }
        found
    }
}

/// How well a name fits a text, both in small letters; less is better.
fn rank(name: &str, text: &str) -> Option<u8> {
    let mut words = name.split([' ', '-', '_']);
    if name.starts_with(text) {
        Some(0)
    } else if words.any(|word| word.starts_with(text)) {
        Some(1)
    } else {
        name.contains(text).then_some(2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(finder: &ClassFinder) -> Vec<&str> {
        let name = |found| match found {
            FoundClass::Class(index) => finder.classes[index].name.as_str(),
            FoundClass::New => "+",
        };
        finder.found().into_iter().map(name).collect()
    }

    #[test]
    fn names_that_begin_with_the_text_come_first_and_a_new_class_last() {
        let all = ["coffee table", "table", "vegetable", "wall-table"];
        let classes = (1..).zip(all).map(|(id, name)| Class::new(id, name));
        let classes = classes.collect();
        let mut finder = ClassFinder::new(ClassUse::Choose, classes);
        assert_eq!(names(&finder).len(), 5);
        for (text, found) in [
            ("tab", "table, coffee table, wall-table, vegetable, +"),
            (" TABLE ", "table, coffee table, wall-table, vegetable"),
            ("x", "+"),
            ("0", "+"),
        ] {
            finder.text = text.to_owned();
            assert_eq!(names(&finder).join(", "), found, "{text}");
        }
    }
}
