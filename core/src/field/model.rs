//! The radiance field: a hash grid and two small networks.

use std::collections::HashMap;
use std::sync::Arc;

use candle_core::{Device, Result, Tensor, Var, bail};
use glam::Vec3;
use rand::{Rng, SeedableRng, rngs::SmallRng};

use super::kernels::{
    self, Buffers, Composite, DIRECTION_FEATURES, Dispatch, Evaluated, GEOMETRY_FEATURES,
    INITIAL_LOG_DENSITY, LOG_DENSITY_RANGE, NetworkShape, Parameters, Wanted, encode,
};
use super::{Capacity, GridShape, Samples, Volume};

/// Density, geometry features and colour at any point of a volume (Semantic-NeRF, Fig. 2, with the
/// positional encoding and trunk replaced by a hash grid and a one-hidden-layer network).
#[derive(Debug)]
pub struct RadianceField {
    volume: Volume,
    grid: GridShape,
    shape: NetworkShape,
    dispatch: Dispatch,
    table: Var,
    weights: Var,
    buffers: Buffers,
}

impl RadianceField {
    /// A field with random parameters.
    ///
    /// # Errors
    /// None on the CPU short of a lack of memory.
    pub fn new(volume: Volume, capacity: &Capacity, seed: u64) -> Result<Self> {
        let mut rng = SmallRng::seed_from_u64(seed ^ 0x5_eedf_1e1d);
        let grid = capacity.grid();
        let shape = NetworkShape {
            features: grid.features(),
            hidden: capacity.hidden,
            color_hidden: capacity.hidden / 2,
        };
        let table: Vec<f32> = (0..2 * grid.rows())
            .map(|_| rng.random_range(-1e-4..1e-4))
            .collect();
        let mut weights = Vec::with_capacity(shape.weights());
        for (inputs, outputs) in shape.layers() {
            let bound = (6.0 / (inputs + outputs) as f32).sqrt();
            weights.extend((0..inputs * outputs).map(|_| rng.random_range(-bound..bound)));
        }
        let table = Tensor::from_vec(table, (grid.rows(), 2), &Device::Cpu)?;
        let weights = Tensor::from_vec(weights, shape.weights(), &Device::Cpu)?;
        Ok(Self {
            volume,
            buffers: Buffers::new(&grid)?,
            grid,
            shape,
            dispatch: Dispatch::detect(),
            table: Var::from_tensor(&table)?,
            weights: Var::from_tensor(&weights)?,
        })
    }

    /// Computes on this vector unit instead of the best one. The processor must have it.
    pub fn set_dispatch(&mut self, dispatch: Dispatch) {
        self.dispatch = dispatch;
    }

    /// The part of the world that it models.
    pub fn volume(&self) -> &Volume {
        &self.volume
    }

    /// The hash table `[rows, 2]`.
    pub fn table(&self) -> &Var {
        &self.table
    }

    /// The weights of the networks, one after another.
    pub fn weights(&self) -> &Var {
        &self.weights
    }

    /// Gradient of the table `[rows, 2]` from the latest backward pass through [`RadianceField::render`].
    pub fn table_gradient(&self) -> &Tensor {
        &self.buffers.table_gradient
    }

    /// Trainable parameters.
    pub fn parameters(&self) -> usize {
        self.table.elem_count() + self.weights.elem_count()
    }

    /// Width of the features that the semantic head reads.
    pub fn feature_width(&self) -> usize {
        self.grid.features() / 2 + GEOMETRY_FEATURES
    }

    /// Renders samples to `[rays, 7]`: red, green, blue, mean distance to the measured surface (given
    /// for each sample by `gaps`), ray length, opacity, distortion; differentiable in
    /// the weights, and in the table through [`RadianceField::table_gradient`].
    ///
    /// # Errors
    /// `gaps` of another length than the samples.
    pub fn render(&self, samples: Arc<Samples>, gaps: Vec<f32>) -> Result<Tensor> {
        kernels::render(self.all(), &self.buffers, samples, gaps)
    }

    /// The same as [`RadianceField::render`] with plain candle ops between the encoding and the
    /// compositing: what the fused kernel is tested against.
    ///
    /// # Errors
    /// As there.
    pub fn render_plain(&self, samples: &Samples, gaps: &[f32]) -> Result<Tensor> {
        let mut start = 0;
        let mut matrices = Vec::with_capacity(4);
        for (inputs, outputs) in self.shape.layers() {
            let flat = self.weights.narrow(0, start, inputs * outputs)?;
            matrices.push(flat.reshape((inputs, outputs))?);
            start += inputs * outputs;
        }
        let encoding = encode(&self.grid, &samples.positions()?, &self.table)?;
        let out = encoding.matmul(&matrices[0])?.relu()?.matmul(&matrices[1])?;
        let (low, high) = LOG_DENSITY_RANGE;
        let density = out
            .narrow(1, 0, 1)?
            .squeeze(1)?
            .affine(1.0, f64::from(INITIAL_LOG_DENSITY))?
            .clamp(low, high)?
            .exp()?;
        let features = out.narrow(1, 1, GEOMETRY_FEATURES)?;
        let input = Tensor::cat(&[features, samples.directions()?], 1)?;
        let hidden = input.matmul(&matrices[2])?.relu()?;
        // The logistic function by tanh, which has a backward pass in candle.
        let color = hidden
            .matmul(&matrices[3])?
            .affine(0.5, 0.0)?
            .tanh()?
            .affine(0.5, 0.5)?;
        let gaps = Tensor::from_slice(gaps, (samples.len(), 1), &Device::Cpu)?;
        let values = Tensor::cat(&[color, gaps], 1)?;
        Composite(Arc::new(samples.packing.clone())).apply(&density, &values)
    }

    /// Density, and colours and features where wanted, at samples; without gradients.
    ///
    /// # Errors
    /// None on the CPU.
    pub fn evaluate(&self, samples: &Samples, wanted: Wanted) -> Result<Evaluated> {
        kernels::evaluate(self.all(), samples, wanted)
    }

    fn all(&self) -> Parameters<'_> {
        Parameters {
            grid: &self.grid,
            shape: self.shape,
            table: &self.table,
            weights: &self.weights,
            dispatch: self.dispatch,
        }
    }

    /// All parameters by name.
    pub fn named(&self) -> [(&'static str, &Var); 2] {
        [("field.table", &self.table), ("field.weights", &self.weights)]
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

#[cfg(test)]
mod tests;
