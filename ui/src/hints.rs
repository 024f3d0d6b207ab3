//! What to say when to somebody who is new here: each hint once, and then never again.

use inplace_core::session::Phase;

use crate::english::hint as words;
use crate::preferences::Preferences;
use crate::state::AppState;
use crate::workspace::Workspace;

/// Strokes after which somebody may wonder what comes of them.
const ENOUGH_TO_EXPORT: usize = 8;

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

/// Which part of the window a hint speaks of, as seen from the canvas.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The canvas itself.
    Here,
    /// The panel at the right.
    Right,
    /// The buttons above.
    Above,
}

/// What is said over the canvas.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Callout {
    /// The hint, remembered once it is dismissed or followed; `None` = what is going on, said every time.
    pub hint: Option<Hint>,
    /// The sentence.
    pub text: String,
    /// What it speaks of.
    pub side: Side,
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

    /// Whether there is a reason to say it now.
    fn applies(self, state: &AppState, workspace: &Workspace) -> bool {
        let document = workspace.document();
        let classes = !document.classes().is_empty();
        let said = document.labels().says_anything();
        match self {
            Self::FirstClass => !classes,
            Self::FirstStroke => classes && !said,
            Self::Suggestions => {
                said && !workspace.suggestions().is_empty() && workspace.at_suggestion().is_none()
            }
            Self::Export => document.labels().strokes.len() >= ENOUGH_TO_EXPORT && state.export.is_none(),
        }
    }

    fn callout(self, preferences: &Preferences) -> Callout {
        let (text, side) = match self {
            Self::FirstClass => {
                let key = crate::keys::text(&preferences.keys, "N");
                (words::first_class(&key), Side::Here)
            }
            Self::FirstStroke => (words::FIRST_STROKE.to_owned(), Side::Here),
            Self::Suggestions => {
                let key = crate::keys::text(&preferences.keys, "N");
                (words::suggestions(&key), Side::Right)
            }
            Self::Export => {
                let key = crate::keys::text(&preferences.keys, "Ctrl+E");
                (words::export(&key), Side::Above)
            }
        };
        Callout {
            hint: Some(self),
            text,
            side,
        }
    }
}

/// What to say now: the first hint that is due and new to this person, or what is being waited for.
pub fn due(state: &AppState, workspace: &Workspace) -> Option<Callout> {
    let seen = &state.preferences.hints_seen;
    let next = Hint::ALL
        .into_iter()
        .find(|hint| !seen.contains(hint) && hint.applies(state, workspace));
    if let Some(hint) = next {
        return Some(hint.callout(&state.preferences));
    }
    let waits = workspace.status().phase == Phase::FindingSurface && workspace.shown_map().is_none();
    (waits && workspace.document().labels().says_anything()).then(|| Callout {
        hint: None,
        text: words::NO_SURFACE.to_owned(),
        side: Side::Here,
    })
}

/// The hints that were followed: those that were shown and have no reason any more.
pub fn followed(shown: Hint, state: &AppState, workspace: &Workspace) -> bool {
    !shown.applies(state, workspace)
}
