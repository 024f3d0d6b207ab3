//! Distances to the nearest of many positions.

use glam::{IVec3, Vec3};
use rustc_hash::FxHashMap;

use crate::semantics::cube;

/// Positions in a hash of cells.
pub(super) struct Nearby {
    cells: FxHashMap<IVec3, Vec<Vec3>>,
    reach: f32,
}

impl Nearby {
    /// No positions yet; `reach` is the largest distance that matters, in metres.
    pub(super) fn new(reach: f32) -> Self {
        Self {
            cells: FxHashMap::default(),
            reach,
        }
    }

    pub(super) fn add(&mut self, position: Vec3) {
        self.cells.entry(self.cell(position)).or_default().push(position);
    }

    /// Distance to the nearest position, in metres; the reach where none is nearer.
    pub(super) fn distance(&self, position: Vec3) -> f32 {
        let cell = self.cell(position);
        let mut nearest = self.reach;
        for offset in cube(1) {
            for place in self.cells.get(&(cell + offset)).into_iter().flatten() {
                nearest = nearest.min(place.distance(position));
            }
        }
        nearest
    }

    fn cell(&self, position: Vec3) -> IVec3 {
        (position / self.reach).floor().as_ivec3()
    }
}
