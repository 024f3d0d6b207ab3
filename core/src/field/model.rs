//! The radiance field: a hash grid and two small networks.

use std::collections::HashMap;
use std::sync::Arc;

use candle_core::{Device, Result, Tensor, Var, backprop::GradStore, bail};
use rand::{Rng, SeedableRng, rngs::SmallRng};

use super::kernels::{
    self, Adam, Buffers, Dispatch, Evaluated, GEOMETRY_FEATURES, NetworkShape, Parameters, Wanted,
};
use super::{Capacity, GridShape, Samples, Volume, plain};

/// A way to compute a field. All give the same numbers up to rounding.
#[derive(Clone, Copy, Debug)]
pub enum Backend {
    /// The fused kernels, on this vector unit. The processor must have it.
    Fused(Dispatch),
    /// Plain candle ops, which the kernels are held against.
    Plain,
}

impl Default for Backend {
    /// The fastest.
    fn default() -> Self {
        Self::Fused(Dispatch::detect())
    }
}

/// Density, geometry features and colour at any point of a volume (Semantic-NeRF, Fig. 2, with the
/// positional encoding and trunk replaced by a hash grid and a one-hidden-layer network).
#[derive(Debug)]
pub struct RadianceField {
    volume: Volume,
    grid: GridShape,
    shape: NetworkShape,
    engine: Engine,
    table: Var,
    weights: Var,
}

/// What a [`Backend`] needs to compute.
#[derive(Debug)]
enum Engine {
    Fused(Dispatch, Buffers),
    Plain,
}

impl RadianceField {
    /// A field with random parameters, the same on every backend.
    ///
    /// # Errors
    /// Candle's.
    pub fn new(volume: Volume, capacity: &Capacity, seed: u64, backend: Backend) -> Result<Self> {
        let mut rng = SmallRng::seed_from_u64(seed ^ 0x5_eedf_1e1d);
        let grid = capacity.grid();
        let shape = NetworkShape {
            features: grid.features(),
            hidden: capacity.hidden,
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
        let engine = match backend {
            Backend::Fused(dispatch) => Engine::Fused(dispatch, Buffers::new(&grid)?),
            Backend::Plain => Engine::Plain,
        };
        Ok(Self {
            volume,
            grid,
            shape,
            engine,
            table: Var::from_tensor(&table)?,
            weights: Var::from_tensor(&weights)?,
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

    /// The weights of the networks, one after another.
    pub fn weights(&self) -> &Var {
        &self.weights
    }

    /// Gradient of the table `[rows, 2]`, from the newest backward pass through [`RadianceField::render`] and its
    /// gradients. Rows that no sample touched have exactly zero.
    pub fn table_gradient<'a>(&'a self, gradients: &'a GradStore) -> Option<&'a Tensor> {
        match &self.engine {
            Engine::Fused(_, buffers) => Some(&buffers.table_gradient),
            Engine::Plain => gradients.get(&self.table),
        }
    }

    /// Doubles the table without a change of what the field renders. Returns, for each new row, the row that it was
    /// copied from.
    ///
    /// # Errors
    /// Candle's; nothing is changed then.
    pub fn grow(&mut self) -> Result<Vec<u32>> {
        let (grid, sources) = self.grid.doubled();
        let rows = Tensor::from_slice(&sources, sources.len(), &Device::Cpu)?;
        let table = Var::from_tensor(&self.table.index_select(&rows, 0)?)?;
        if let Engine::Fused(_, buffers) = &mut self.engine {
            *buffers = Buffers::new(&grid)?;
        }
        self.table = table;
        self.grid = grid;
        Ok(sources)
    }

    /// Optimisers of the table and of the weights.
    pub fn optimisers(&self) -> [Adam; 2] {
        [Adam::new(&self.table), Adam::new(&self.weights)]
    }

    /// Trainable parameters.
    pub fn parameters(&self) -> usize {
        self.table.elem_count() + self.weights.elem_count()
    }

    /// Width of the features that the semantic field reads.
    pub fn feature_width(&self) -> usize {
        self.grid.features() / 2 + GEOMETRY_FEATURES
    }

    /// Renders samples to `[rays, 7]`: red, green, blue, mean distance to the measured surface (given
    /// for each sample by `gaps`), ray length, opacity, distortion; differentiable in the weights, and in
    /// the table by [`RadianceField::table_gradient`].
    ///
    /// # Errors
    /// `gaps` of another length than the samples; candle's.
    pub fn render(&self, samples: Arc<Samples>, gaps: Vec<f32>) -> Result<Tensor> {
        match &self.engine {
            Engine::Fused(dispatch, buffers) => {
                kernels::render(self.all(), *dispatch, buffers, samples, gaps)
            }
            Engine::Plain => plain::render(self.all(), &samples, &gaps),
        }
    }

    /// Density, and colours and features where wanted, at samples; without gradients.
    ///
    /// # Errors
    /// Candle's.
    pub fn evaluate(&self, samples: &Samples, wanted: Wanted) -> Result<Evaluated> {
        let mut evaluated = Evaluated::default();
        self.evaluate_into(samples, wanted, &mut evaluated)?;
        Ok(evaluated)
    }

    /// The same in the memory of an earlier evaluation.
    ///
    /// # Errors
    /// As [`RadianceField::evaluate`].
    pub fn evaluate_into(&self, samples: &Samples, wanted: Wanted, into: &mut Evaluated) -> Result<()> {
        match &self.engine {
            Engine::Fused(dispatch, _) => kernels::evaluate(self.all(), *dispatch, samples, wanted, into),
            Engine::Plain => plain::evaluate(self.all(), samples, wanted, into),
        }
    }

    /// Samples and gaps that an earlier [`RadianceField::render`] no longer needs, to be filled again.
    pub fn spare(&self) -> (Samples, Vec<f32>) {
        match &self.engine {
            Engine::Fused(_, buffers) => buffers.spare(),
            Engine::Plain => Default::default(),
        }
    }

    fn all(&self) -> Parameters<'_> {
        Parameters {
            grid: &self.grid,
            shape: self.shape,
            table: &self.table,
            weights: &self.weights,
        }
    }

    /// All parameters by name.
    pub fn named(&self) -> [(&'static str, &Var); 2] {
        [("field.table", &self.table), ("field.weights", &self.weights)]
    }
}

/// Takes over saved parameters by name.
///
/// # Errors
/// A parameter that is missing or has another shape; nothing is changed then.
pub(super) fn restore(named: &[(&str, &Var)], tensors: &HashMap<String, Tensor>) -> Result<()> {
    let mut found = Vec::with_capacity(named.len());
    for (name, var) in named {
        match tensors.get(*name) {
            Some(tensor) if is_alike(tensor, var) => found.push(tensor),
            _ => bail!(
                "the saved model has no {} of {:?} and shape {:?}",
                name,
                var.dtype(),
                var.dims()
            ),
        }
    }
    for ((_, var), tensor) in named.iter().zip(found) {
        var.set(tensor)?;
    }
    Ok(())
}

/// Whether a saved tensor has the shape and the kind of numbers of a parameter.
pub(crate) fn is_alike(saved: &Tensor, parameter: &Tensor) -> bool {
    saved.dims() == parameter.dims() && saved.dtype() == parameter.dtype()
}

#[cfg(test)]
mod tests;
