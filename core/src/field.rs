//! Density and colour of the scene, learnt from its pixels without any label.

mod capacity;
mod encoding;
mod exposure;
pub mod kernels;
mod model;
mod occupancy;
mod plain;
mod rays;
mod render;
mod sampling;
mod train;
mod volume;

pub(crate) use capacity::median;
pub use capacity::{Capacity, Preset};
pub use encoding::{FEATURES_PER_LEVEL, GridLevel, GridShape};
pub(crate) use model::is_alike;
pub use model::{Backend, RadianceField};
pub use occupancy::OccupancyGrid;
pub use rays::{Ray, Samples};
pub use render::{RenderedRay, camera_rays, frame_rays, render_rays};
pub use sampling::Sampling;
pub use train::{HeldOut, Recipe, Trainer};
pub use volume::Volume;

/// A failure of the tensor library.
#[derive(Debug, thiserror::Error)]
#[error("the field could not be computed: {}", first_line(.0))]
pub struct FieldError(#[from] candle_core::Error);

/// The error without the backtrace that candle may append.
fn first_line(error: &candle_core::Error) -> String {
    error.to_string().lines().next().unwrap_or_default().to_owned()
}
