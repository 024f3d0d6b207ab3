//! Matching: how well a view's pixels fit other views at each of a number of inverse depths (Collins 1996).

use super::view::{View, Warp};
use crate::lanes::{Dispatch, VectorUnit, dispatched, rounded_down};

/// Half of the side of the window that is compared, in pixels, and its pixels.
const RADIUS: usize = 2;
const ROWS: usize = 2 * RADIUS + 1;
/// What a sum over the window is multiplied with to be a mean.
const SHARE: f32 = 1.0 / (ROWS * ROWS) as f32;
/// Added to the variances of windows, in squared 8-bit steps, so that noise is not compared.
const NOISE: f32 = 1.0;
/// Cost of a correlation of zero, and of one that nothing is known about.
const SCALE: f32 = 160.0;
/// Labels whose costs are written together.
const BLOCK: usize = 16;

/// Buffers that go from view to view.
#[derive(Default)]
pub struct Workspace {
    /// The three lowest costs of each pixel at a label.
    best: [Vec<f32>; 3],
    /// The costs of all pixels at a block of labels.
    block: [Vec<u8>; BLOCK],
    rows: Rows,
}

/// What is known of single rows.
#[derive(Default)]
struct Rows {
    index: Vec<u32>,
    right: Vec<f32>,
    below: Vec<f32>,
    quads: Vec<u64>,
    warped: Vec<f32>,
    /// Sums along the window's row, for the rows of a window.
    sums: [[Vec<f32>; 3]; ROWS],
    /// Whether the other view shows a pixel: 0, else infinity.
    outside: [Vec<f32>; ROWS],
}

impl Rows {
    fn resize(&mut self, width: usize) {
        let rows = [&mut self.right, &mut self.below];
        let sums = self.sums.iter_mut().flatten().chain(&mut self.outside);
        for row in rows.into_iter().chain(sums) {
            row.resize(width, 0.0);
        }
        self.index.resize(width, 0);
        self.quads.resize(width, 0);
        self.warped.resize(width + 2 * RADIUS, 0.0);
    }
}

/// The view that is matched: its luma with means and deviations of all windows.
struct Reference {
    width: usize,
    height: usize,
    /// Luma, each row with its border repeated, `[height, width + 2 RADIUS]`.
    padded: Vec<f32>,
    means: Vec<f32>,
    /// One by the standard deviation.
    scales: Vec<f32>,
}

impl Reference {
    fn new(view: &View) -> Self {
        let (width, height) = (view.camera.width as usize, view.camera.height as usize);
        let luma = view.luma();
        let mut padded = Vec::with_capacity((width + 2 * RADIUS) * height);
        for row in luma.chunks_exact(width) {
            padded.extend([row[0]; RADIUS]);
            padded.extend(row);
            padded.extend([row[width - 1]; RADIUS]);
        }
        let (mut means, mut scales) = (Vec::with_capacity(luma.len()), Vec::with_capacity(luma.len()));
        for row in 0..height {
            for column in 0..width {
                let (mut sum, mut squares) = (0.0, 0.0);
                for y in (row..row + ROWS).map(|y| y.saturating_sub(RADIUS).min(height - 1)) {
                    let start = y * (width + 2 * RADIUS) + column;
                    for value in &padded[start..start + ROWS] {
                        sum += value;
                        squares += value * value;
                    }
                }
                let mean: f32 = sum * SHARE;
                means.push(mean);
                scales.push(1.0 / ((squares * SHARE - mean * mean).max(0.0) + NOISE).sqrt());
            }
        }
        Self {
            width,
            height,
            padded,
            means,
            scales,
        }
    }
}

/// A view that it is compared with.
struct Source {
    warp: Warp,
    width: f32,
    height: f32,
    quads: Vec<u64>,
}

/// Writes the costs of all pixels at all labels, `[pixels, labels]`: 160 (1 - c), c the mean of the three highest
/// zero-mean normalised cross-correlations of 5 x 5 pixels with the sources. Labels are planes that face the camera,
/// `step` per metre apart in inverse z-depth, from 0 on; their number is a multiple of 16.
pub fn costs(
    view: &View,
    sources: &[&View],
    step: f32,
    labels: usize,
    workspace: &mut Workspace,
    into: &mut Vec<u8>,
) {
    let reference = Reference::new(view);
    let pixels = reference.means.len();
    let sources: Vec<Source> = sources
        .iter()
        .map(|source| Source {
            warp: Warp::new(view, source),
            width: source.camera.width as f32,
            height: source.camera.height as f32,
            quads: source.quads(),
        })
        .collect();
    into.resize(pixels * labels, 0);
    let Workspace { best, block, rows } = workspace;
    rows.resize(reference.width);
    for plane in block.iter_mut() {
        plane.resize(pixels, 0);
    }
    let dispatch = Dispatch::detect();
    for first in (0..labels).step_by(BLOCK) {
        for (place, plane) in block.iter_mut().enumerate() {
            let label = first + place;
            for best in best.iter_mut() {
                best.clear();
                best.resize(pixels, f32::INFINITY);
            }
            for source in &sources {
                compare(&reference, source, label as f32 * step, rows, best, dispatch);
            }
            finish(dispatch, best, plane);
        }
        for (pixel, into) in into.chunks_exact_mut(labels).enumerate() {
            for (into, plane) in into[first..first + BLOCK].iter_mut().zip(block.iter()) {
                *into = plane[pixel];
            }
        }
    }
}

/// Puts the costs of one source at one label among the lowest.
fn compare(
    reference: &Reference,
    source: &Source,
    inverse: f32,
    rows: &mut Rows,
    best: &mut [Vec<f32>; 3],
    dispatch: Dispatch,
) {
    let &Reference { width, height, .. } = reference;
    for row in 0..height + RADIUS {
        if row < height {
            locate(dispatch, source, inverse, row, rows);
            for (quad, &index) in rows.quads.iter_mut().zip(&rows.index) {
                *quad = source.quads[index as usize];
            }
            let stride = width + 2 * RADIUS;
            sum_row(
                dispatch,
                &reference.padded[row * stride..(row + 1) * stride],
                row % ROWS,
                rows,
            );
        }
        if let Some(middle) = row.checked_sub(RADIUS) {
            let window: [usize; ROWS] =
                std::array::from_fn(|k| (middle + k).saturating_sub(RADIUS).min(height - 1) % ROWS);
            let own = middle * width..(middle + 1) * width;
            let [a, b, c] = best;
            let into = [&mut a[own.clone()], &mut b[own.clone()], &mut c[own.clone()]];
            let known = [&reference.means[own.clone()], &reference.scales[own]];
            correlate(dispatch, known, rows, &window, into);
        }
    }
}

/// The smaller of two numbers; `b` where one is none. It is one instruction, which `f32::min` is not.
#[inline(always)]
fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The larger of two numbers; `b` where one is none.
#[inline(always)]
fn most(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

dispatched! {
    /// Finds where a row's pixels lie in the source at an inverse z-depth.
    fn locate = locate_on(source: &Source, inverse: f32, row: usize, rows: &mut Rows)
}

#[inline(always)]
fn locate_on<U: VectorUnit>(_: U, source: &Source, inverse: f32, row: usize, rows: &mut Rows) {
    let count = rows.index.len();
    let index = &mut rows.index[..];
    let (right, below) = (&mut rows.right[..count], &mut rows.below[..count]);
    let outside = &mut rows.outside[row % ROWS][..count];
    let Warp { turn, shift } = source.warp;
    let start = turn.y_axis * (row as f32 + 0.5) + turn.z_axis + turn.x_axis * 0.5;
    let (last_x, last_y) = (source.width - 1.0, source.height - 1.0);
    let width = source.width as u32;
    for k in 0..count {
        let u = k as f32;
        let z = start.z + u * turn.x_axis.z + inverse * shift.z;
        let scale = 1.0 / z;
        let x = (start.x + u * turn.x_axis.x + inverse * shift.x) * scale - 0.5;
        let y = (start.y + u * turn.x_axis.y + inverse * shift.y) * scale - 0.5;
        let is_inside = (z > 1e-6) & (x >= -0.5) & (y >= -0.5) & (x <= last_x + 0.5) & (y <= last_y + 0.5);
        outside[k] = if is_inside { 0.0 } else { f32::INFINITY };
        // Not a number becomes zero.
        let (x, y) = (least(most(x, 0.0), last_x), least(most(y, 0.0), last_y));
        let [(left, column), (top, line)] = [x, y].map(rounded_down);
        index[k] = line * width + column;
        right[k] = x - left;
        below[k] = y - top;
    }
}

dispatched! {
    /// Interpolates a row of the source, and sums it, its squares and its products with the reference along the rows of
    /// windows.
    fn sum_row = sum_row_on(reference: &[f32], slot: usize, rows: &mut Rows)
}

#[inline(always)]
fn sum_row_on<U: VectorUnit>(_: U, reference: &[f32], slot: usize, rows: &mut Rows) {
    let count = rows.quads.len();
    let (scale, offset) = View::LUMA;
    {
        let quads = &rows.quads[..count];
        let (right, below) = (&rows.right[..count], &rows.below[..count]);
        let warped = &mut rows.warped[RADIUS..RADIUS + count];
        for k in 0..count {
            let (low, high) = (quads[k] as u32, (quads[k] >> 32) as u32);
            let value = |word: u32| (word & 0xFFFF) as i32 as f32;
            let top = value(low) + right[k] * (value(low >> 16) - value(low));
            let bottom = value(high) + right[k] * (value(high >> 16) - value(high));
            warped[k] = (top + below[k] * (bottom - top)) * scale + offset;
        }
    }
    let warped = &mut rows.warped[..count + 2 * RADIUS];
    for k in 0..RADIUS {
        warped[k] = warped[RADIUS];
        warped[count + RADIUS + k] = warped[count + RADIUS - 1];
    }
    let [sums, squares, products] = &mut rows.sums[slot];
    let (sums, squares, products) = (&mut sums[..count], &mut squares[..count], &mut products[..count]);
    let warped: [&[f32]; ROWS] = std::array::from_fn(|k| &warped[k..k + count]);
    let reference: [&[f32]; ROWS] = std::array::from_fn(|k| &reference[k..k + count]);
    for k in 0..count {
        let (mut sum, mut square, mut product) = (0.0, 0.0, 0.0);
        for j in 0..ROWS {
            let value = warped[j][k];
            sum += value;
            square += value * value;
            product += value * reference[j][k];
        }
        sums[k] = sum;
        squares[k] = square;
        products[k] = product;
    }
}

dispatched! {
    /// Puts a row's costs among the lowest three; `known` are the reference's means and scales.
    fn correlate = correlate_on(
        known: [&[f32]; 2],
        rows: &Rows,
        window: &[usize; ROWS],
        best: [&mut [f32]; 3],
    )
}

#[inline(always)]
fn correlate_on<U: VectorUnit>(
    _: U,
    [means, scales]: [&[f32]; 2],
    rows: &Rows,
    window: &[usize; ROWS],
    [first, second, third]: [&mut [f32]; 3],
) {
    let count = means.len();
    let sums: [[&[f32]; 3]; ROWS] =
        std::array::from_fn(|k| std::array::from_fn(|what| &rows.sums[window[k]][what][..count]));
    let outside = &rows.outside[window[RADIUS]][..count];
    let (scales, first) = (&scales[..count], &mut first[..count]);
    let (second, third) = (&mut second[..count], &mut third[..count]);
    for k in 0..count {
        let (mut sum, mut square, mut product) = (0.0, 0.0, 0.0);
        for row in sums {
            sum += row[0][k];
            square += row[1][k];
            product += row[2][k];
        }
        let mean = sum * SHARE;
        let variance = most(square * SHARE - mean * mean, 0.0) + NOISE;
        let correlation = (product * SHARE - mean * means[k]) * scales[k] / variance.sqrt();
        let cost = 1.0 - correlation + outside[k];
        third[k] = least(third[k], most(second[k], cost));
        second[k] = least(second[k], most(first[k], cost));
        first[k] = least(first[k], cost);
    }
}

dispatched! {
    /// The mean of the lowest costs that there are, as a byte.
    fn finish = finish_on(best: &[Vec<f32>; 3], into: &mut [u8])
}

#[inline(always)]
fn finish_on<U: VectorUnit>(_: U, [first, second, third]: &[Vec<f32>; 3], into: &mut [u8]) {
    let count = into.len();
    let (first, second, third) = (&first[..count], &second[..count], &third[..count]);
    for k in 0..count {
        // Where fewer views show a pixel, the others would tell nothing.
        let second = if second[k] < 4.0 { second[k] } else { first[k] };
        let third = if third[k] < 4.0 { third[k] } else { second };
        let mean = (first[k] + second + third) * (SCALE / 3.0);
        let mean = if mean < 1e4 { mean } else { SCALE };
        into[k] = rounded_down(mean.clamp(0.0, 255.0)).1 as u8;
    }
}
