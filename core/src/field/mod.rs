//! Density and colour of the scene, learnt from its pixels.

use serde::{Deserialize, Serialize};

/// How much the field may model, and for how long it trains.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Preset {
    /// Chosen from the scene.
    #[default]
    Auto,
    /// Coarser and sooner.
    Fast,
    /// Finer and later.
    Accurate,
}
