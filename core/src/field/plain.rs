//! The radiance field in plain candle ops, differentiated by candle: what the
//! fused kernels are held against.

use std::ops::Range;

use candle_core::{DType, Device, Result, Tensor, bail};
use rayon::prelude::*;

use super::encoding::{FEATURES_PER_LEVEL, GridShape};
use super::kernels::EXTRA;
use super::kernels::{
    DIRECTION_FEATURES, Evaluated, GEOMETRY_FEATURES, INITIAL_LOG_DENSITY, LOG_DENSITY_RANGE, NetworkShape,
    Parameters, RayPacking, VALUE_CHANNELS, Wanted,
};
use super::rays::Samples;

/// Samples evaluated at a time: the corners of the grid take about 1.5 KB each.
const PORTION: usize = 32 * 1024;
/// Corners of a grid cell.
const CORNERS: usize = 8;

/// Renders packed samples to `[rays, 7]` as [`super::kernels::render`] does; differentiable in the table and
/// the weights.
///
/// # Errors
/// `gaps` of another length than the samples; parameters of other shapes.
pub fn render(parameters: Parameters, samples: &Samples, gaps: &[f32]) -> Result<Tensor> {
    let count = samples.len();
    if gaps.len() != count {
        bail!("{} gaps for {count} samples", gaps.len());
    }
    if count == 0 {
        let width = VALUE_CHANNELS + EXTRA;
        return Tensor::zeros((samples.packing.rays(), width), DType::F32, &Device::Cpu);
    }
    let network = WeightMatrices::new(parameters.shape, parameters.weights)?;
    let encoding = encode(parameters.grid, parameters.table, samples, 0..count)?;
    let (density, features) = network.geometry(&encoding)?;
    let color = network.color(&features, &directions(samples, 0..count)?)?;
    let gaps = Tensor::from_slice(gaps, (count, 1), &Device::Cpu)?;
    composite(&samples.packing, &density, &Tensor::cat(&[color, gaps], 1)?)
}

/// Evaluates the field at samples as [`super::kernels::evaluate`] does, without gradients.
///
/// # Errors
/// Parameters of other shapes.
pub fn evaluate(
    parameters: Parameters,
    samples: &Samples,
    wanted: Wanted,
    into: &mut Evaluated,
) -> Result<()> {
    let table = parameters.table.detach();
    let network = WeightMatrices::new(parameters.shape, &parameters.weights.detach())?;
    let flat = |tensor: &Tensor| tensor.flatten_all()?.to_vec1::<f32>();
    *into = Evaluated::default();
    for start in (0..samples.len()).step_by(PORTION) {
        let range = start..(start + PORTION).min(samples.len());
        let encoding = encode(parameters.grid, &table, samples, range.clone())?;
        let (density, features) = network.geometry(&encoding)?;
        into.density.extend(flat(&density)?);
        if wanted.color {
            let directions = directions(samples, range)?;
            into.color.extend(flat(&network.color(&features, &directions)?)?);
        }
        if wanted.features {
            let coarse = encoding.narrow(1, 0, parameters.shape.features / 2)?;
            into.features.extend(flat(&Tensor::cat(&[coarse, features], 1)?)?);
        }
    }
    Ok(())
}

/// The ray of each sample.
fn ray_of_samples(packing: &RayPacking) -> Vec<u32> {
    let of_ray = |ray: usize| std::iter::repeat_n(ray as u32, packing.range(ray).len());
    (0..packing.rays()).flat_map(of_ray).collect()
}

/// Encodes the positions of some samples to `[n, levels * 2]` by trilinear interpolation of table rows.
pub(super) fn encode(
    grid: &GridShape,
    table: &Tensor,
    samples: &Samples,
    range: Range<usize>,
) -> Result<Tensor> {
    let levels = grid.levels().len();
    let cells = range.len() * levels;
    // Row and weight of every corner, [n, levels, 8]; each weight twice, once for each feature, since
    // candle multiplies tensors of one shape faster than it broadcasts.
    let mut rows = vec![0_u32; cells * CORNERS];
    let mut weights = vec![[0.0_f32; FEATURES_PER_LEVEL]; cells * CORNERS];
    rows.par_chunks_mut(levels * CORNERS)
        .zip(weights.par_chunks_mut(levels * CORNERS))
        .zip(range.into_par_iter())
        .with_min_len(1024)
        .for_each(|((rows, weights), sample)| {
            let position = samples.position(sample);
            let cells = rows
                .chunks_exact_mut(CORNERS)
                .zip(weights.chunks_exact_mut(CORNERS));
            for (level, (rows, weights)) in grid.levels().iter().zip(cells) {
                let (of_corners, shares) = level.corners(position);
                rows.copy_from_slice(&of_corners);
                for (weight, share) in weights.iter_mut().zip(shares) {
                    *weight = [share; FEATURES_PER_LEVEL];
                }
            }
        });
    let rows = Tensor::from_vec(rows, cells * CORNERS, &Device::Cpu)?;
    let shape = (cells * CORNERS, FEATURES_PER_LEVEL);
    let weights = Tensor::from_slice(bytemuck::cast_slice::<_, f32>(&weights), shape, &Device::Cpu)?;
    table
        .index_select(&rows, 0)?
        .mul(&weights)?
        .reshape((cells, CORNERS, FEATURES_PER_LEVEL))?
        .sum(1)?
        .reshape(((), levels * FEATURES_PER_LEVEL))
}

/// Direction features of some samples' rays, `[n, DIRECTION_FEATURES]`.
fn directions(samples: &Samples, range: Range<usize>) -> Result<Tensor> {
    let count = range.len();
    let rays = &ray_of_samples(&samples.packing)[range];
    let flat: Vec<f32> = rays
        .iter()
        .flat_map(|&ray| *samples.direction(ray as usize))
        .collect();
    Tensor::from_vec(flat, (count, DIRECTION_FEATURES), &Device::Cpu)
}

/// The weight matrices, `[inputs, outputs]` each.
struct WeightMatrices([Tensor; 4]);

impl WeightMatrices {
    fn new(shape: NetworkShape, weights: &Tensor) -> Result<Self> {
        let mut start = 0;
        let mut matrix = |(inputs, outputs): (usize, usize)| {
            let flat = weights.narrow(0, start, inputs * outputs)?;
            start += inputs * outputs;
            flat.reshape((inputs, outputs))
        };
        let [first, second, third, fourth] = shape.layers().map(&mut matrix);
        Ok(Self([first?, second?, third?, fourth?]))
    }

    /// Density `[n]` and geometry features `[n, 15]` of encodings.
    fn geometry(&self, encoding: &Tensor) -> Result<(Tensor, Tensor)> {
        let out = encoding.matmul(&self.0[0])?.relu()?.matmul(&self.0[1])?;
        let (low, high) = LOG_DENSITY_RANGE;
        let density = out
            .narrow(1, 0, 1)?
            .squeeze(1)?
            .affine(1.0, f64::from(INITIAL_LOG_DENSITY))?
            .clamp(low, high)?
            .exp()?;
        Ok((density, out.narrow(1, 1, GEOMETRY_FEATURES)?))
    }

    /// Colours `[n, 3]` from geometry and direction features.
    fn color(&self, features: &Tensor, directions: &Tensor) -> Result<Tensor> {
        let hidden = Tensor::cat(&[features, directions], 1)?
            .matmul(&self.0[2])?
            .relu()?;
        // The logistic function by tanh, which has a backward pass in candle.
        hidden
            .matmul(&self.0[3])?
            .affine(0.5, 0.0)?
            .tanh()?
            .affine(0.5, 0.5)
    }
}

/// Composites densities `[N]` (per metre) and values `[N, C]` to `[rays, C + 3]`: the C composited
/// values, then expected ray length, opacity and distortion, with
///
/// - w_i = T_i (1 - exp(-sigma_i dt_i)), T_i = exp(-sum_{j<i} sigma_j dt_j) (Semantic-NeRF, Eq. 1)
/// - value = sum_i w_i v_i; ray length = sum_i w_i t_i; opacity = sum_i w_i
/// - distortion = sum_ij w_i w_j |t_i - t_j| + sum_i w_i^2 dt_i / 3 (Barron et al. 2022, Eq. 15)
fn composite(packing: &RayPacking, density: &Tensor, values: &Tensor) -> Result<Tensor> {
    let slots = Slots::new(packing);
    let (rays, longest) = (packing.rays(), slots.longest);
    let t = Tensor::from_vec(slots.t, (rays, longest), &Device::Cpu)?;
    let dt = Tensor::from_vec(slots.dt, (rays, longest), &Device::Cpu)?;
    let sample = Tensor::from_vec(slots.sample, rays * longest, &Device::Cpu)?;
    let of_sample = Tensor::from_vec(slots.of_sample, packing.samples(), &Device::Cpu)?;

    // Right-multiplied by this, [rays, longest] becomes the sums over earlier samples.
    let earlier = Tensor::triu2(longest, DType::F32, &Device::Cpu)?.sub(&Tensor::eye(
        longest,
        DType::F32,
        &Device::Cpu,
    )?)?;
    let optical_depth = density
        .index_select(&sample, 0)?
        .reshape((rays, longest))?
        .mul(&dt)?;
    let transmittance = optical_depth.matmul(&earlier)?.neg()?.exp()?;
    let stopped = optical_depth.neg()?.exp()?.affine(-1.0, 1.0)?;
    let weights = transmittance.mul(&stopped)?;
    let moments = weights.mul(&t)?;
    // Each pair once, and the nearer sample first: w_i w_j (t_i - t_j), j < i.
    let pairs = t
        .mul(&weights.matmul(&earlier)?)?
        .sub(&moments.matmul(&earlier)?)?
        .mul(&weights)?;
    let own = weights.sqr()?.mul(&dt)?;
    let distortion = (pairs.affine(2.0, 0.0)? + own.affine(1.0 / 3.0, 0.0)?)?;

    let of_sample = weights.flatten_all()?.index_select(&of_sample, 0)?.unsqueeze(1)?;
    let values = values.broadcast_mul(&of_sample)?;
    let ray_of = Tensor::from_vec(ray_of_samples(packing), packing.samples(), &Device::Cpu)?;
    let sums = Tensor::zeros((rays, values.dim(1)?), DType::F32, &Device::Cpu)?;
    let values = sums.index_add(&ray_of, &values, 0)?;
    let [length, opacity, distortion] = [moments, weights, distortion].map(|sum| sum.sum_keepdim(1));
    Tensor::cat(&[values, length?, opacity?, distortion?], 1)
}

/// Rays of different numbers of samples as a matrix `[rays, longest]`, filled from the left.
struct Slots {
    longest: usize,
    /// The slot of each sample, row-major.
    of_sample: Vec<u32>,
    /// The sample in each slot. An empty slot has the first sample over no length, which stops no light.
    sample: Vec<u32>,
    /// Distance of each slot's sample along its ray, in metres.
    t: Vec<f32>,
    /// Length of each slot's interval, in metres.
    dt: Vec<f32>,
}

impl Slots {
    fn new(packing: &RayPacking) -> Self {
        let rays = packing.rays();
        let longest = (0..rays).map(|ray| packing.range(ray).len()).max().unwrap_or(0);
        let mut slots = Self {
            longest,
            of_sample: Vec::with_capacity(packing.samples()),
            sample: vec![0; rays * longest],
            t: vec![0.0; rays * longest],
            dt: vec![0.0; rays * longest],
        };
        for ray in 0..rays {
            for (k, sample) in packing.range(ray).enumerate() {
                let slot = ray * longest + k;
                slots.of_sample.push(slot as u32);
                slots.sample[slot] = sample as u32;
                slots.t[slot] = packing.t[sample];
                slots.dt[slot] = packing.dt[sample];
            }
        }
        slots
    }
}
