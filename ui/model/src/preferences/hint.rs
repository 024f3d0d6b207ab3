//! The hints, by the names that the preferences have for them.

/// Something to know at first use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Hint {
    /// How a first class comes to be.
    FirstClass,
    /// How to label.
    FirstStroke,
    /// What the list of places is for.
    Suggestions,
    /// How to get the result.
    Export,
}

impl Hint {
    /// All hints, in the order in which they come up.
    pub const ALL: [Self; 4] = [
        Self::FirstClass,
        Self::FirstStroke,
        Self::Suggestions,
        Self::Export,
    ];

    /// Its name in the preferences.
    pub fn name(self) -> &'static str {
        match self {
            Self::FirstClass => "first-class",
            Self::FirstStroke => "first-stroke",
            Self::Suggestions => "suggestions",
            Self::Export => "export",
        }
    }

    /// The hint with this name in the preferences.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|hint| hint.name() == name)
    }
}
