//! The levels of the hash grid on groups of sixteen samples: interpolation, and the scatter of its gradient.

use rayon::prelude::*;

use super::split_off;
use crate::field::encoding::{FEATURES_PER_LEVEL, GridLevel, GridShape};
use crate::lanes::{Dispatch, F32x16, LANES, VectorUnit, dispatched};

dispatched! {
    /// Interpolates a level's rows at positions `[groups, 3]` into features `place` and `place + 1` of
    /// encodings `[groups, width]`. `table` holds the rows of this level.
    pub fn interpolate = interpolate_on(
        level: &GridLevel,
        table: &[[f32; 2]],
        positions: &[F32x16],
        encoding: &mut [F32x16],
        width: usize,
        place: usize,
    )
}

dispatched! {
    /// Adds to a level's rows the gradient that arrives at features `place` and `place + 1` of
    /// `derivatives`, `[groups, width]`; samples in order.
    pub fn scatter = scatter_on(
        level: &GridLevel,
        gradient: &mut [[f32; 2]],
        positions: &[F32x16],
        derivatives: &[F32x16],
        width: usize,
        place: usize,
    )
}

/// Writes the gradient of a grid's table, `[rows, 2]`: the sum of what arrives at its features, `derivatives`
/// `[groups, features]`. Each level is on its own, samples in order, so that the sum is the same for any number of
/// threads.
pub fn scatter_levels(
    dispatch: Dispatch,
    grid: &GridShape,
    gradient: &mut [[f32; 2]],
    positions: &[F32x16],
    derivatives: &[F32x16],
) {
    let width = grid.features();
    let mut rest = gradient;
    let mut tasks = Vec::with_capacity(grid.levels().len());
    for (index, level) in grid.levels().iter().enumerate() {
        let own = split_off(&mut rest, level.rows);
        tasks.push((index * FEATURES_PER_LEVEL, level, own));
    }
    // The finest levels take the longest, so they come first.
    tasks
        .into_par_iter()
        .rev()
        .with_max_len(1)
        .for_each(|(place, level, own)| {
            own.fill([0.0; 2]);
            scatter(dispatch, level, own, positions, derivatives, width, place);
        });
}

#[inline(always)]
fn interpolate_on<U: VectorUnit>(
    unit: U,
    level: &GridLevel,
    table: &[[f32; 2]],
    positions: &[F32x16],
    encoding: &mut [F32x16],
    width: usize,
    place: usize,
) {
    assert_eq!(table.len(), level.rows);
    for (position, encoding) in positions.chunks_exact(3).zip(encoding.chunks_exact_mut(width)) {
        let (rows, weights) = level.corners_of_group(position);
        // All corners are fetched before the first is used: a load of sixteen lanes right after their
        // stores would wait for these.
        let mut entries = [[F32x16::ZERO; 2]; 8];
        for corner in 0..8 {
            for lane in 0..LANES {
                let entry = table[rows[corner][lane] as usize];
                entries[corner][0].0[lane] = entry[0];
                entries[corner][1].0[lane] = entry[1];
            }
        }
        let mut sums = [unit.splat_f32s(0.0); 2];
        for corner in 0..8 {
            let weight = unit.load(&weights[corner]);
            for feature in 0..2 {
                sums[feature] = unit.mul_add(weight, unit.load(&entries[corner][feature]), sums[feature]);
            }
        }
        for feature in 0..2 {
            unit.store(sums[feature], &mut encoding[place + feature]);
        }
    }
}

#[inline(always)]
fn scatter_on<U: VectorUnit>(
    unit: U,
    level: &GridLevel,
    gradient: &mut [[f32; 2]],
    positions: &[F32x16],
    derivatives: &[F32x16],
    width: usize,
    place: usize,
) {
    assert_eq!(gradient.len(), level.rows);
    for (position, derivatives) in positions.chunks_exact(3).zip(derivatives.chunks_exact(width)) {
        let (rows, weights) = level.corners_of_group(position);
        let derivative = [unit.load(&derivatives[place]), unit.load(&derivatives[place + 1])];
        for corner in 0..8 {
            let weight = unit.load(&weights[corner]);
            let mut shares = [F32x16::ZERO; 2];
            for feature in 0..2 {
                unit.store(unit.mul_f32s(weight, derivative[feature]), &mut shares[feature]);
            }
            for ((&row, first), second) in rows[corner].iter().zip(shares[0].0).zip(shares[1].0) {
                let [a, b] = gradient[row as usize];
                gradient[row as usize] = [a + first, b + second];
            }
        }
    }
}
