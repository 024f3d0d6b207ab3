//! The cells of the volume that may hold something.

use glam::{UVec3, Vec3};
use rand::{Rng, SeedableRng, rngs::SmallRng};

use super::Volume;
use crate::lanes::rounded_down;
use crate::scene::Scene;

/// Cells along each side.
pub const OCCUPANCY_RESOLUTION: u32 = 96;
/// Share of a cell's density that is kept at each update (Müller et al. 2022).
const DECAY: f32 = 0.9;
/// Density of a cell before its first update, per metre.
const UNKNOWN: f32 = 1e6;

/// A coarse grid of the density over the unit cube, so that rays skip what is empty.
#[derive(Clone, Debug)]
pub struct OccupancyGrid {
    density: Vec<f32>,
    occupied: Vec<bool>,
    /// Cells that stay occupied whatever their density.
    kept: Vec<bool>,
    threshold: f32,
}

impl OccupancyGrid {
    /// Everything may be occupied. `step` is the distance between samples, in metres: a cell counts as
    /// empty when a step through it would stop less than 1% of the light.
    pub fn unknown(step: f32) -> Self {
        let cells = (OCCUPANCY_RESOLUTION as usize).pow(3);
        Self {
            density: vec![UNKNOWN; cells],
            occupied: vec![true; cells],
            kept: vec![false; cells],
            threshold: 0.01 / step,
        }
    }

    /// Empties the cells that measured rays of the keyframes pass through and marks those that they end in.
    pub fn carve(&mut self, scene: &Scene, volume: &Volume) {
        let cell = volume.side / OCCUPANCY_RESOLUTION as f32;
        let keyframes = scene.frames.iter().filter(|frame| frame.is_keyframe());
        let measured: Vec<_> = keyframes
            .filter_map(|frame| Some((frame, frame.depth()?)))
            .collect();
        let rays = || {
            measured.iter().flat_map(|(frame, depth)| {
                let sampled = depth.sampled(4000);
                sampled.map(move |(index, length)| (frame.center(), frame.ray_direction(index), length))
            })
        };
        for (origin, direction, length) in rays() {
            let Some((enter, leave)) = volume.clip(origin, direction) else {
                continue;
            };
            // Keep a distance from the surface, for noise and for the size of a cell.
            let end = (length * 0.97 - 2.0 * cell).min(leave + cell);
            let mut t = enter + 0.5 * cell;
            while t < end {
                if let Some(index) = index_of(volume.to_unit(origin + t * direction)) {
                    self.density[index] = 0.0;
                }
                t += 0.9 * cell;
            }
        }
        for (origin, direction, length) in rays() {
            for offset in [-1.0, 0.0, 1.0] {
                let point = origin + (length + offset * cell) * direction;
                if let Some(index) = index_of(volume.to_unit(point)) {
                    self.density[index] = UNKNOWN;
                }
            }
        }
        self.classify();
    }

    /// Keeps the cells around sparse points occupied from now on: there is a surface, though the field may not have
    /// found it yet. The rays to the points empty no cells, since there are too few of them to mark what lies beside.
    pub fn keep_points(&mut self, scene: &Scene, volume: &Volume) {
        let mut has_points = vec![false; self.kept.len()];
        for frame in &scene.frames {
            for point in &frame.points {
                let place = frame.place(point.pixel as usize, point.length);
                if let Some(index) = index_of(volume.to_unit(place)) {
                    has_points[index] = true;
                }
            }
        }
        for index in (0..has_points.len()).filter(|&index| has_points[index]) {
            let middle = corner_of(index as u32) + 0.5;
            let around = (0..27).map(|k| Vec3::new((k % 3) as f32, (k / 3 % 3) as f32, (k / 9) as f32));
            let around = around.map(|k| (middle + k - 1.0) / OCCUPANCY_RESOLUTION as f32);
            around
                .filter_map(index_of)
                .for_each(|other| self.kept[other] = true);
        }
        self.classify();
    }

    /// Whether the cell around a unit position can hold anything; nothing outside the cube can.
    #[inline]
    pub fn is_occupied(&self, unit: Vec3) -> bool {
        index_of(unit).is_some_and(|index| self.occupied[index])
    }

    /// All cells, and a random unit position inside each.
    pub fn everywhere(&self, seed: u64) -> (Vec<u32>, Vec<Vec3>) {
        let cells = (0..self.occupied.len() as u32).collect();
        Self::inside(cells, &mut SmallRng::seed_from_u64(seed))
    }

    /// Random cells to update next, half of them occupied ones, and a random unit position inside each.
    pub fn probes(&self, count: usize, seed: u64) -> (Vec<u32>, Vec<Vec3>) {
        let mut rng = SmallRng::seed_from_u64(seed);
        let occupied: Vec<u32> = (0..self.occupied.len() as u32)
            .filter(|&i| self.occupied[i as usize])
            .collect();
        let cells: Vec<u32> = (0..count)
            .map(|k| {
                if k % 2 == 0 && !occupied.is_empty() {
                    occupied[rng.random_range(0..occupied.len())]
                } else {
                    rng.random_range(0..self.occupied.len() as u32)
                }
            })
            .collect();
        Self::inside(cells, &mut rng)
    }

    fn inside(cells: Vec<u32>, rng: &mut SmallRng) -> (Vec<u32>, Vec<Vec3>) {
        let positions = cells
            .iter()
            .map(|&cell| {
                let jitter = Vec3::new(rng.random(), rng.random(), rng.random());
                (corner_of(cell) + jitter) / OCCUPANCY_RESOLUTION as f32
            })
            .collect();
        (cells, positions)
    }

    /// Updates cells by densities (per metre) at the positions of [`OccupancyGrid::probes`].
    pub fn update(&mut self, cells: &[u32], found: &[f32]) {
        for (&cell, &found) in cells.iter().zip(found) {
            let density = &mut self.density[cell as usize];
            *density = if *density == UNKNOWN {
                found
            } else {
                (*density * DECAY).max(found)
            };
        }
        self.classify();
    }

    /// The density of all cells, for saving.
    pub fn density(&self) -> &[f32] {
        &self.density
    }

    /// Restores saved densities, if their number is right.
    pub fn restore(&mut self, density: Vec<f32>) {
        if density.len() == self.density.len() {
            self.density = density;
            self.classify();
        }
    }

    /// While the whole field is thin, half of the mean density replaces the absolute threshold.
    fn classify(&mut self) {
        let known = || self.density.iter().filter(|&&density| density != UNKNOWN);
        let mean = known().sum::<f32>() / known().count().max(1) as f32;
        let threshold = self.threshold.min(0.5 * mean);
        let cells = self.density.iter().zip(&self.kept);
        for (occupied, (&density, &kept)) in self.occupied.iter_mut().zip(cells) {
            *occupied = kept || density > threshold;
        }
    }
}

/// The corner of a cell nearest to the volume's own, in cells.
fn corner_of(cell: u32) -> Vec3 {
    let side = OCCUPANCY_RESOLUTION;
    UVec3::new(cell % side, cell / side % side, cell / (side * side)).as_vec3()
}

fn index_of(unit: Vec3) -> Option<usize> {
    let scaled = unit * OCCUPANCY_RESOLUTION as f32;
    let inside = scaled.min_element() >= 0.0 && scaled.max_element() < OCCUPANCY_RESOLUTION as f32;
    inside.then(|| {
        let [x, y, z] = scaled.to_array().map(|place| rounded_down(place).1);
        ((z * OCCUPANCY_RESOLUTION + y) * OCCUPANCY_RESOLUTION + x) as usize
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{DepthMap, SparsePoint};

    #[test]
    fn cells_found_empty_become_empty_and_come_back_when_filled() {
        let mut grid = OccupancyGrid::unknown(0.02);
        let unit = Vec3::new(0.31, 0.7, 0.02);
        let cell = index_of(unit).unwrap() as u32;
        for _ in 0..80 {
            grid.update(&[cell], &[0.0]);
        }
        assert!(!grid.is_occupied(unit));
        grid.update(&[cell], &[50.0]);
        assert!(grid.is_occupied(unit));
    }

    #[test]
    fn rays_are_followed_no_farther_than_through_the_cube() {
        let mut scene = crate::scene::testing::wall(3, 32, 24);
        let volume = Volume::around(&scene.bounds());
        scene.frames[0].set_depth(Some(DepthMap::from_ray_lengths(32, &[1e10; 32 * 24])));
        scene.frames[2].camera_to_world.translation.z -= 1e9;
        let mut grid = OccupancyGrid::unknown(0.02);
        grid.carve(&scene, &volume);
        let (frame, middle) = (&scene.frames[1], 12 * 32 + 16);
        let length = frame.ray_length(middle).unwrap();
        let along = |length: f32| volume.to_unit(frame.place(middle, length));
        assert!(!grid.is_occupied(along(0.5 * length)));
        assert!(grid.is_occupied(along(length)));
    }

    #[test]
    fn cells_around_sparse_points_stay_occupied() {
        let mut scene = crate::scene::testing::wall(3, 32, 24);
        let middle = 12 * 32 + 16;
        for frame in &mut scene.frames {
            let length = frame.depth().unwrap().ray_length(middle).unwrap();
            frame.set_depth(None);
            frame.points = vec![SparsePoint {
                pixel: middle as u32,
                length,
                error: 0.1,
                by_stereo: false,
            }];
        }
        let volume = Volume::around(&scene.bounds());
        let mut grid = OccupancyGrid::unknown(0.02);
        grid.keep_points(&scene, &volume);
        let cells: Vec<u32> = (0..OCCUPANCY_RESOLUTION.pow(3)).collect();
        grid.update(&cells, &vec![0.0; cells.len()]);
        let frame = &scene.frames[1];
        let along = |length: f32| volume.to_unit(frame.place(middle, length));
        assert!(grid.is_occupied(along(frame.points[0].length)));
        assert!(!grid.is_occupied(along(0.5 * frame.points[0].length)));
        let saved = grid.density().to_vec();
        grid.restore(saved);
        assert!(grid.is_occupied(along(frame.points[0].length)));
    }

    #[test]
    fn nothing_is_occupied_outside_the_cube_and_probes_lie_in_their_cells() {
        let grid = OccupancyGrid::unknown(0.02);
        assert!(!grid.is_occupied(Vec3::new(1.01, 0.5, 0.5)));
        assert!(!grid.is_occupied(Vec3::splat(-0.01)));
        assert!(grid.is_occupied(Vec3::splat(0.5)));
        let (cells, positions) = grid.probes(100, 9);
        for (cell, position) in cells.into_iter().zip(positions) {
            assert_eq!(index_of(position), Some(cell as usize));
        }
    }
}
