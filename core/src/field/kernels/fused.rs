//! The whole field in one op: encoding, networks and compositing, forward and backward.
//!
//! Rays are worked on in chunks whose activations stay in the second-level cache; only the encodings
//! are kept between the passes, and become their own derivatives in the backward pass.

use std::sync::{Arc, Mutex, PoisonError};

use candle_core::{CpuStorage, CustomOp2, DType, Device, InplaceOp1, Layout, Result, Shape, Tensor, bail};
use rayon::prelude::*;

use super::chunk::{Chunk, Plan, Workspace, encode_groups, gather_positions, with_workspace};
use super::composite::{EXTRA, composite_ray, gradient_of_ray};
use super::grid::scatter_levels;
use super::network::{NetworkShape, backward};
use super::{split_off, values};
use crate::field::encoding::{FEATURES_PER_LEVEL, GridShape};
use crate::field::rays::Samples;
use crate::lanes::{Dispatch, F32x16, LANES};

/// Parts whose weight gradients are summed on their own: the same for any number of threads.
const STRIPES: usize = 16;
/// Channels of the composited values: red, green, blue, gap.
pub const VALUE_CHANNELS: usize = 4;

/// Buffers that go from step to step, so that a steady state allocates nothing large.
#[derive(Clone, Debug)]
pub struct Buffers {
    free: Arc<Mutex<Free>>,
    /// Gradient of the hash table from the latest backward pass of [`render`], `[rows, 2]`. It does not
    /// go through candle's gradient store, which would allocate and add it twice.
    pub table_gradient: Tensor,
}

impl Buffers {
    /// Buffers for a grid.
    ///
    /// # Errors
    /// None on the CPU short of a lack of memory.
    pub fn new(grid: &GridShape) -> Result<Self> {
        let table_gradient = Tensor::zeros((grid.rows(), FEATURES_PER_LEVEL), DType::F32, &Device::Cpu)?;
        Ok(Self {
            free: Arc::default(),
            table_gradient,
        })
    }

    /// Samples and gaps that a finished step no longer needs, to be filled again.
    pub fn spare(&self) -> (Samples, Vec<f32>) {
        let mut free = self.free.lock().unwrap_or_else(PoisonError::into_inner);
        free.inputs.pop().unwrap_or_default()
    }

    fn take(&self) -> StepBuffers {
        let mut free = self.free.lock().unwrap_or_else(PoisonError::into_inner);
        free.steps.pop().unwrap_or_default()
    }
}

/// What finished steps left.
#[derive(Debug, Default)]
struct Free {
    steps: Vec<StepBuffers>,
    inputs: Vec<(Samples, Vec<f32>)>,
}

/// What one forward pass keeps for its backward pass.
#[derive(Debug, Default)]
struct StepBuffers {
    /// Unit positions, `[groups, 3]`.
    positions: Vec<F32x16>,
    /// Encodings, later their derivatives, `[groups, features]`.
    encodings: Vec<F32x16>,
}

/// A field's parameters.
#[derive(Clone, Copy, Debug)]
pub struct Parameters<'a> {
    /// The shape of the hash grid.
    pub grid: &'a GridShape,
    /// The shape of the networks.
    pub shape: NetworkShape,
    /// The hash table, `[rows, 2]`.
    pub table: &'a Tensor,
    /// The networks' weights, one after another (see [`NetworkShape::split`]).
    pub weights: &'a Tensor,
}

/// Renders packed samples to `[rays, 7]`: red, green, blue, mean distance to the measured surface (from
/// `gaps`), then ray length, opacity and distortion (see `composite_ray`).
///
/// Differentiable in the weights, and in the table through [`Buffers::table_gradient`].
///
/// # Errors
/// Arguments of other shapes, or not contiguous `f32` on the CPU.
pub fn render(
    parameters: Parameters,
    dispatch: Dispatch,
    buffers: &Buffers,
    samples: Arc<Samples>,
    gaps: Vec<f32>,
) -> Result<Tensor> {
    let plan = Plan::new(&samples);
    let op = Fused {
        grid: parameters.grid.clone(),
        shape: parameters.shape,
        samples,
        gaps,
        dispatch,
        plan,
        step: Mutex::new(buffers.take()),
        buffers: buffers.clone(),
    };
    parameters.table.apply_op2(parameters.weights, op)
}

/// What a forward pass without gradients gives for each sample.
#[derive(Debug, Default)]
pub struct Evaluated {
    /// Density per metre, `[N]`.
    pub density: Vec<f32>,
    /// Colour `[N, 3]`; empty unless wanted.
    pub color: Vec<f32>,
    /// The coarser half of the encoding and the geometry features, `[N, features / 2 + 15]`; empty unless
    /// wanted. (The finer half tells single pixels' texture rather than what a thing is.)
    pub features: Vec<f32>,
}

/// What [`evaluate`] gives beside the density.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wanted {
    /// Colours.
    pub color: bool,
    /// Features for the semantic field.
    pub features: bool,
}

/// Evaluates the field at samples into what held an earlier evaluation, without gradients.
///
/// # Errors
/// Arguments of other shapes, or not contiguous `f32` on the CPU.
pub fn evaluate(
    parameters: Parameters,
    dispatch: Dispatch,
    samples: &Samples,
    wanted: Wanted,
    into: &mut Evaluated,
) -> Result<()> {
    let (grid, shape) = (parameters.grid, parameters.shape);
    let (table_storage, table_layout) = parameters.table.storage_and_layout();
    let (weights_storage, weights_layout) = parameters.weights.storage_and_layout();
    let (candle_core::Storage::Cpu(table), candle_core::Storage::Cpu(weights)) =
        (&*table_storage, &*weights_storage)
    else {
        bail!("the fused kernels work on the CPU")
    };
    let table: &[[f32; 2]] = bytemuck::cast_slice(values(table, table_layout, "evaluate")?);
    let weights = values(weights, weights_layout, "evaluate")?;
    let coarse = shape.features / 2;
    let width = coarse + super::network::GEOMETRY_FEATURES;
    let plan = Plan::new(samples);
    let count = samples.len();
    into.density.resize(count, 0.0);
    into.color.resize(if wanted.color { 3 * count } else { 0 }, 0.0);
    into.features
        .resize(if wanted.features { width * count } else { 0 }, 0.0);
    let mut rest = (&mut into.density[..], &mut into.color[..], &mut into.features[..]);
    let tasks: Vec<_> = plan
        .chunks
        .iter()
        .map(|chunk| {
            let count = chunk.samples.len();
            let density = split_off(&mut rest.0, count);
            let color = split_off(&mut rest.1, if wanted.color { 3 * count } else { 0 });
            let features = split_off(&mut rest.2, if wanted.features { width * count } else { 0 });
            (chunk, density, color, features)
        })
        .collect();
    tasks
        .into_par_iter()
        .for_each(|(chunk, density, color, features)| {
            with_workspace(|work| {
                let mut encoding = std::mem::take(&mut work.encoding);
                encoding.resize(chunk.groups() * shape.features, F32x16::ZERO);
                work.positions.resize(chunk.groups() * 3, F32x16::ZERO);
                gather_positions(samples, chunk, &mut work.positions);
                encode_groups(grid, table, &work.positions, &mut encoding, dispatch);
                work.activate(&shape, samples, chunk, weights, &encoding, wanted.color, dispatch);
                for (k, density) in density.iter_mut().enumerate() {
                    *density = work.activations.density[k / LANES].0[k % LANES];
                }
                for (k, color) in color.iter_mut().enumerate() {
                    *color = work.activations.color[k / 3 / LANES * 3 + k % 3].0[k / 3 % LANES];
                }
                for (k, features) in features.chunks_exact_mut(width).enumerate() {
                    let (group, lane) = (k / LANES, k % LANES);
                    let own = &encoding[group * shape.features..group * shape.features + coarse];
                    let geometry = &work.activations.out(group)[1..];
                    for (place, feature) in features.iter_mut().zip(own.iter().chain(geometry)) {
                        *place = feature.0[lane];
                    }
                }
                work.encoding = encoding;
            });
        });
    Ok(())
}

struct Fused {
    grid: GridShape,
    shape: NetworkShape,
    samples: Arc<Samples>,
    gaps: Vec<f32>,
    dispatch: Dispatch,
    plan: Plan,
    /// From the forward to the backward pass.
    step: Mutex<StepBuffers>,
    buffers: Buffers,
}

impl Drop for Fused {
    fn drop(&mut self) {
        let step = self.step.get_mut().unwrap_or_else(PoisonError::into_inner);
        let mut free = self.buffers.free.lock().unwrap_or_else(PoisonError::into_inner);
        free.steps.push(std::mem::take(step));
        // Only what is asked for again is worth keeping, and a step asks for one.
        if let (Some(samples), true) = (Arc::get_mut(&mut self.samples), free.inputs.is_empty()) {
            free.inputs
                .push((std::mem::take(samples), std::mem::take(&mut self.gaps)));
        }
    }
}

impl CustomOp2 for Fused {
    fn name(&self) -> &'static str {
        "fused render"
    }

    fn cpu_fwd(
        &self,
        table: &CpuStorage,
        table_layout: &Layout,
        weights: &CpuStorage,
        weights_layout: &Layout,
    ) -> Result<(CpuStorage, Shape)> {
        let table_dims = table_layout.shape().dims2()?;
        let fits = table_dims == (self.grid.rows(), FEATURES_PER_LEVEL)
            && self.grid.features() == self.shape.features
            && weights_layout.shape().elem_count() == self.shape.weights();
        if !fits || self.gaps.len() != self.samples.len() {
            bail!("fused render: a table {table_dims:?} or weights of another shape");
        }
        let table: &[[f32; 2]] = bytemuck::cast_slice(values(table, table_layout, self.name())?);
        let weights = values(weights, weights_layout, self.name())?;
        let width = VALUE_CHANNELS + EXTRA;
        let rays = self.samples.packing.rays();
        let mut out = vec![0.0_f32; rays * width];
        let mut step = self.step.lock().unwrap_or_else(PoisonError::into_inner);
        let step = &mut *step;
        step.positions.resize(self.plan.groups * 3, F32x16::ZERO);
        step.encodings
            .resize(self.plan.groups * self.shape.features, F32x16::ZERO);
        let mut rest: &mut [f32] = &mut out;
        let positions = self.plan.split(&mut step.positions, 3);
        let encodings = self.plan.split(&mut step.encodings, self.shape.features);
        let tasks: Vec<_> = positions
            .into_iter()
            .zip(encodings)
            .map(|((chunk, positions), (_, encoding))| {
                let own = split_off(&mut rest, chunk.rays.len() * width);
                (chunk, positions, encoding, own)
            })
            .collect();
        tasks
            .into_par_iter()
            .for_each(|(chunk, positions, encoding, out)| {
                gather_positions(&self.samples, chunk, positions);
                encode_groups(&self.grid, table, positions, encoding, self.dispatch);
                with_workspace(|work| {
                    self.activate(work, chunk, encoding, weights);
                    for (ray, out) in chunk.rays.clone().zip(out.chunks_exact_mut(width)) {
                        let range = self.samples.packing.range(ray);
                        let local = range.start - chunk.samples.start..range.end - chunk.samples.start;
                        let value = &work.value[local.start * VALUE_CHANNELS..local.end * VALUE_CHANNELS];
                        let of_ray = self.samples.packing.of_ray(ray);
                        composite_ray(of_ray, &work.density[local], value, out);
                    }
                });
            });
        Ok((CpuStorage::F32(out), Shape::from((rays, width))))
    }

    fn bwd(
        &self,
        _table: &Tensor,
        weights: &Tensor,
        _out: &Tensor,
        grad: &Tensor,
    ) -> Result<(Option<Tensor>, Option<Tensor>)> {
        let grad = grad.flatten_all()?.to_vec1::<f32>()?;
        let flat = weights.flatten_all()?.to_vec1::<f32>()?;
        let transposed = self.shape.transposed(&flat);
        let mut step = self.step.lock().unwrap_or_else(PoisonError::into_inner);
        let step = &mut *step;
        if step.encodings.len() != self.plan.groups * self.shape.features {
            bail!("fused render: the backward pass came before the forward pass");
        }
        let mut parts = self.plan.split(&mut step.encodings, self.shape.features);
        let per_stripe = parts.len().div_ceil(STRIPES).max(1);
        let sums: Vec<Vec<f32>> = parts
            .par_chunks_mut(per_stripe)
            .map(|stripe| {
                with_workspace(|work| {
                    work.gradients.weights.clear();
                    for (chunk, encoding) in stripe {
                        self.backward_chunk(work, chunk, encoding, &flat, &transposed, &grad);
                    }
                    work.gradients.weights.clone()
                })
            })
            .collect();
        let mut weights_grad = vec![0.0_f32; flat.len()];
        for sum in &sums {
            for (total, part) in weights_grad.iter_mut().zip(sum) {
                *total += part;
            }
        }
        self.buffers.table_gradient.inplace_op1(&TableGradient {
            grid: &self.grid,
            dispatch: self.dispatch,
            step,
        })?;
        Ok((
            None,
            Some(Tensor::from_vec(weights_grad, weights.shape(), &Device::Cpu)?),
        ))
    }
}

/// Replaces a table's gradient by that of one step: each level on its own, samples in order, so that the
/// sum is the same for any number of threads.
struct TableGradient<'a> {
    grid: &'a GridShape,
    dispatch: Dispatch,
    step: &'a StepBuffers,
}

impl InplaceOp1 for TableGradient<'_> {
    fn name(&self) -> &'static str {
        "table gradient"
    }

    fn cpu_fwd(&self, gradient: &mut CpuStorage, layout: &Layout) -> Result<()> {
        let CpuStorage::F32(gradient) = gradient else {
            bail!("the table's gradient is f32")
        };
        if layout.contiguous_offsets() != Some((0, self.grid.rows() * FEATURES_PER_LEVEL)) {
            bail!("the table's gradient has another shape than the table");
        }
        let (positions, derivatives) = (&self.step.positions, &self.step.encodings);
        let gradient = bytemuck::cast_slice_mut(gradient);
        scatter_levels(self.dispatch, self.grid, gradient, positions, derivatives);
        Ok(())
    }
}

impl Fused {
    /// Computes a chunk's activations, densities and values.
    fn activate(&self, work: &mut Workspace, chunk: &Chunk, encoding: &[F32x16], weights: &[f32]) {
        let (shape, samples) = (&self.shape, &self.samples);
        work.activate(shape, samples, chunk, weights, encoding, true, self.dispatch);
        work.gather(chunk, &self.gaps);
    }

    /// Turns a chunk's encodings into their derivatives and adds to the weights' gradient.
    fn backward_chunk(
        &self,
        work: &mut Workspace,
        chunk: &Chunk,
        encoding: &mut [F32x16],
        weights: &[f32],
        transposed: &[f32],
        grad: &[f32],
    ) {
        let width = VALUE_CHANNELS + EXTRA;
        let count = chunk.samples.len();
        self.activate(work, chunk, encoding, weights);
        work.of_density.resize(count, 0.0);
        work.of_value.resize(count * VALUE_CHANNELS, 0.0);
        for ray in chunk.rays.clone() {
            let range = self.samples.packing.range(ray);
            let local = range.start - chunk.samples.start..range.end - chunk.samples.start;
            let wide = local.start * VALUE_CHANNELS..local.end * VALUE_CHANNELS;
            gradient_of_ray(
                self.samples.packing.of_ray(ray),
                &work.density[local.clone()],
                &work.value[wide.clone()],
                &grad[ray * width..(ray + 1) * width],
                &mut work.of_density[local],
                &mut work.of_value[wide],
            );
        }
        work.by_density.clear();
        work.by_density.resize(chunk.groups(), F32x16::ZERO);
        work.by_color.clear();
        work.by_color.resize(chunk.groups() * 3, F32x16::ZERO);
        for k in 0..count {
            let (group, lane) = (k / LANES, k % LANES);
            work.by_density[group].0[lane] = work.of_density[k];
            for channel in 0..3 {
                work.by_color[group * 3 + channel].0[lane] = work.of_value[k * VALUE_CHANNELS + channel];
            }
        }
        backward(
            self.dispatch,
            &self.shape,
            transposed,
            encoding,
            &work.activations,
            &work.by_density,
            &work.by_color,
            &mut work.gradients,
        );
    }
}
