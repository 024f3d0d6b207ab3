//! How the splats are coloured.

use inplace_model::layer::Layer;

/// How the splats are coloured, and which of them are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SplatLook {
    /// What lies over their colour.
    pub layer: Layer,
    /// How much it covers, 0..=1.
    pub opacity: f32,
    /// Whether splats that face away are left out.
    pub see_through: bool,
    /// What is behind them.
    pub background: egui::Color32,
}
