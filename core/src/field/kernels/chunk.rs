//! Rays in chunks whose activations stay in the second-level cache, and each thread's memory for one.

use std::cell::RefCell;
use std::ops::Range;

use super::grid::interpolate;
use super::network::{Activations, Gradients, NetworkShape, forward};
use super::split_off;
use crate::field::encoding::{FEATURES_PER_LEVEL, GridShape};
use crate::field::rays::Samples;
use crate::lanes::{Dispatch, F32x16, LANES};

/// Samples of a chunk, unless a single ray has more.
const CHUNK_SAMPLES: usize = 384;

/// Rays that are worked on together.
#[derive(Clone, Debug)]
pub struct Chunk {
    /// The rays.
    pub rays: Range<usize>,
    /// Their samples.
    pub samples: Range<usize>,
}

impl Chunk {
    /// Groups of sixteen that the samples fill, the last one perhaps in part.
    pub fn groups(&self) -> usize {
        self.samples.len().div_ceil(LANES)
    }
}

/// How the rays are divided.
#[derive(Clone, Debug)]
pub struct Plan {
    /// All rays, in order.
    pub chunks: Vec<Chunk>,
    /// Groups of all chunks.
    pub groups: usize,
}

impl Plan {
    /// Divides the rays of `samples`.
    pub fn new(samples: &Samples) -> Self {
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
            };
            groups += chunk.groups();
            chunks.push(chunk);
            first = end;
        }
        Self { chunks, groups }
    }

    /// Slices of `values`, which hold `width` groups for each group of samples, one for each chunk.
    pub fn split<'a>(
        &'a self,
        mut values: &'a mut [F32x16],
        width: usize,
    ) -> Vec<(&'a Chunk, &'a mut [F32x16])> {
        let own = |chunk: &'a Chunk| (chunk, split_off(&mut values, chunk.groups() * width));
        self.chunks.iter().map(own).collect()
    }
}

/// Buffers of one thread, for one chunk at a time; values that compositing reads are one after another,
/// those that the networks read in groups.
#[derive(Default)]
pub struct Workspace {
    pub positions: Vec<F32x16>,
    pub encoding: Vec<F32x16>,
    pub activations: Activations,
    pub gradients: Gradients,
    pub density: Vec<f32>,
    pub value: Vec<f32>,
    pub of_density: Vec<f32>,
    pub of_value: Vec<f32>,
    pub by_density: Vec<F32x16>,
    pub by_color: Vec<F32x16>,
}

thread_local! {
    static WORKSPACE: RefCell<Workspace> = RefCell::default();
}

/// Runs `f` with this thread's workspace; `f` must not wait for other tasks, which may want it too.
pub fn with_workspace<T>(f: impl FnOnce(&mut Workspace) -> T) -> T {
    WORKSPACE.with_borrow_mut(f)
}

impl Workspace {
    /// Computes the activations of a chunk.
    pub fn activate(
        &mut self,
        shape: &NetworkShape,
        samples: &Samples,
        chunk: &Chunk,
        weights: &[f32],
        encoding: &[F32x16],
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
    pub fn gather(&mut self, chunk: &Chunk, gaps: &[f32]) {
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

/// Encodes positions `[groups, 3]` to `[groups, features]`.
pub fn encode_groups(
    grid: &GridShape,
    table: &[[f32; 2]],
    positions: &[F32x16],
    encoding: &mut [F32x16],
    dispatch: Dispatch,
) {
    for (index, level) in grid.levels().iter().enumerate() {
        let own = &table[level.first_row..level.first_row + level.rows];
        let place = index * FEATURES_PER_LEVEL;
        interpolate(dispatch, level, own, positions, encoding, grid.features(), place);
    }
}

/// Unit positions of a chunk's samples, `[groups, 3]`; lanes beyond the last sample are zero.
pub fn gather_positions(samples: &Samples, chunk: &Chunk, positions: &mut [F32x16]) {
    let Range { start, end } = chunk.samples;
    gather_rows(&samples.positions()[3 * start..3 * end], 3, positions);
}

/// Rows of so many values, one after another, in groups `[groups, width]`; lanes beyond the last row are zero.
#[inline]
pub fn gather_rows(rows: &[f32], width: usize, groups: &mut [F32x16]) {
    let tail = groups.len().saturating_sub(width);
    groups[tail..].fill(F32x16::ZERO);
    for (k, row) in rows.chunks_exact(width).enumerate() {
        for (column, &value) in row.iter().enumerate() {
            groups[k / LANES * width + column].0[k % LANES] = value;
        }
    }
}
