//! Depth between the pixels that are sure: planes in inverse depth, which stop at edges of the image.

use super::view::View;
use crate::lanes::{Dispatch, F32x16, LANES, VectorUnit, dispatched};
use crate::scene::PassWeights;

/// How far pixels speak for others, in pixels, and how much such a distance counts: what is near rules where there is any.
const SCALES: [(f32, f32); 4] = [(3.0, 1.0), (10.0, 0.05), (35.0, 2e-3), (140.0, 1e-5)];
/// Share of the depth beyond which a seed contradicts its surroundings.
const OUTLIER: f32 = 0.03;
/// Squared pixels by which the spread of seeds must exceed none before a slope is believed.
const RIDGE: f32 = 1.0;

/// A pixel whose inverse depth is known, and how sure it is; a weight of 0 says nothing.
#[derive(Clone, Copy, Default)]
pub struct Seed {
    pub weight: f32,
    pub inverse: f32,
}

impl Seed {
    /// Whether it was matched in the view itself, in several views alike.
    pub fn is_confident(&self) -> bool {
        self.weight >= 1.0
    }
}

/// Buffers that go from view to view.
#[derive(Default)]
pub struct Workspace {
    moments: Vec<F32x16>,
    total: Vec<F32x16>,
    weights: PassWeights,
}

/// The inverse depth of every pixel by the planes of the seeds around it, at least `farthest`; 0 where there are none.
pub fn fill(view: &View, seeds: &[Seed], farthest: f32, workspace: &mut Workspace) -> Vec<f32> {
    let first = planes(view, seeds, workspace);
    let robust: Vec<Seed> = seeds
        .iter()
        .zip(&first)
        .map(|(seed, &plane)| {
            let off = (seed.inverse - plane) / (OUTLIER * seed.inverse.max(1e-6));
            Seed {
                weight: seed.weight / (1.0 + off * off),
                ..*seed
            }
        })
        .collect();
    let mut filled = planes(view, &robust, workspace);
    for inverse in &mut filled {
        if *inverse > 0.0 {
            *inverse = inverse.max(farthest);
        }
    }
    filled
}

fn planes(view: &View, seeds: &[Seed], workspace: &mut Workspace) -> Vec<f32> {
    let width = view.camera.width as usize;
    let Workspace {
        moments,
        total,
        weights,
    } = workspace;
    total.clear();
    total.resize(seeds.len(), F32x16::ZERO);
    let dispatch = Dispatch::detect();
    for (scale, share) in SCALES {
        moments.clear();
        moments.extend(
            seeds
                .iter()
                .enumerate()
                .map(|(index, seed)| moments_of(index, width, *seed)),
        );
        let gain = share * view.edges.sum_around(moments, scale, weights);
        add(dispatch, moments, gain, total);
    }
    let solved = total.iter().enumerate();
    solved
        .map(|(index, moments)| solve(&moments.0, index, width))
        .collect()
}

/// Position of a pixel from the middle of the image's width.
fn position(index: usize, width: usize) -> [f32; 2] {
    let middle = 0.5 * width as f32;
    [(index % width) as f32 - middle, (index / width) as f32 - middle]
}

fn moments_of(index: usize, width: usize, seed: Seed) -> F32x16 {
    if seed.weight <= 0.0 {
        return F32x16::ZERO;
    }
    let [x, y] = position(index, width);
    let d = seed.inverse;
    let mut moments = [0.0; LANES];
    for (moment, value) in moments
        .iter_mut()
        .zip([1.0, x, y, x * x, x * y, y * y, d, x * d, y * d])
    {
        *moment = seed.weight * value;
    }
    F32x16(moments)
}

/// The plane of least squares at a pixel.
fn solve(moments: &[f32; LANES], index: usize, width: usize) -> f32 {
    let [w, x, y, xx, xy, yy, d, xd, yd, ..] = *moments;
    if w <= f32::MIN_POSITIVE {
        return 0.0;
    }
    let [x, y, xx, xy, yy, d, xd, yd] = [x, y, xx, xy, yy, d, xd, yd].map(|moment| moment / w);
    let (xx, yy, xy) = (xx - x * x + RIDGE, yy - y * y + RIDGE, xy - x * y);
    let (xd, yd) = (xd - x * d, yd - y * d);
    let determinant = (xx * yy - xy * xy).max(1e-6);
    let slope = [
        (xd * yy - yd * xy) / determinant,
        (yd * xx - xd * xy) / determinant,
    ];
    let [own_x, own_y] = position(index, width);
    let plane = d + slope[0] * (own_x - x) + slope[1] * (own_y - y);
    plane.clamp(0.5 * d, 2.0 * d)
}

dispatched! {
    /// Adds a multiple.
    fn add = add_on(moments: &[F32x16], factor: f32, into: &mut [F32x16])
}

#[inline(always)]
fn add_on<U: VectorUnit>(unit: U, moments: &[F32x16], factor: f32, into: &mut [F32x16]) {
    for (moments, into) in moments.iter().zip(into) {
        let sum = unit.mul_add(unit.load(moments), unit.splat_f32s(factor), unit.load(into));
        unit.store(sum, into);
    }
}
