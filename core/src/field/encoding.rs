//! The multi-resolution hash grid (Müller et al., "Instant Neural Graphics Primitives", 2022).

use std::sync::Arc;

use super::kernels::{F32x16, LANES};

/// Features of one table entry.
pub const FEATURES_PER_LEVEL: usize = 2;

/// Factors of the coordinates in the spatial hash (Teschner et al. 2003).
const HASH: [u32; 3] = [1, 2_654_435_761, 805_459_861];

/// The shape of a multi-resolution grid over the unit cube: where each level's corners lie in the table.
///
/// The table is a tensor `[rows, FEATURES_PER_LEVEL]`, level after level. Levels whose corners fit
/// are stored densely; finer levels are hashed.
#[derive(Clone, Debug, PartialEq)]
pub struct GridShape {
    levels: Arc<[GridLevel]>,
    rows: usize,
}

/// One level of a [`GridShape`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridLevel {
    /// Cells along each side of the unit cube.
    pub resolution: u32,
    /// First row of the level in the table.
    pub first_row: usize,
    /// Rows of the level.
    pub rows: usize,
    dense: bool,
}

impl GridShape {
    /// `levels` levels whose resolutions grow geometrically from `coarsest` to `finest` cells a side,
    /// with at most 2^`table_log2` rows each.
    pub fn new(levels: usize, coarsest: u32, finest: u32, table_log2: u32) -> Self {
        let growth = (f64::from(finest) / f64::from(coarsest)).powf(1.0 / (levels.max(2) - 1) as f64);
        let limit = 1_usize << table_log2;
        let mut rows = 0;
        let levels: Arc<[GridLevel]> = (0..levels)
            .map(|level| {
                let resolution = (f64::from(coarsest) * growth.powi(level as i32)).round().max(1.0) as u32;
                let corners = (resolution as usize + 1).pow(3);
                let level = GridLevel {
                    resolution,
                    first_row: rows,
                    rows: corners.min(limit),
                    dense: corners <= limit,
                };
                rows += level.rows;
                level
            })
            .collect();
        Self { levels, rows }
    }

    /// The same levels with twice as many rows each where they were hashed, and for each row of the result
    /// the row of `self` whose features it takes: then every position is encoded as before, since the
    /// longer hash modulo the old number of rows is the shorter one.
    pub fn doubled(&self) -> (Self, Vec<u32>) {
        let mut levels = Vec::with_capacity(self.levels.len());
        let mut sources = Vec::with_capacity(2 * self.rows);
        for old in self.levels.iter() {
            let corners = (old.resolution as usize + 1).pow(3);
            let dense = old.dense || corners <= 2 * old.rows;
            let rows = if dense { corners } else { 2 * old.rows };
            levels.push(GridLevel {
                first_row: sources.len(),
                rows,
                dense,
                ..*old
            });
            if old.dense || !dense {
                sources.extend((0..rows).map(|row| (old.first_row + row % old.rows) as u32));
            } else {
                let side = 0..=old.resolution;
                for (z, y) in side.clone().flat_map(|z| side.clone().map(move |y| (z, y))) {
                    sources.extend(side.clone().map(|x| old.row(x, y, z)));
                }
            }
        }
        let rows = sources.len();
        let levels = levels.into();
        (Self { levels, rows }, sources)
    }

    /// The levels, coarsest first.
    pub fn levels(&self) -> &[GridLevel] {
        &self.levels
    }

    /// Rows of the whole table.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Features that a position is encoded to.
    pub fn features(&self) -> usize {
        self.levels.len() * FEATURES_PER_LEVEL
    }
}

impl GridLevel {
    /// Table rows and trilinear weights of the eight corners around a position in the unit cube.
    #[inline(always)]
    pub fn corners(&self, position: [f32; 3]) -> ([u32; 8], [f32; 8]) {
        let scale = self.resolution as f32;
        let top = self.resolution - 1;
        let scaled = position.map(|p| p.clamp(0.0, 1.0) * scale);
        let cell = scaled.map(|s| (s as u32).min(top));
        let f: [f32; 3] = std::array::from_fn(|axis| scaled[axis] - cell[axis] as f32);
        let mut rows = [0; 8];
        let mut weights = [0.0; 8];
        for corner in 0..8_u32 {
            let offset = [corner & 1, (corner >> 1) & 1, corner >> 2];
            rows[corner as usize] = self.row(cell[0] + offset[0], cell[1] + offset[1], cell[2] + offset[2]);
            let weight = |axis: usize| if offset[axis] == 1 { f[axis] } else { 1.0 - f[axis] };
            weights[corner as usize] = weight(0) * weight(1) * weight(2);
        }
        (rows, weights)
    }

    /// What [`GridLevel::corners`] gives, for sixteen positions at once (`[3]`: x, y, z) and with rows
    /// counted from the level's first.
    #[inline(always)]
    #[allow(clippy::needless_range_loop)] // Written by index, as the vectors that the loops become.
    pub(super) fn corners_of_group(&self, position: &[F32x16]) -> ([[u32; LANES]; 8], [F32x16; 8]) {
        let scale = self.resolution as f32;
        let top = self.resolution as i32 - 1;
        let strides = if self.dense {
            let side = self.resolution + 1;
            [1, side, side * side]
        } else {
            HASH
        };
        // Cell and next cell times the axis's stride, weight of the cell and of the next.
        let mut terms = [[[0_u32; LANES]; 2]; 3];
        let mut shares = [[F32x16::ZERO; 2]; 3];
        for axis in 0..3 {
            for lane in 0..LANES {
                // The cast makes zero of not-a-number.
                let scaled = position[axis].0[lane].clamp(0.0, 1.0) * scale;
                let cell = (scaled as i32).min(top);
                let fraction = scaled - cell as f32;
                shares[axis][0].0[lane] = 1.0 - fraction;
                shares[axis][1].0[lane] = fraction;
                let term = (cell as u32).wrapping_mul(strides[axis]);
                terms[axis][0][lane] = term;
                terms[axis][1][lane] = term.wrapping_add(strides[axis]);
            }
        }
        let mask = self.rows as u32 - 1;
        let mut rows = [[0; LANES]; 8];
        let mut weights = [F32x16::ZERO; 8];
        for corner in 0..8 {
            let [x, y, z] = [corner & 1, (corner >> 1) & 1, corner >> 2];
            for lane in 0..LANES {
                let [a, b, c] = [terms[0][x][lane], terms[1][y][lane], terms[2][z][lane]];
                rows[corner][lane] = if self.dense { a + b + c } else { (a ^ b ^ c) & mask };
                weights[corner].0[lane] = shares[0][x].0[lane] * shares[1][y].0[lane] * shares[2][z].0[lane];
            }
        }
        (rows, weights)
    }

    #[inline(always)]
    fn row(&self, x: u32, y: u32, z: u32) -> u32 {
        let local = if self.dense {
            let side = self.resolution + 1;
            (z * side + y) * side + x
        } else {
            // `rows` is a power of two for hashed levels.
            let hash = x.wrapping_mul(HASH[0]) ^ y.wrapping_mul(HASH[1]) ^ z.wrapping_mul(HASH[2]);
            hash & (self.rows as u32 - 1)
        };
        self.first_row as u32 + local
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_sum_to_one_in_rows_of_the_level_and_a_corner_has_all_of_its_own() {
        let single = GridShape::new(1, 8, 8, 19);
        let (rows, weights) = single.levels()[0].corners([0.25, 0.5, 0.75]);
        let own = rows.iter().position(|&row| row == (6 * 9 + 4) * 9 + 2).unwrap();
        assert!((weights[own] - 1.0).abs() < 1e-6);
        let shape = GridShape::new(6, 4, 200, 12);
        for level in shape.levels() {
            for position in [
                [0.0, 0.0, 0.0],
                [1.0, 1.0, 1.0],
                [0.3, 0.77, 0.5001],
                [-0.2, 1.4, 0.5],
            ] {
                let (rows, weights) = level.corners(position);
                assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-5);
                let range = level.first_row..level.first_row + level.rows;
                assert!(rows.iter().all(|&row| range.contains(&(row as usize))));
            }
        }
    }
}
