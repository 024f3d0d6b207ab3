//! How the frame is shown and drawn on.

use serde_json::{Value, json};

use crate::layer::{Layer, Look};
use crate::tool::{LARGEST_BRUSH, Tool};

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
    /// Whether what a click would win is outlined.
    pub preview: bool,
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
            preview: true,
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

    /// As kept in the project file: a JSON object.
    pub fn to_json(self) -> Value {
        json!({
            "layer": self.layer.number(),
            "opacity": self.opacity,
            "outlines": self.outlines,
            "legend": self.legend,
            "preview": self.preview,
            "compare": self.compare,
            "other_layer": self.other_layer.number(),
            "split": self.split,
            "brush": self.brush,
        })
    }

    /// Takes over what an earlier window kept; what it did not keep stays.
    pub fn take_json(&mut self, kept: &Value) {
        for (layer, name) in [(&mut self.layer, "layer"), (&mut self.other_layer, "other_layer")] {
            let known = kept[name].as_u64().and_then(Layer::numbered);
            // No comparison is kept.
            if let Some(known) = known.filter(|&known| known != Layer::Differences) {
                *layer = known;
            }
        }
        for (flag, name) in [
            (&mut self.outlines, "outlines"),
            (&mut self.legend, "legend"),
            (&mut self.preview, "preview"),
            (&mut self.compare, "compare"),
        ] {
            *flag = kept[name].as_bool().unwrap_or(*flag);
        }
        for (share, name) in [(&mut self.opacity, "opacity"), (&mut self.split, "split")] {
            if let Some(kept) = kept[name].as_f64() {
                *share = (kept as f32).clamp(0.0, 1.0);
            }
        }
        if let Some(brush) = kept["brush"].as_u64() {
            self.brush = (brush as u32).min(LARGEST_BRUSH);
        }
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
            preview: false,
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
    fn settings_of_another_version_and_the_layer_of_a_comparison_do_no_harm() {
        let mut settings = Settings::default();
        for kept in [
            Value::Null,
            json!([]),
            json!({"layer": Layer::Differences.number()}),
            json!({"layer": 99, "opacity": "x", "brush": 1_000_000}),
        ] {
            settings.take_json(&kept);
        }
        assert_eq!(settings.layer, Layer::Labels);
        assert_eq!(settings.brush, LARGEST_BRUSH);
    }
}
