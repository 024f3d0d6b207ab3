//! Classes of a data set or a file, to be added to a project.

use inplace_core::labels::{Class, ImportError, PALETTES};

/// Longer lists start without a tick: a person who wants all of them is rare.
const TICKED_FROM_THE_START: usize = 40;

/// The classes of a data set or a file, to tick and to add.
#[derive(Clone, Debug, PartialEq)]
pub struct AddClasses {
    /// Where the classes are from.
    pub source: ClassSource,
    /// The path typed so far.
    pub path: String,
    /// The classes of the source.
    pub choices: Vec<ClassChoice>,
    /// The text that narrows the list down.
    pub search: String,
    /// The classes that the project has.
    present: Vec<Class>,
    /// Why a file cannot be used, a sentence.
    pub problem: Option<String>,
}

/// A class to choose.
#[derive(Clone, Debug, PartialEq)]
pub struct ClassChoice {
    /// The class.
    pub class: Class,
    /// Whether it is to be added.
    pub ticked: bool,
    /// Whether the project has a class of this name.
    pub there: bool,
}

/// Where classes are from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClassSource {
    /// One of [`PALETTES`].
    Palette(usize),
    /// A class list.
    File,
}

impl AddClasses {
    /// Begins with one of [`PALETTES`]; `present` are the classes that the project has.
    pub fn new(palette: usize, present: Vec<Class>) -> Self {
        let mut dialog = Self {
            source: ClassSource::File,
            path: String::new(),
            choices: Vec::new(),
            search: String::new(),
            present,
            problem: None,
        };
        dialog.choose(ClassSource::Palette(palette.min(PALETTES.len() - 1)));
        dialog
    }

    /// Takes over what a file holds, or why it cannot be used.
    pub fn take_file(&mut self, read: Result<Vec<Class>, ImportError>) {
        if self.source == ClassSource::File {
            let problem = read.as_ref().err().map(ImportError::to_string);
            self.list(read.unwrap_or_default());
            self.problem = problem;
        }
    }

    /// Lists the classes of a source.
    pub fn choose(&mut self, source: ClassSource) {
        self.source = source;
        self.list(match source {
            ClassSource::Palette(index) => PALETTES[index].classes(),
            ClassSource::File => Vec::new(),
        });
    }

    fn list(&mut self, classes: Vec<Class>) {
        let ticked = classes.len() <= TICKED_FROM_THE_START;
        let choice = |class: Class| ClassChoice {
            there: self.present.iter().any(|present| present.is_named(&class.name)),
            ticked,
            class,
        };
        self.choices = classes.into_iter().map(choice).collect();
        self.search.clear();
        self.problem = None;
    }

    /// Indices of the classes that have the text of the search field in their name.
    pub fn found(&self) -> Vec<usize> {
        let text = self.search.trim().to_lowercase();
        let choices = self.choices.iter().enumerate();
        let found = choices.filter(|(_, choice)| choice.class.name.to_lowercase().contains(&text));
        found.map(|(index, _)| index).collect()
    }

    /// The classes that are to be added.
    pub fn ticked(&self) -> impl Iterator<Item = &Class> {
        let choices = self.choices.iter();
        let ticked = choices.filter(|choice| choice.ticked && !choice.there);
        ticked.map(|choice| &choice.class)
    }
}
