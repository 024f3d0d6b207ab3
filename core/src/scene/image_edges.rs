//! Edges of an image, and sums around its pixels that stop at them.

use crate::lanes::{Dispatch, F32x16, VectorUnit, dispatched, rounded_down};

/// Colour distance that counts as much as the whole of a scale, in half 8-bit steps.
const COLOR: f32 = 16.0;
/// The most that a step across an edge of colour counts, in such units: what lies behind many edges is known, too, if
/// nothing nearer is.
const EDGE: f32 = 4.0;
/// Passes along rows and columns.
const PASSES: i32 = 2;
/// For sums of the nearest, the colour distance that makes a step to the next pixel as long as the whole of a scale, in half
/// 8-bit steps.
const COLOR_OF_NEAREST: f32 = 34.0;

/// Colour distance of each pixel to the next in its row, and to the one below: the mean of the channels', in half 8-bit
/// steps, at most 255; row-major `[height, width]`.
pub(crate) struct ImageEdges {
    width: usize,
    across: Vec<u8>,
    down: Vec<u8>,
}

/// The weights of a pass along rows and columns, in memory that is used again.
#[derive(Default)]
pub(crate) struct PassWeights {
    across: Vec<f32>,
    down: Vec<f32>,
}

impl ImageEdges {
    /// Those of an image by the colours of its pixels, in 8-bit steps, row-major.
    pub(crate) fn new(colors: &[[f32; 3]], width: usize) -> Self {
        let step = |a: &[f32; 3], b: &[f32; 3]| {
            let apart: f32 = (0..3).map(|c| (a[c] - b[c]).abs()).sum();
            rounded_down((apart * (2.0 / 3.0)).min(255.0)).1 as u8
        };
        let mut across = Vec::with_capacity(colors.len());
        for row in colors.chunks_exact(width) {
            across.extend(row.iter().zip(&row[1..]).map(|(a, b)| step(a, b)));
            across.push(0);
        }
        let mut down = Vec::with_capacity(colors.len());
        down.extend(colors.iter().zip(&colors[width..]).map(|(a, b)| step(a, b)));
        down.resize(colors.len(), 0);
        Self { width, across, down }
    }

    /// Replaces each pixel's values by their sums over the pixels around, which count less the farther they are along
    /// rows and columns, in units of `scale` pixels, and much less across edges of colour (domain transform by recursive
    /// filters, Gastal and Oliveira 2011). Where there are no edges, the weights add up to about one over the factor
    /// that is returned.
    pub(crate) fn sum_around(&self, values: &mut [F32x16], scale: f32, weights: &mut PassWeights) -> f32 {
        let mut factor = 1.0;
        for pass in 0..PASSES {
            let rate = rate(scale, pass);
            factor *= (1.0 - (-rate).exp()).powi(4);
            weights.fill(self, |step| {
                (-rate - 2.0_f32.sqrt() * (step / COLOR).min(EDGE)).exp()
            });
            let PassWeights { across, down } = &*weights;
            smooth(Dispatch::detect(), values, across, down, self.width);
        }
        factor
    }

    /// The same with weights that fall exponentially from the pixel itself on, so that the nearest pixels decide; what lies
    /// behind an edge counts next to nothing.
    pub(crate) fn sum_nearest(&self, values: &mut [F32x16], scale: f32, weights: &mut PassWeights) {
        let mut before = Vec::with_capacity(values.len());
        for pass in 0..PASSES {
            let rate = rate(scale, pass);
            weights.fill(self, |step| {
                (-rate * (1.0 + scale * step / COLOR_OF_NEAREST)).exp()
            });
            let PassWeights { across, down } = &*weights;
            before.clear();
            before.extend_from_slice(values);
            let rows = values.chunks_exact_mut(self.width);
            let rows = rows
                .zip(before.chunks_exact(self.width))
                .zip(across.chunks_exact(self.width));
            for ((row, before), across) in rows {
                both_ways(Dispatch::detect(), row, before, across, 1);
            }
            before.copy_from_slice(values);
            both_ways(Dispatch::detect(), values, &before, down, self.width);
        }
    }

    /// Mean colour distance of the neighbours in rows and columns between which a border runs; `None` where there is none.
    pub(crate) fn mean_at(&self, is_border: impl Fn(usize, usize) -> bool) -> Option<f32> {
        let (mut sum, mut count) = (0_u64, 0_u64);
        for at in 0..self.across.len() {
            let right = (!(at + 1).is_multiple_of(self.width)).then_some((at + 1, self.across[at]));
            let below = (at + self.width < self.down.len()).then_some((at + self.width, self.down[at]));
            for (other, step) in right.into_iter().chain(below) {
                if is_border(at, other) {
                    sum += u64::from(step);
                    count += 1;
                }
            }
        }
        (count > 0).then(|| sum as f32 / count as f32)
    }
}

impl PassWeights {
    /// Computes each from the colour distance to the next pixel.
    fn fill(&mut self, edges: &ImageEdges, weight: impl Fn(f32) -> f32) {
        // A step has one of 256 values.
        let table: Vec<f32> = (0..=u8::MAX).map(|step| weight(step.into())).collect();
        let weights = |steps: &[u8], into: &mut Vec<f32>| {
            into.clear();
            into.extend(steps.iter().map(|&step| table[usize::from(step)]));
        };
        weights(&edges.across, &mut self.across);
        weights(&edges.down, &mut self.down);
    }
}

/// How fast weights fall in a pass, per pixel: those of all passes together spread by `scale` pixels.
fn rate(scale: f32, pass: i32) -> f32 {
    let sigma =
        scale * 3.0_f32.sqrt() * 2.0_f32.powi(PASSES - 1 - pass) / (4.0_f32.powi(PASSES) - 1.0).sqrt();
    2.0_f32.sqrt() / sigma
}

dispatched! {
    /// Sums along lines of values that lie `apart` from each other, both ways from each; `before` is a copy of them, and
    /// `weights` has that of a value for the next.
    fn both_ways = both_ways_on(values: &mut [F32x16], before: &[F32x16], weights: &[f32], apart: usize)
}

#[inline(always)]
fn both_ways_on<U: VectorUnit>(
    unit: U,
    values: &mut [F32x16],
    before: &[F32x16],
    weights: &[f32],
    apart: usize,
) {
    for k in apart..values.len() {
        let (done, rest) = values.split_at_mut(k);
        accumulate(unit, &done[k - apart], weights[k - apart], &mut rest[0]);
    }
    let mut after = vec![F32x16::ZERO; apart];
    for k in (0..values.len() - apart).rev() {
        let after = &mut after[k % apart];
        let mut sum = before[k + apart];
        accumulate(unit, after, weights[k + apart], &mut sum);
        *after = sum;
        accumulate(unit, after, weights[k], &mut values[k]);
    }
}

dispatched! {
    /// Sums along rows and columns, both ways; the weight of a pixel for the next is in `across` and `down`.
    fn smooth = smooth_on(values: &mut [F32x16], across: &[f32], down: &[f32], width: usize)
}

#[inline(always)]
fn smooth_on<U: VectorUnit>(unit: U, values: &mut [F32x16], across: &[f32], down: &[f32], width: usize) {
    for (row, across) in values.chunks_exact_mut(width).zip(across.chunks_exact(width)) {
        for k in 1..width {
            let (before, rest) = row.split_at_mut(k);
            accumulate(unit, &before[k - 1], across[k - 1], &mut rest[0]);
        }
        for k in (1..width).rev() {
            let (before, rest) = row.split_at_mut(k);
            accumulate(unit, &rest[0], across[k - 1], &mut before[k - 1]);
        }
    }
    for start in (width..values.len()).step_by(width) {
        let (above, rest) = values.split_at_mut(start);
        let (above, own) = (&above[start - width..], &mut rest[..width]);
        for k in 0..width {
            accumulate(unit, &above[k], down[start - width + k], &mut own[k]);
        }
    }
    for start in (width..values.len()).step_by(width).rev() {
        let (above, rest) = values.split_at_mut(start);
        let (above, own) = (&mut above[start - width..], &rest[..width]);
        for k in 0..width {
            accumulate(unit, &own[k], down[start - width + k], &mut above[k]);
        }
    }
}

#[inline(always)]
fn accumulate<U: VectorUnit>(unit: U, from: &F32x16, weight: f32, into: &mut F32x16) {
    let sum = unit.mul_add(unit.load(from), unit.splat_f32s(weight), unit.load(into));
    unit.store(sum, into);
}
