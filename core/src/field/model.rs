//! The radiance field: a hash grid and two small networks.

use std::collections::HashMap;

use candle_core::{Device, Result, Tensor, Var, bail};
use glam::Vec3;
use rand::{Rng, SeedableRng, rngs::SmallRng};

use super::kernels::encode;
use super::{Capacity, GridShape, Volume};

/// Geometry features beside the density.
const GEOMETRY_FEATURES: usize = 15;
/// Spherical harmonics up to degree 2 of the viewing direction.
pub const DIRECTION_FEATURES: usize = 9;
/// Added to the network's output before the exponential: the field starts thin, at e^-2 per metre.
const INITIAL_LOG_DENSITY: f64 = -2.0;

/// Density, geometry features and colour at any point of a volume (Semantic-NeRF, Fig. 2, with the
/// positional encoding and trunk replaced by a hash grid and a one-hidden-layer network).
#[derive(Debug)]
pub struct RadianceField {
    volume: Volume,
    grid: GridShape,
    table: Var,
    geometry: [Var; 2],
    color: [Var; 2],
}

/// What the field says of the geometry at `N` points.
pub struct Geometry {
    /// Density per metre, `[N]`.
    pub density: Tensor,
    /// Features of the geometry network, `[N, 15]`.
    pub features: Tensor,
    /// The hash-grid encoding, `[N, 2 * levels]`.
    pub encoding: Tensor,
}

impl RadianceField {
    /// A field with random parameters.
    ///
    /// # Errors
    /// None on the CPU short of a lack of memory.
    pub fn new(volume: Volume, capacity: &Capacity, seed: u64) -> Result<Self> {
        let mut rng = SmallRng::seed_from_u64(seed ^ 0x5eed_f1e1d);
        let grid = capacity.grid();
        let hidden = capacity.hidden;
        let table = uniform(&mut rng, (grid.rows(), 2), 1e-4)?;
        let mut layer = |inputs: usize, outputs: usize| {
            let bound = (6.0 / (inputs + outputs) as f32).sqrt();
            uniform(&mut rng, (inputs, outputs), bound)
        };
        let geometry = [
            layer(grid.features(), hidden)?,
            layer(hidden, 1 + GEOMETRY_FEATURES)?,
        ];
        let color = [
            layer(GEOMETRY_FEATURES + DIRECTION_FEATURES, hidden / 2)?,
            layer(hidden / 2, 3)?,
        ];
        Ok(Self {
            volume,
            grid,
            table,
            geometry,
            color,
        })
    }

    /// The part of the world that it models.
    pub fn volume(&self) -> &Volume {
        &self.volume
    }

    /// The hash table `[rows, 2]`.
    pub fn table(&self) -> &Var {
        &self.table
    }

    /// The weights of the networks, each `[inputs, outputs]`.
    pub fn weights(&self) -> impl Iterator<Item = &Var> {
        self.geometry.iter().chain(&self.color)
    }

    /// Trainable parameters.
    pub fn parameters(&self) -> usize {
        self.table.elem_count() + self.weights().map(|w| w.elem_count()).sum::<usize>()
    }

    /// Width of [`RadianceField::features`].
    pub fn feature_width(&self) -> usize {
        self.grid.features() + GEOMETRY_FEATURES
    }

    /// Geometry at unit positions `[N, 3]`; differentiable in the parameters.
    ///
    /// # Errors
    /// Positions of another shape.
    pub fn geometry(&self, positions: &Tensor) -> Result<Geometry> {
        let encoding = encode(&self.grid, positions, &self.table)?;
        let hidden = encoding.matmul(&self.geometry[0])?.relu()?;
        let out = hidden.matmul(&self.geometry[1])?;
        let density = out
            .narrow(1, 0, 1)?
            .squeeze(1)?
            .affine(1.0, INITIAL_LOG_DENSITY)?
            .clamp(-15.0, 10.0)?
            .exp()?;
        let features = out.narrow(1, 1, GEOMETRY_FEATURES)?;
        Ok(Geometry {
            density,
            features,
            encoding,
        })
    }

    /// Colour `[N, 3]` in 0..=1 from geometry features `[N, 15]` and direction features `[N, 9]`.
    ///
    /// # Errors
    /// Arguments of other shapes.
    pub fn color(&self, features: &Tensor, directions: &Tensor) -> Result<Tensor> {
        let input = Tensor::cat(&[features, directions], 1)?;
        let hidden = input.matmul(&self.color[0])?.relu()?;
        // The logistic function by tanh, which has a fast backward pass in candle.
        hidden
            .matmul(&self.color[1])?
            .affine(0.5, 0.0)?
            .tanh()?
            .affine(0.5, 0.5)
    }

    /// Features that the semantic head reads at unit positions `[N, 3]`: encoding and geometry
    /// features, `[N, feature_width]`, detached from the field's own training.
    ///
    /// # Errors
    /// Positions of another shape.
    pub fn features(&self, positions: &Tensor) -> Result<Tensor> {
        let geometry = self.geometry(positions)?;
        Ok(Tensor::cat(&[geometry.encoding, geometry.features], 1)?.detach())
    }

    /// All parameters by name.
    pub fn named(&self) -> Vec<(&'static str, &Var)> {
        vec![
            ("field.table", &self.table),
            ("field.geometry.0", &self.geometry[0]),
            ("field.geometry.1", &self.geometry[1]),
            ("field.color.0", &self.color[0]),
            ("field.color.1", &self.color[1]),
        ]
    }

    /// Takes over parameters saved from a field of the same capacity.
    ///
    /// # Errors
    /// A parameter that is missing or has another shape; nothing is changed then.
    pub fn restore(&self, tensors: &HashMap<String, Tensor>) -> Result<()> {
        for (name, var) in self.named() {
            match tensors.get(name) {
                Some(tensor) if tensor.dims() == var.dims() => {}
                _ => bail!("the saved model has no {name} of shape {:?}", var.dims()),
            }
        }
        for (name, var) in self.named() {
            if let Some(tensor) = tensors.get(name) {
                var.set(tensor)?;
            }
        }
        Ok(())
    }
}

/// Real spherical harmonics up to degree 2 of a unit direction.
pub fn direction_features(d: Vec3) -> [f32; DIRECTION_FEATURES] {
    let Vec3 { x, y, z } = d;
    [
        0.282_094_8,
        0.488_602_5 * y,
        0.488_602_5 * z,
        0.488_602_5 * x,
        1.092_548_4 * x * y,
        1.092_548_4 * y * z,
        0.315_391_57 * (3.0 * z * z - 1.0),
        1.092_548_4 * x * z,
        0.546_274_2 * (x * x - y * y),
    ]
}

fn uniform(rng: &mut SmallRng, shape: (usize, usize), bound: f32) -> Result<Var> {
    let values: Vec<f32> = (0..shape.0 * shape.1)
        .map(|_| rng.random_range(-bound..bound))
        .collect();
    Var::from_tensor(&Tensor::from_vec(values, shape, &Device::Cpu)?)
}
