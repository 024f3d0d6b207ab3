//! The whole field in one op: encoding, networks and compositing, forward and backward.
//!
//! Rays are worked on in chunks whose activations stay in the second-level cache; only the encodings
//! are kept between the passes, and become their own derivatives in the backward pass.

use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use candle_core::{CpuStorage, CustomOp2, Device, Layout, Result, Shape, Tensor, bail};
use rayon::prelude::*;

use super::composite::{EXTRA, composite_ray, gradient_of_ray};
use super::lanes::{Dispatch, Group, LANES};
use super::network::{Activations, Gradients, NetworkShape, backward, forward};
use super::values;
use crate::field::encoding::{FEATURES_PER_LEVEL, GridShape};
use crate::field::rays::Samples;

/// Samples of a chunk, unless a single ray has more.
const CHUNK_SAMPLES: usize = 384;
/// Parts whose weight gradients are summed on their own: the same for any number of threads.
const STRIPES: usize = 16;
/// Channels of the composited values: red, green, blue, gap.
pub const VALUE_CHANNELS: usize = 4;

/// Renders packed samples to `[rays, 7]`: red, green, blue, mean distance to the measured surface (from
/// `gaps`), then ray length, opacity and distortion as [`Composite`](super::Composite) has them.
///
/// Differentiable in the hash table `[rows, 2]` and in the weights (one tensor, see
/// [`NetworkShape::split`]).
///
/// # Errors
/// Arguments of other shapes, or not contiguous `f32` on the CPU.
pub fn render(
    grid: &GridShape,
    shape: NetworkShape,
    samples: Arc<Samples>,
    gaps: Vec<f32>,
    dispatch: Dispatch,
    table: &Tensor,
    weights: &Tensor,
) -> Result<Tensor> {
    let plan = Plan::new(&samples);
    table.apply_op2(
        weights,
        Fused {
            grid: grid.clone(),
            shape,
            samples,
            gaps,
            dispatch,
            plan,
            encodings: Mutex::new(Vec::new()),
        },
    )
}

/// What a forward pass without gradients gives for each sample.
#[derive(Debug, Default)]
pub struct Evaluated {
    /// Density per metre, `[N]`.
    pub density: Vec<f32>,
    /// Colour `[N, 3]`; empty unless wanted.
    pub color: Vec<f32>,
    /// Encoding and geometry features `[N, features + 15]`; empty unless wanted.
    pub features: Vec<f32>,
}

/// What [`evaluate`] gives beside the density.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wanted {
    /// Colours.
    pub color: bool,
    /// Features for the semantic head.
    pub features: bool,
}

/// Evaluates the field at samples, without gradients.
///
/// # Errors
/// Arguments of other shapes, or not contiguous `f32` on the CPU.
pub fn evaluate(
    grid: &GridShape,
    shape: NetworkShape,
    samples: &Samples,
    wanted: Wanted,
    dispatch: Dispatch,
    table: &Tensor,
    weights: &Tensor,
) -> Result<Evaluated> {
    let (table_storage, table_layout) = table.storage_and_layout();
    let (weights_storage, weights_layout) = weights.storage_and_layout();
    let (candle_core::Storage::Cpu(table), candle_core::Storage::Cpu(weights)) =
        (&*table_storage, &*weights_storage)
    else {
        bail!("the fused kernels work on the CPU")
    };
    let table: &[[f32; 2]] = bytemuck::cast_slice(values(table, table_layout, "evaluate")?);
    let weights = values(weights, weights_layout, "evaluate")?;
    let width = shape.features + super::network::GEOMETRY_FEATURES;
    let plan = Plan::new(samples);
    let parts: Vec<Evaluated> = plan
        .chunks
        .par_iter()
        .map_init(Workspace::default, |work, chunk| {
            let mut encoding = std::mem::take(&mut work.encoding);
            encoding.resize(chunk.groups() * shape.features, Group::ZERO);
            encode_chunk(grid, samples, chunk, table, &mut encoding);
            work.activate(&shape, samples, chunk, weights, &encoding, wanted.color, dispatch);
            let count = chunk.samples.len();
            let mut part = Evaluated {
                density: (0..count)
                    .map(|k| work.activations.density[k / LANES].0[k % LANES])
                    .collect(),
                ..Evaluated::default()
            };
            if wanted.color {
                part.color = (0..3 * count)
                    .map(|k| work.activations.color[k / 3 / LANES * 3 + k % 3].0[k / 3 % LANES])
                    .collect();
            }
            if wanted.features {
                part.features.reserve(count * width);
                for k in 0..count {
                    let (group, lane) = (k / LANES, k % LANES);
                    let own = &encoding[group * shape.features..(group + 1) * shape.features];
                    let geometry = &work.activations.out(group)[1..];
                    part.features
                        .extend(own.iter().chain(geometry).map(|feature| feature.0[lane]));
                }
            }
            work.encoding = encoding;
            part
        })
        .collect();
    let mut all = Evaluated::default();
    for part in parts {
        all.density.extend(part.density);
        all.color.extend(part.color);
        all.features.extend(part.features);
    }
    Ok(all)
}

/// Rays that are worked on together.
#[derive(Clone, Debug)]
struct Chunk {
    rays: Range<usize>,
    samples: Range<usize>,
    first_group: usize,
}

impl Chunk {
    fn groups(&self) -> usize {
        self.samples.len().div_ceil(LANES)
    }
}

/// How the rays are divided.
#[derive(Clone, Debug)]
struct Plan {
    chunks: Vec<Chunk>,
    groups: usize,
}

impl Plan {
    fn new(samples: &Samples) -> Self {
        let packing = &samples.packing;
        let mut chunks = Vec::new();
        let mut groups = 0;
        let mut first = 0;
        while first < packing.rays() {
            let start = packing.starts[first] as usize;
            let mut end = first + 1;
            while end < packing.rays() && packing.starts[end + 1] as usize - start <= CHUNK_SAMPLES {
                end += 1;
            }
            let chunk = Chunk {
                rays: first..end,
                samples: start..packing.starts[end] as usize,
                first_group: groups,
            };
            groups += chunk.groups();
            chunks.push(chunk);
            first = end;
        }
        Self { chunks, groups }
    }
}

/// Buffers of one thread.
#[derive(Default)]
struct Workspace {
    encoding: Vec<Group>,
    activations: Activations,
    gradients: Gradients,
    density: Vec<f32>,
    value: Vec<f32>,
    of_density: Vec<f32>,
    of_value: Vec<f32>,
    by_density: Vec<Group>,
    by_color: Vec<Group>,
}

impl Workspace {
    /// Computes the activations of a chunk.
    #[allow(clippy::too_many_arguments)]
    fn activate(
        &mut self,
        shape: &NetworkShape,
        samples: &Samples,
        chunk: &Chunk,
        weights: &[f32],
        encoding: &[Group],
        with_color: bool,
        dispatch: Dispatch,
    ) {
        self.activations.resize(shape, chunk.groups());
        if with_color {
            for ray in chunk.rays.clone() {
                let direction = samples.direction(ray);
                for sample in samples.packing.range(ray) {
                    let k = sample - chunk.samples.start;
                    let places = self.activations.directions(k / LANES);
                    for (place, feature) in places.iter_mut().zip(direction) {
                        place.0[k % LANES] = *feature;
                    }
                }
            }
        }
        forward(
            dispatch,
            shape,
            weights,
            encoding,
            with_color,
            &mut self.activations,
        );
    }

    /// Copies densities and values `[n, 4]` of a chunk's samples to where compositing reads them.
    fn gather(&mut self, chunk: &Chunk, gaps: &[f32]) {
        self.density.clear();
        self.value.clear();
        for (k, gap) in gaps[chunk.samples.clone()].iter().enumerate() {
            let (group, lane) = (k / LANES, k % LANES);
            self.density.push(self.activations.density[group].0[lane]);
            let color = &self.activations.color[group * 3..group * 3 + 3];
            self.value
                .extend([color[0].0[lane], color[1].0[lane], color[2].0[lane], *gap]);
        }
    }
}

struct Fused {
    grid: GridShape,
    shape: NetworkShape,
    samples: Arc<Samples>,
    gaps: Vec<f32>,
    dispatch: Dispatch,
    plan: Plan,
    /// `[groups, features]`, from the forward to the backward pass.
    encodings: Mutex<Vec<Group>>,
}

impl Fused {
    /// One slice of the encodings for each chunk.
    fn by_chunk<'a>(&'a self, mut encodings: &'a mut [Group]) -> Vec<(&'a Chunk, &'a mut [Group])> {
        let mut parts = Vec::with_capacity(self.plan.chunks.len());
        for chunk in &self.plan.chunks {
            let (own, rest) = encodings.split_at_mut(chunk.groups() * self.shape.features);
            encodings = rest;
            parts.push((chunk, own));
        }
        parts
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
        let mut encodings = self.encodings.lock().unwrap_or_else(PoisonError::into_inner);
        encodings.resize(self.plan.groups * self.shape.features, Group::ZERO);
        let mut rest: &mut [f32] = &mut out;
        let tasks: Vec<_> = self
            .by_chunk(&mut encodings)
            .into_iter()
            .map(|(chunk, encoding)| {
                let (own, others) = std::mem::take(&mut rest).split_at_mut(chunk.rays.len() * width);
                rest = others;
                (chunk, encoding, own)
            })
            .collect();
        tasks
            .into_par_iter()
            .for_each_init(Workspace::default, |work, (chunk, encoding, out)| {
                encode_chunk(&self.grid, &self.samples, chunk, table, encoding);
                work.activate(
                    &self.shape,
                    &self.samples,
                    chunk,
                    weights,
                    encoding,
                    true,
                    self.dispatch,
                );
                work.gather(chunk, &self.gaps);
                for (ray, out) in chunk.rays.clone().zip(out.chunks_exact_mut(width)) {
                    let range = self.samples.packing.range(ray);
                    let local = range.start - chunk.samples.start..range.end - chunk.samples.start;
                    let value = &work.value[local.start * VALUE_CHANNELS..local.end * VALUE_CHANNELS];
                    composite_ray(self.samples.packing.of_ray(ray), &work.density[local], value, out);
                }
            });
        Ok((CpuStorage::F32(out), Shape::from((rays, width))))
    }

    fn bwd(
        &self,
        table: &Tensor,
        weights: &Tensor,
        _out: &Tensor,
        grad: &Tensor,
    ) -> Result<(Option<Tensor>, Option<Tensor>)> {
        let grad = grad.flatten_all()?.to_vec1::<f32>()?;
        let flat = weights.flatten_all()?.to_vec1::<f32>()?;
        let transposed = self.shape.transposed(&flat);
        let mut encodings = self.encodings.lock().unwrap_or_else(PoisonError::into_inner);
        if encodings.len() != self.plan.groups * self.shape.features {
            bail!("fused render: the backward pass came before the forward pass");
        }
        let mut parts = self.by_chunk(&mut encodings);
        let per_stripe = parts.len().div_ceil(STRIPES).max(1);
        let sums: Vec<Vec<f32>> = parts
            .par_chunks_mut(per_stripe)
            .map_init(Workspace::default, |work, stripe| {
                work.gradients.weights.clear();
                for (chunk, encoding) in stripe {
                    self.backward_chunk(work, chunk, encoding, &flat, &transposed, &grad);
                }
                work.gradients.weights.clone()
            })
            .collect();
        let mut weights_grad = vec![0.0_f32; flat.len()];
        for sum in &sums {
            for (total, part) in weights_grad.iter_mut().zip(sum) {
                *total += part;
            }
        }
        let table_grad = self.scatter(&encodings);
        // Large buffers go back before the next step takes new ones.
        *encodings = Vec::new();
        Ok((
            Some(Tensor::from_vec(table_grad, table.shape(), &Device::Cpu)?),
            Some(Tensor::from_vec(weights_grad, weights.shape(), &Device::Cpu)?),
        ))
    }
}

impl Fused {
    /// Turns a chunk's encodings into their derivatives and adds to the weights' gradient.
    fn backward_chunk(
        &self,
        work: &mut Workspace,
        chunk: &Chunk,
        encoding: &mut [Group],
        weights: &[f32],
        transposed: &[f32],
        grad: &[f32],
    ) {
        let width = VALUE_CHANNELS + EXTRA;
        let count = chunk.samples.len();
        work.activate(
            &self.shape,
            &self.samples,
            chunk,
            weights,
            encoding,
            true,
            self.dispatch,
        );
        work.gather(chunk, &self.gaps);
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
        work.by_density.resize(chunk.groups(), Group::ZERO);
        work.by_color.clear();
        work.by_color.resize(chunk.groups() * 3, Group::ZERO);
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

    /// Gradient of the table from the encodings' derivatives: each level on its own, samples in order,
    /// so that the sum is the same for any number of threads.
    fn scatter(&self, derivatives: &[Group]) -> Vec<f32> {
        let mut table_grad = vec![0.0_f32; self.grid.rows() * FEATURES_PER_LEVEL];
        let mut rest: &mut [[f32; 2]] = bytemuck::cast_slice_mut(&mut table_grad);
        let mut tasks = Vec::with_capacity(self.grid.levels().len());
        for (index, level) in self.grid.levels().iter().enumerate() {
            let (own, others) = rest.split_at_mut(level.rows);
            rest = others;
            tasks.push((index * FEATURES_PER_LEVEL, level, own));
        }
        // The finest levels take the longest, so they come first.
        tasks
            .into_par_iter()
            .rev()
            .with_max_len(1)
            .for_each(|(place, level, own)| {
                for chunk in &self.plan.chunks {
                    for (k, sample) in chunk.samples.clone().enumerate() {
                        let group = (chunk.first_group + k / LANES) * self.shape.features + place;
                        let (a, b) = (
                            derivatives[group].0[k % LANES],
                            derivatives[group + 1].0[k % LANES],
                        );
                        let (rows, weights) = level.corners(self.samples.position(sample));
                        for corner in 0..8 {
                            let entry = &mut own[rows[corner] as usize - level.first_row];
                            entry[0] += weights[corner] * a;
                            entry[1] += weights[corner] * b;
                        }
                    }
                }
            });
        table_grad
    }
}

/// Encodes a chunk's samples to `[groups, features]`; lanes beyond the last sample are zero.
fn encode_chunk(
    grid: &GridShape,
    samples: &Samples,
    chunk: &Chunk,
    table: &[[f32; 2]],
    encoding: &mut [Group],
) {
    let features = grid.features();
    let tail = chunk.samples.len() % LANES;
    if tail > 0 {
        let last = encoding.len() - features;
        encoding[last..].fill(Group::ZERO);
    }
    for (index, level) in grid.levels().iter().enumerate() {
        let place = index * FEATURES_PER_LEVEL;
        for (k, sample) in chunk.samples.clone().enumerate() {
            let (rows, weights) = level.corners(samples.position(sample));
            let mut sum = [0.0; 2];
            for corner in 0..8 {
                let entry = table[rows[corner] as usize];
                sum[0] += weights[corner] * entry[0];
                sum[1] += weights[corner] * entry[1];
            }
            let group = k / LANES * features + place;
            encoding[group].0[k % LANES] = sum[0];
            encoding[group + 1].0[k % LANES] = sum[1];
        }
    }
}
