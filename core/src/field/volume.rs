//! The volume of the world that the field models.

use glam::Vec3;

use crate::scene::Bounds;

/// From so many sides away the cube is smaller than a pixel, and single precision still tells steps through it apart.
const FARTHEST: f32 = 1e4;
/// Share of the side by which two volumes may differ that are one but for rounding: much less than the finest cell.
const ROUNDING: f32 = 1e-4;

/// The cube of the world that the field models; its encoding works in unit coordinates inside it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Volume {
    /// Corner with the smallest coordinates, in metres.
    pub min: Vec3,
    /// Length of each side, in metres.
    pub side: f32,
}

impl Volume {
    /// The smallest cube around the bounds, with the same centre.
    pub fn around(bounds: &Bounds) -> Self {
        let side = bounds.size().max_element().max(1e-3);
        let centre = 0.5 * (bounds.min + bounds.max);
        Self {
            min: centre - 0.5 * side,
            side,
        }
    }

    /// The smallest corner and the side, in metres.
    pub fn to_array(self) -> [f32; 4] {
        let [x, y, z] = self.min.to_array();
        [x, y, z, self.side]
    }

    /// Whether these are its corner and side, but for rounding.
    pub fn is_about(&self, saved: &[f32]) -> bool {
        let own = self.to_array();
        let is_near = |(own, saved): (&f32, &f32)| (own - saved).abs() <= ROUNDING * self.side;
        saved.len() == own.len() && own.iter().zip(saved).all(is_near)
    }

    /// World position to unit coordinates.
    pub fn to_unit(&self, world: Vec3) -> Vec3 {
        (world - self.min) / self.side
    }

    /// Distances in metres at which a ray enters and leaves the cube; `None` when it misses it, or begins so far away that it
    /// sees nothing of it.
    pub fn clip(&self, origin: Vec3, direction: Vec3) -> Option<(f32, f32)> {
        let inverse = direction.recip();
        let a = (self.min - origin) * inverse;
        let b = (self.min + self.side - origin) * inverse;
        let enter = a.min(b).max_element().max(0.0);
        let leave = a.max(b).min_element();
        (leave > enter && enter < FARTHEST * self.side).then_some((enter, leave))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_is_clipped_to_the_cube() {
        let volume = Volume {
            min: Vec3::ZERO,
            side: 2.0,
        };
        let through = volume.clip(Vec3::new(-1.0, 1.0, 1.0), Vec3::X);
        assert_eq!(through, Some((1.0, 3.0)));
        assert_eq!(volume.clip(Vec3::splat(1.0), Vec3::Z), Some((0.0, 1.0)));
        assert_eq!(volume.clip(Vec3::new(-1.0, 3.0, 1.0), Vec3::X), None);
        assert!(volume.clip(Vec3::new(-1e4, 1.0, 1.0), Vec3::X).is_some());
        assert_eq!(volume.clip(Vec3::new(-1e5, 1.0, 1.0), Vec3::X), None);
    }
}
