//! What to say when to somebody who is new here: each hint once, and then never again.

use inplace_core::session::Phase;
use serde::{Deserialize, Serialize};

use crate::model::State;
use crate::workspace::Workspace;

/// Strokes after which somebody may wonder what comes of them.
const ENOUGH_TO_EXPORT: usize = 8;

/// Something to know at first use; in the preferences by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
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

    /// Whether there is a reason to say it now.
    pub fn applies(self, state: &State, workspace: &Workspace) -> bool {
        let document = &workspace.document;
        let classes = !document.classes().is_empty();
        let said = document.labels().says_anything();
        match self {
            Self::FirstClass => !classes,
            Self::FirstStroke => classes && !said,
            Self::Suggestions => {
                let suggestions = workspace.suggestions();
                said && !suggestions.listed.is_empty() && suggestions.at().is_none()
            }
            Self::Export => document.labels().strokes.len() >= ENOUGH_TO_EXPORT && state.export.is_none(),
        }
    }

    /// The first hint that is due and new to this person.
    pub fn due(state: &State, workspace: &Workspace) -> Option<Self> {
        let seen = &state.preferences.hints_seen;
        let mut all = Self::ALL.into_iter();
        all.find(|hint| !seen.contains(hint) && hint.applies(state, workspace))
    }
}

/// Whether labels wait for the surface that they spread over, or for the frames that it is made from.
pub fn waits_for_surface(workspace: &Workspace) -> bool {
    matches!(workspace.status.phase, Phase::Opening | Phase::FindingSurface)
        && workspace.newest_map(workspace.frame_index).is_none()
        && workspace.document.labels().says_anything()
}
