//! The field's two small networks on groups of sixteen samples, forward and backward.
//!
//! geometry: `features -> hidden (ReLU) -> log density, 15 geometry features`;
//! colour: `geometry features, direction -> hidden (ReLU) -> red, green, blue (logistic)`.

use super::split_off;
use crate::lanes::{F32x16, LANES, VectorUnit, dispatched};

/// Geometry features beside the density.
pub const GEOMETRY_FEATURES: usize = 15;
/// Spherical harmonics up to degree 3 of the viewing direction.
pub const DIRECTION_FEATURES: usize = 16;
/// Added to the network's output before the exponential: the field starts thin, at e^-2 per metre.
pub const INITIAL_LOG_DENSITY: f32 = -2.0;
/// Log densities are kept in this range.
pub const LOG_DENSITY_RANGE: (f32, f32) = (-15.0, 10.0);

const OUT: usize = 1 + GEOMETRY_FEATURES;
const COLOR_IN: usize = GEOMETRY_FEATURES + DIRECTION_FEATURES;

/// Widths of the networks, and where each weight matrix lies in the one tensor that holds them all.
/// Matrices are row-major `[inputs, outputs]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NetworkShape {
    /// Width of the encoding.
    pub features: usize,
    /// Hidden units of each network.
    pub hidden: usize,
}

impl NetworkShape {
    /// (inputs, outputs) of the four matrices, in their order.
    pub fn layers(&self) -> [(usize, usize); 4] {
        [
            (self.features, self.hidden),
            (self.hidden, OUT),
            (COLOR_IN, self.hidden),
            (self.hidden, 3),
        ]
    }

    /// Number of weights.
    pub fn weights(&self) -> usize {
        self.layers()
            .iter()
            .map(|(inputs, outputs)| inputs * outputs)
            .sum()
    }

    /// The four matrices in one slice of all weights.
    pub fn split<'a>(&self, mut weights: &'a [f32]) -> [&'a [f32]; 4] {
        self.layers().map(|(inputs, outputs)| {
            let (own, rest) = weights.split_at(inputs * outputs);
            weights = rest;
            own
        })
    }

    /// All matrices transposed, for the backward pass.
    pub fn transposed(&self, weights: &[f32]) -> Vec<f32> {
        let mut out = Vec::with_capacity(weights.len());
        for ((inputs, outputs), matrix) in self.layers().into_iter().zip(self.split(weights)) {
            for output in 0..outputs {
                out.extend((0..inputs).map(|input| matrix[input * outputs + output]));
            }
        }
        out
    }
}

/// Activations of some groups of samples, each `[groups, width]`.
#[derive(Clone, Debug, Default)]
pub struct Activations {
    /// Hidden units of the geometry network.
    pub hidden: Vec<F32x16>,
    /// Log density and geometry features.
    pub out: Vec<F32x16>,
    /// Density per metre, `[groups]`.
    pub density: Vec<F32x16>,
    /// Geometry and direction features.
    pub color_in: Vec<F32x16>,
    /// Hidden units of the colour network.
    pub color_hidden: Vec<F32x16>,
    /// Colour, `[groups, 3]`.
    pub color: Vec<F32x16>,
}

impl Activations {
    /// Makes room for so many groups.
    pub fn resize(&mut self, shape: &NetworkShape, groups: usize) {
        self.hidden.resize(groups * shape.hidden, F32x16::ZERO);
        self.out.resize(groups * OUT, F32x16::ZERO);
        self.density.resize(groups, F32x16::ZERO);
        self.color_in.resize(groups * COLOR_IN, F32x16::ZERO);
        self.color_hidden.resize(groups * shape.hidden, F32x16::ZERO);
        self.color.resize(groups * 3, F32x16::ZERO);
    }

    /// Where the direction features of a group's samples go, `[16]`.
    pub fn directions(&mut self, group: usize) -> &mut [F32x16] {
        let start = group * COLOR_IN + GEOMETRY_FEATURES;
        &mut self.color_in[start..start + DIRECTION_FEATURES]
    }

    /// Density and geometry features of a group, `[16]`.
    pub fn out(&self, group: usize) -> &[F32x16] {
        &self.out[group * OUT..(group + 1) * OUT]
    }
}

/// Scratch space of [`backward`], and the gradient of the weights that it adds to.
#[derive(Clone, Debug, Default)]
pub struct Gradients {
    color_out: Vec<F32x16>,
    color_hidden: Vec<F32x16>,
    out: Vec<F32x16>,
    hidden: Vec<F32x16>,
    /// Sum over all samples so far, as [`NetworkShape::split`] has it.
    pub weights: Vec<f32>,
}

dispatched! {
    /// Computes activations from encodings `[groups, features]`; direction features must be in place
    /// when colours are wanted.
    pub fn forward = forward_on(
        shape: &NetworkShape,
        weights: &[f32],
        encoding: &[F32x16],
        with_color: bool,
        activations: &mut Activations,
    )
}

dispatched! {
    /// Back-propagates the derivatives by density `[groups]` and colour `[groups, 3]`: adds to the
    /// weights' gradient and replaces the encodings by their derivatives.
    pub fn backward = backward_on(
        shape: &NetworkShape,
        transposed: &[f32],
        encoding: &mut [F32x16],
        activations: &Activations,
        by_density: &[F32x16],
        by_color: &[F32x16],
        gradients: &mut Gradients,
    )
}

#[inline(always)]
fn forward_on<U: VectorUnit>(
    unit: U,
    shape: &NetworkShape,
    weights: &[f32],
    encoding: &[F32x16],
    with_color: bool,
    activations: &mut Activations,
) {
    let [first, second, third, fourth] = shape.split(weights);
    for (group, encoding) in encoding.chunks_exact(shape.features).enumerate() {
        let hidden = &mut activations.hidden[group * shape.hidden..(group + 1) * shape.hidden];
        linear(unit, first, encoding, hidden, true);
        let out = &mut activations.out[group * OUT..(group + 1) * OUT];
        linear(unit, second, hidden, out, false);
        let density = &mut activations.density[group].0;
        for lane in 0..LANES {
            let log = out[0].0[lane] + INITIAL_LOG_DENSITY;
            density[lane] = exp(log.clamp(LOG_DENSITY_RANGE.0, LOG_DENSITY_RANGE.1));
        }
        if with_color {
            let color_in = &mut activations.color_in[group * COLOR_IN..(group + 1) * COLOR_IN];
            color_in[..GEOMETRY_FEATURES].copy_from_slice(&out[1..]);
            let start = group * shape.hidden;
            let color_hidden = &mut activations.color_hidden[start..start + shape.hidden];
            linear(unit, third, color_in, color_hidden, true);
            let color = &mut activations.color[group * 3..(group + 1) * 3];
            linear(unit, fourth, color_hidden, color, false);
            for channel in color {
                for value in &mut channel.0 {
                    *value = 1.0 / (1.0 + exp((-*value).clamp(-80.0, 80.0)));
                }
            }
        }
    }
}

#[inline(always)]
fn backward_on<U: VectorUnit>(
    unit: U,
    shape: &NetworkShape,
    transposed: &[f32],
    encoding: &mut [F32x16],
    activations: &Activations,
    by_density: &[F32x16],
    by_color: &[F32x16],
    gradients: &mut Gradients,
) {
    let groups = by_density.len();
    let [first, second, third, fourth] = shape.split(transposed);
    gradients.color_out.resize(groups * 3, F32x16::ZERO);
    gradients.color_hidden.resize(groups * shape.hidden, F32x16::ZERO);
    gradients.out.resize(groups * OUT, F32x16::ZERO);
    gradients.hidden.resize(groups * shape.hidden, F32x16::ZERO);
    gradients.weights.resize(shape.weights(), 0.0);
    for group in 0..groups {
        let color_out = &mut gradients.color_out[group * 3..(group + 1) * 3];
        for channel in 0..3 {
            let color = unit.load(&activations.color[group * 3 + channel]);
            let slope = unit.mul_f32s(color, unit.sub_f32s(unit.splat_f32s(1.0), color));
            let by_color = unit.load(&by_color[group * 3 + channel]);
            unit.store(unit.mul_f32s(slope, by_color), &mut color_out[channel]);
        }
        let range = group * shape.hidden..(group + 1) * shape.hidden;
        let color_hidden = &mut gradients.color_hidden[range.clone()];
        linear(unit, fourth, color_out, color_hidden, false);
        gate(unit, color_hidden, &activations.color_hidden[range]);
        let out = &mut gradients.out[group * OUT..(group + 1) * OUT];
        linear(unit, third, color_hidden, &mut out[1..], false);
        let log = &activations.out[group * OUT].0;
        for lane in 0..LANES {
            let shifted = log[lane] + INITIAL_LOG_DENSITY;
            let inside = shifted > LOG_DENSITY_RANGE.0 && shifted < LOG_DENSITY_RANGE.1;
            let slope = activations.density[group].0[lane];
            out[0].0[lane] = if inside {
                by_density[group].0[lane] * slope
            } else {
                0.0
            };
        }
        let range = group * shape.hidden..(group + 1) * shape.hidden;
        let hidden = &mut gradients.hidden[range.clone()];
        linear(unit, second, out, hidden, false);
        gate(unit, hidden, &activations.hidden[range]);
    }
    let mut rest: &mut [f32] = &mut gradients.weights;
    let pairs: [(&[F32x16], &[F32x16]); 4] = [
        (encoding, &gradients.hidden),
        (&activations.hidden, &gradients.out),
        (&activations.color_in, &gradients.color_hidden),
        (&activations.color_hidden, &gradients.color_out),
    ];
    for ((inputs, outputs), (x, g)) in shape.layers().into_iter().zip(pairs) {
        let own = split_off(&mut rest, inputs * outputs);
        outer(unit, x, inputs, g, outputs, groups, own);
    }
    for (encoding, hidden) in encoding
        .chunks_exact_mut(shape.features)
        .zip(gradients.hidden.chunks_exact(shape.hidden))
    {
        linear(unit, first, hidden, encoding, false);
    }
}

/// y = xW for one group, or the first columns of it, `W` row-major `[inputs, outputs]`; negative results become zero with
/// `relu`.
#[inline(always)]
fn linear<U: VectorUnit>(unit: U, weights: &[f32], x: &[F32x16], y: &mut [F32x16], relu: bool) {
    let outputs = y.len();
    let mut output = 0;
    while output < outputs {
        let left = outputs - output;
        output += if U::BLOCK >= 8 && left >= 8 {
            block::<U, 8>(unit, weights, output, x, y, relu)
        } else if U::BLOCK >= 4 && left >= 4 {
            block::<U, 4>(unit, weights, output, x, y, relu)
        } else if left >= 2 {
            block::<U, 2>(unit, weights, output, x, y, relu)
        } else {
            block::<U, 1>(unit, weights, output, x, y, relu)
        };
    }
}

#[inline(always)]
fn block<U: VectorUnit, const B: usize>(
    unit: U,
    weights: &[f32],
    output: usize,
    x: &[F32x16],
    y: &mut [F32x16],
    relu: bool,
) -> usize {
    let mut sums = [unit.splat_f32s(0.0); B];
    for (x, row) in x.iter().zip(weights.chunks_exact(weights.len() / x.len())) {
        let x = unit.load(x);
        let row = &row[output..output + B];
        for b in 0..B {
            sums[b] = unit.mul_add(unit.splat_f32s(row[b]), x, sums[b]);
        }
    }
    for b in 0..B {
        let sum = if relu {
            unit.max_f32s(sums[b], unit.splat_f32s(0.0))
        } else {
            sums[b]
        };
        unit.store(sum, &mut y[output + b]);
    }
    B
}

/// Zeroes the derivatives of units that were not active.
#[inline(always)]
fn gate<U: VectorUnit>(unit: U, derivatives: &mut [F32x16], activations: &[F32x16]) {
    for (derivative, activation) in derivatives.iter_mut().zip(activations) {
        let zero = unit.splat_f32s(0.0);
        let active = unit.greater_than_f32s(unit.load(activation), zero);
        unit.store(unit.select_f32s(active, unit.load(derivative), zero), derivative);
    }
}

/// Adds the sum over groups and lanes of x g^T to `into`, row-major `[inputs, outputs]`.
#[inline(always)]
fn outer<U: VectorUnit>(
    unit: U,
    x: &[F32x16],
    inputs: usize,
    g: &[F32x16],
    outputs: usize,
    groups: usize,
    into: &mut [f32],
) {
    let tile = |a: usize, limit: usize, size: usize| (limit - a).min(size);
    let side = (U::BLOCK / 2).max(1);
    let mut input = 0;
    while input < inputs {
        let rows = tile(input, inputs, side);
        let mut output = 0;
        while output < outputs {
            let columns = tile(output, outputs, side);
            let place = (input, output);
            match (side, rows == side && columns == side) {
                (4, true) => outer_tile::<U, 4>(unit, x, inputs, g, outputs, groups, place, into),
                (2, true) => outer_tile::<U, 2>(unit, x, inputs, g, outputs, groups, place, into),
                _ => {
                    for row in 0..rows {
                        for column in 0..columns {
                            let place = (input + row, output + column);
                            outer_tile::<U, 1>(unit, x, inputs, g, outputs, groups, place, into);
                        }
                    }
                }
            }
            output += columns;
        }
        input += rows;
    }
}

#[inline(always)]
fn outer_tile<U: VectorUnit, const T: usize>(
    unit: U,
    x: &[F32x16],
    inputs: usize,
    g: &[F32x16],
    outputs: usize,
    groups: usize,
    (input, output): (usize, usize),
    into: &mut [f32],
) {
    let mut sums = [[unit.splat_f32s(0.0); T]; T];
    for group in 0..groups {
        let x = &x[group * inputs + input..][..T];
        let g = &g[group * outputs + output..][..T];
        let mut columns = [unit.splat_f32s(0.0); T];
        for column in 0..T {
            columns[column] = unit.load(&g[column]);
        }
        for row in 0..T {
            let own = unit.load(&x[row]);
            for column in 0..T {
                sums[row][column] = unit.mul_add(own, columns[column], sums[row][column]);
            }
        }
    }
    for row in 0..T {
        for column in 0..T {
            into[(input + row) * outputs + output + column] += unit.reduce_sum_f32s(sums[row][column]);
        }
    }
}

/// e^x for |x| < 87, to about one unit in the last place; written so that loops over it become vectors.
#[inline(always)]
pub fn exp(x: f32) -> f32 {
    // Adding this rounds to an integer that then lies in the lowest bits.
    const ROUND: f32 = 12_582_912.0;
    let scaled = x * std::f32::consts::LOG2_E + ROUND;
    let power = scaled - ROUND;
    let r = x - power * 0.693_359_4 - power * -2.121_944_4e-4;
    let mut p = 1.987_569_1e-4;
    p = p * r + 1.398_2e-3;
    p = p * r + 8.333_452e-3;
    p = p * r + 4.166_579_6e-2;
    p = p * r + 0.166_666_66;
    p = p * r + 0.5;
    let value = p * r * r + r + 1.0;
    let exponent = scaled.to_bits().wrapping_sub(ROUND.to_bits()) << 23;
    f32::from_bits(value.to_bits().wrapping_add(exponent))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exp_is_as_good_as_the_libraries() {
        for k in -8000..8000 {
            let x = k as f32 * 0.01;
            let expected = f64::from(x).exp();
            assert!((f64::from(exp(x)) - expected).abs() < 3e-7 * expected, "{x}");
        }
    }
}
