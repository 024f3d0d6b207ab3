//! Everything that the panels read.

use std::collections::HashMap;
use std::path::Path;

use inplace_core::field::Preset;
use inplace_core::scene::{OpenOptions, SceneSource};

use crate::canvas::{Layer, Look, Tool};
use crate::dialogs::{Dialog, ExportChoice};
use crate::exporting::Progress;
use crate::keeper::Keeper;
use crate::opening::{Prepared, Target};
use crate::pictures::Found;
use crate::preferences::{Place, Preferences};
use crate::session_link::Running;
use crate::stats::Stats;
use crate::toasts::Toasts;
use crate::workspace::Workspace;

/// Largest brush radius in image pixels.
pub const LARGEST_BRUSH: u32 = 64;

/// What the window is at.
#[derive(Debug)]
pub enum Stage {
    /// Nothing is open.
    Start,
    /// Something is being opened.
    Opening(Box<Opening>),
    /// A scene is open.
    Open(Box<Workspace>),
}

/// Something being opened.
#[derive(Debug)]
pub struct Opening {
    /// Tells this attempt from earlier ones, whose results are then dropped.
    pub ticket: u64,
    /// What is opened.
    pub target: Target,
    /// Frames decoded so far, and in all.
    pub progress: (usize, usize),
    /// The session that reads the scene, once it runs.
    pub session: Option<Running>,
    /// What is kept about the scene, until the journal takes it.
    pub prepared: Option<Prepared>,
}

/// What the right side shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Side {
    /// Where to label next.
    #[default]
    LabelNext,
    /// How far the labelling has come.
    Progress,
}

impl Side {
    /// The other one.
    pub fn other(self) -> Self {
        match self {
            Self::LabelNext => Self::Progress,
            Self::Progress => Self::LabelNext,
        }
    }
}

/// How the frame is shown and drawn on; kept between scenes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// What lies over the colour image.
    pub layer: Layer,
    /// How much it covers, 0..=1.
    pub opacity: f32,
    /// Whether borders between classes are drawn.
    pub outlines: bool,
    /// Whether the canvas has legends.
    pub legend: bool,
    /// Whether the canvas is split between two layers.
    pub compare: bool,
    /// What the left side of the split canvas shows.
    pub other_layer: Layer,
    /// Where the canvas is split, as a share of its width, 0..=1.
    pub split: f32,
    /// What the left button does.
    pub tool: Tool,
    /// The tool that labels, while another one is chosen.
    pub labelling: Tool,
    /// Brush radius in image pixels.
    pub brush: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            layer: Layer::Labels,
            opacity: 0.55,
            outlines: true,
            legend: true,
            compare: false,
            other_layer: Layer::Color,
            split: 0.5,
            tool: Tool::Brush,
            labelling: Tool::Brush,
            brush: 2,
        }
    }
}

impl Settings {
    /// Chooses what the left button does.
    pub fn choose_tool(&mut self, tool: Tool) {
        if tool.labels() {
            self.labelling = tool;
        }
        self.tool = tool;
    }

    /// How frames are composed.
    pub fn look(&self) -> Look {
        Look {
            layer: self.layer,
            opacity: self.opacity,
            outlines: self.outlines,
        }
    }

    /// As kept in the project file.
    pub fn to_json(self) -> String {
        serde_json::json!({
            "layer": self.layer.number(),
            "opacity": self.opacity,
            "outlines": self.outlines,
            "legend": self.legend,
            "compare": self.compare,
            "other_layer": self.other_layer.number(),
            "split": self.split,
            "brush": self.brush,
        })
        .to_string()
    }

    /// Takes over what an earlier window kept; what it did not keep stays.
    pub fn take_json(&mut self, json: &str) {
        let Ok(kept) = serde_json::from_str::<serde_json::Value>(json) else {
            return;
        };
        for (layer, name) in [(&mut self.layer, "layer"), (&mut self.other_layer, "other_layer")] {
            let number = kept[name].as_u64();
            if let Some(&known) = number.and_then(|number| Layer::ALL.get(number as usize)) {
                *layer = known;
            }
        }
        if let Some(legend) = kept["legend"].as_bool() {
            self.legend = legend;
        }
        if let Some(compare) = kept["compare"].as_bool() {
            self.compare = compare;
        }
        if let Some(split) = kept["split"].as_f64() {
            self.split = (split as f32).clamp(0.0, 1.0);
        }
        if let Some(opacity) = kept["opacity"].as_f64() {
            self.opacity = (opacity as f32).clamp(0.0, 1.0);
        }
        if let Some(outlines) = kept["outlines"].as_bool() {
            self.outlines = outlines;
        }
        if let Some(brush) = kept["brush"].as_u64() {
            self.brush = (brush as u32).min(LARGEST_BRUSH);
        }
    }
}

/// Everything that the panels read. They change nothing here: they push actions.
pub struct AppState {
    /// What the window is at.
    pub stage: Stage,
    /// Where the open scene's work is kept.
    pub keeper: Option<Keeper>,
    /// How the frame is shown and drawn on.
    pub settings: Settings,
    /// What the person prefers in every scene.
    pub preferences: Preferences,
    /// What is known about what was opened lately, once it was looked at.
    pub found: HashMap<Place, Found>,
    /// What is read of captures.
    pub open: OpenOptions,
    /// What was read of the open one.
    pub read: OpenOptions,
    /// How much the field may model.
    pub preset: Preset,
    /// What was exported last, and where to, in this scene.
    pub export_choice: ExportChoice,
    /// The dialog shown.
    pub dialog: Option<Dialog>,
    /// How the last export goes or went, until it is dismissed.
    pub export: Option<Progress>,
    /// Whether it is being stopped.
    pub stopping_export: bool,
    /// The import whose label images are being read.
    pub importing: Option<u64>,
    /// What the right side shows.
    pub side: Side,
    /// The messages shown.
    pub toasts: Toasts,
    /// Measurements, where asked for.
    pub stats: Option<Stats>,
    /// Whether the key that hides the overlay is held.
    pub overlay_hidden: bool,
}

impl AppState {
    /// The open scene.
    pub fn workspace(&self) -> Option<&Workspace> {
        match &self.stage {
            Stage::Open(workspace) => Some(workspace),
            Stage::Start | Stage::Opening(_) => None,
        }
    }

    /// The open scene.
    pub fn workspace_mut(&mut self) -> Option<&mut Workspace> {
        match &mut self.stage {
            Stage::Open(workspace) => Some(workspace),
            Stage::Start | Stage::Opening(_) => None,
        }
    }

    /// Name of what is open: the project's file stem, or the scene's name.
    pub fn document_name(&self) -> Option<String> {
        let workspace = self.workspace()?;
        let named = self.keeper.as_ref().filter(|keeper| keeper.is_named());
        let stem = named.and_then(|keeper| keeper.path().file_stem());
        Some(stem.map_or_else(
            || workspace.scene().name(),
            |stem| stem.to_string_lossy().into_owned(),
        ))
    }

    /// Where what is open can be opened again; `None` for the demo scene, which is always there.
    pub fn place(&self) -> Option<Place> {
        let workspace = self.workspace()?;
        let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
        match (&self.keeper, &workspace.scene().source) {
            (Some(keeper), _) if keeper.is_named() => Some(Place::Project(absolute(keeper.path()))),
            (_, SceneSource::Folder(folder)) => Some(Place::Scene(absolute(folder))),
            (_, SceneSource::Demo) => None,
        }
    }

    /// Where a dialog suggests to put a file or folder with this ending.
    pub fn suggested_path(&self, ending: &str) -> String {
        let name = format!("{}{ending}", self.document_name().unwrap_or_default());
        let kept = self.keeper.as_ref().filter(|keeper| keeper.is_named());
        let folder = kept.and_then(|keeper| keeper.path().parent().map(Path::to_path_buf));
        let folder = folder
            .or_else(|| std::env::current_dir().ok())
            .unwrap_or_default();
        folder.join(name).display().to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_survive_the_project_file() {
        let settings = Settings {
            layer: Layer::Entropy,
            opacity: 0.25,
            outlines: false,
            legend: false,
            compare: true,
            other_layer: Layer::Rendered,
            split: 0.75,
            brush: 9,
            ..Settings::default()
        };
        let mut read = Settings::default();
        read.take_json(&settings.to_json());
        assert_eq!(read, settings);
    }

    #[test]
    fn settings_of_another_version_do_no_harm() {
        let mut settings = Settings::default();
        for json in ["", "[]", r#"{"layer": 99, "opacity": "x", "brush": 1000000}"#] {
            settings.take_json(json);
        }
        assert_eq!(settings.layer, Layer::Labels);
        assert_eq!(settings.brush, LARGEST_BRUSH);
    }
}
