//! Which panels are shown around the canvas.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

/// A panel that can be hidden.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Pane {
    /// The classes, at the left.
    Classes,
    /// What to label next and the training, at the right.
    #[serde(rename = "guidance")]
    Suggestions,
    /// All frames, at the bottom.
    Frames,
    /// The training in full, at the lower end of the right panel, which otherwise has a line for it.
    Training,
    /// The list of strokes, at the lower end of the left panel, which otherwise has its heading.
    Strokes,
}

impl Pane {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Classes,
        Self::Suggestions,
        Self::Frames,
        Self::Training,
        Self::Strokes,
    ];

    /// Whether a window of this size, in points, has room for it beside the canvas.
    pub fn fits(self, window: impl Into<[f32; 2]>) -> bool {
        let [width, height] = window.into();
        match self {
            Self::Classes => width >= 400.0,
            Self::Suggestions => width >= 800.0,
            Self::Frames => height >= 420.0,
            Self::Training => height >= 1000.0,
            Self::Strokes => height >= 600.0,
        }
    }

    /// Its name in the View menu.
    pub fn title(self) -> &'static str {
        match self {
            Self::Classes => "Classes",
            Self::Suggestions => "Label next and training",
            Self::Frames => "Frames",
            Self::Training => "Training in full",
            Self::Strokes => "List of strokes",
        }
    }
}

/// Which panels the person shows or hides; the others are shown where they fit. Kept so: `{"frames": false}`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Layout(BTreeMap<Pane, bool>);

impl Layout {
    /// Whether a panel is shown in a window of this size, in points.
    pub fn shows(&self, pane: Pane, window: impl Into<[f32; 2]>) -> bool {
        let chosen = self.0.get(&pane).copied();
        chosen.unwrap_or_else(|| pane.fits(window))
    }

    /// Shows or hides a panel, or leaves that to its size.
    pub fn set(&mut self, pane: Pane, shown: Option<bool>) {
        self.0.remove(&pane);
        self.0.extend(shown.map(|shown| (pane, shown)));
    }

    /// Reads what was kept; entries that make no sense are left out.
    pub(super) fn from_json(json: &Value) -> Self {
        let entries = json.as_object().into_iter().flatten();
        let chosen = entries
            .filter_map(|(name, shown)| Some((Pane::deserialize(json!(name)).ok()?, shown.as_bool()?)));
        Self(chosen.collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panels_give_way_to_the_canvas_unless_the_person_says_otherwise() {
        let (wide, low, small) = ([1920.0, 1080.0], [1280.0, 720.0], [427.0, 240.0]);
        let mut layout = Layout::default();
        let shown = |layout: &Layout, size| Pane::ALL.map(|pane| layout.shows(pane, size));
        assert_eq!(shown(&layout, wide), [true; 5]);
        assert_eq!(shown(&layout, low), [true, true, true, false, true]);
        assert_eq!(shown(&layout, small), [true, false, false, false, false]);
        layout.set(Pane::Suggestions, Some(true));
        layout.set(Pane::Classes, Some(false));
        assert_eq!(Layout::from_json(&json!(layout)), layout);
        assert_eq!(shown(&layout, small), [false, true, false, false, false]);
    }
}
