//! Accuracy against the size of the model, around the size that is chosen for a scene.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::{Difference, MethodRun};
use crate::table::csv;

/// Factors on what is chosen for a scene; both above zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Size {
    /// On the rows of the field's table ([`Capacity::scaled`](inplace_core::field::Capacity::scaled)).
    pub field: f32,
    /// On the number of the surface's voxels
    /// ([`Surface::build_scaled`](inplace_core::semantics::Surface::build_scaled)).
    pub surface: f32,
}

/// What is made larger or smaller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Part {
    /// The rows of the field's table, and its finest cells with them.
    Field,
    /// The number of the surface's voxels.
    Surface,
}

impl Part {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Field, Self::Surface];

    /// The size of a model in which this part is so many times as large as chosen, and the other one as chosen.
    pub fn of_size(self, factor: f32) -> Size {
        let chosen = Size {
            field: 1.0,
            surface: 1.0,
        };
        match self {
            Self::Field => Size {
                field: factor,
                ..chosen
            },
            Self::Surface => Size {
                surface: factor,
                ..chosen
            },
        }
    }
}

impl fmt::Display for Part {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Field => "field",
            Self::Surface => "surface",
        })
    }
}

/// What a model came to that was not of the chosen size.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CapacityPoint {
    /// Name of the scene.
    pub scene: String,
    /// What was scaled.
    pub part: Part,
    /// By how much; 1 is what is chosen.
    pub factor: f32,
    /// Seed of the clicks and of the field.
    pub seed: u64,
    /// Trainable parameters.
    pub parameters: usize,
    /// Memory of the model, in bytes ([`MethodRun::bytes`]).
    pub bytes: usize,
    /// Voxels of the surface.
    pub voxels: usize,
    /// As in [`ParetoPoint`](super::ParetoPoint), when training had stopped or the last mark came.
    pub miou: f64,
    /// The same.
    pub depth_error_m: Option<f64>,
    /// The same.
    pub psnr_db: Option<f64>,
    /// The same.
    pub wall_s: f64,
}

impl CapacityPoint {
    /// The end of a run with this size; `None` of a run without points.
    pub fn of(run: &MethodRun, part: Part, factor: f32) -> Option<Self> {
        let last = run.points.last()?;
        Some(Self {
            scene: last.scene.clone(),
            part,
            factor,
            seed: last.seed,
            parameters: last.parameters.unwrap_or(0),
            bytes: run.bytes,
            voxels: run.voxels,
            miou: last.miou,
            depth_error_m: last.depth_error_m,
            psnr_db: last.psnr_db,
            wall_s: last.wall_s,
        })
    }
}

/// The points as comma-separated values, `capacity.csv`.
pub fn capacity_table(points: &[CapacityPoint]) -> serde_json::Result<String> {
    csv(
        points,
        "scene part factor seed parameters bytes voxels miou:4 depth_error_m:5 psnr_db:2 wall_s:2",
    )
}

/// How much more of a quantity there is at `factor` than at the chosen size, seed by seed, for one part of one scene;
/// `None` where no seed has both.
pub fn difference_to_chosen(
    points: &[&CapacityPoint],
    factor: f32,
    value: impl Fn(&CapacityPoint) -> Option<f64>,
) -> Option<Difference> {
    let of = |seed: u64, factor: f32| {
        let own = |point: &&&CapacityPoint| point.seed == seed && point.factor == factor;
        points.iter().find(own).and_then(|point| value(point))
    };
    let scaled = points.iter().filter(|point| point.factor == factor);
    let differences = scaled.filter_map(|point| Some(value(point)? - of(point.seed, 1.0)?));
    Difference::of(&differences.collect::<Vec<f64>>())
}
