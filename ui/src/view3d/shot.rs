//! What is drawn of the splats, and from where.

use std::sync::Arc;

use glam::Mat4;
use inplace_model::layer::Layer;
use inplace_model::palette::Palette;
use inplace_model::versioned::{Version, Versioned};

use super::camera::Sight;
use super::cloud::Prepared;

/// Radius of a splat, in sides of its voxel: neighbours overlap, also where a surface lies aslant in the voxels.
pub const SPLAT_RADIUS: f32 = 1.0;
/// Least radius of a splat in physical pixels.
pub const LEAST_PIXELS: f32 = 0.8;
/// A beginning of the splats is drawn at most so many times as large.
const MOST_GROWTH: f32 = 4.0;
/// More than their number asks for: a random part of the splats leaves holes between clumps.
const CLUMPS: f32 = 1.3;

/// How the splats are coloured, and which of them are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SplatLook {
    /// What lies over their colour.
    pub layer: Layer,
    /// How much it covers, 0..=1.
    pub opacity: f32,
    /// Whether splats that face away are left out.
    pub see_through: bool,
    /// What is behind them.
    pub background: egui::Color32,
}

/// One view of the splats.
#[derive(Clone)]
pub struct Shot {
    /// The splats and what is known of them.
    pub prepared: Prepared,
    /// Where they are seen from, and where on the screen.
    pub sight: Sight,
    /// How they are coloured.
    pub look: SplatLook,
    /// The classes' colours.
    pub palette: Versioned<Arc<Palette>>,
}

impl Shot {
    /// Number of splats.
    pub fn splats(&self) -> usize {
        self.prepared.cloud.splats.len()
    }

    /// Size of its picture in physical pixels.
    pub fn size(&self, pixels_per_point: f32) -> [u32; 2] {
        let size = self.sight.area.size() * pixels_per_point;
        [size.x, size.y].map(|v| v.round().clamp(1.0, 8192.0) as u32)
    }

    /// What its picture depends on.
    pub fn picture(&self) -> Picture {
        Picture {
            clip_from_world: self.sight.clip_from_world(),
            cloud: self.prepared.cloud.version,
            values: self.prepared.values.version,
            palette: self.palette.version(),
            look: self.look,
        }
    }

    /// How many splats are drawn while the camera moves, of which so many may be, and how many times as large.
    pub fn beginning(&self, budget: usize) -> (usize, f32) {
        let total = self.splats();
        let count = budget.clamp(1, total.max(1));
        if count >= total {
            return (total, 1.0);
        }
        let growth = CLUMPS * (total as f32 / count as f32).sqrt();
        (count, growth.min(MOST_GROWTH))
    }
}

/// All that a picture depends on, but for its size.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    pub clip_from_world: Mat4,
    /// Version of the splats.
    pub cloud: Version,
    /// Version of what is known of them.
    pub values: Version,
    /// Version of the classes' colours.
    pub palette: Version,
    /// How they are coloured.
    pub look: SplatLook,
}

impl Picture {
    /// Whether another picture shows the same splats at the same places, be it in other colours.
    pub fn same_view(&self, other: &Self) -> bool {
        self.clip_from_world == other.clip_from_world
            && self.cloud == other.cloud
            && self.look.see_through == other.look.see_through
            && self.look.background == other.look.background
    }
}

#[cfg(test)]
pub(super) mod tests {
    use egui::{Rect, pos2, vec2};
    use glam::Quat;
    use inplace_core::labels::Class;
    use inplace_core::semantics::Posterior;
    use inplace_model::space::{Direction, OrbitCamera};
    use inplace_model::workspace::LabelledSurface;

    use super::super::cloud::tests::floor;
    use super::super::cloud::{Cloud, Values};
    use super::*;

    pub const CLASS: [u8; 3] = [40, 200, 90];
    pub const BACKGROUND: [u8; 3] = [9, 9, 9];

    /// A floor of one class, seen from straight above or straight below, in an area with sides of so many points.
    pub fn floor_from(above: bool, side: u32) -> Shot {
        let surface = floor(40);
        let cloud = Arc::new(Cloud::new(&surface));
        let posterior = Arc::new(Posterior {
            labels: vec![3; surface.graph.len()],
            entropy: vec![0; surface.graph.len()],
            ..Posterior::default()
        });
        let values = Arc::new(Values::new(&cloud, &posterior, None));
        let pitch = if above { -1.5 } else { 1.5 };
        let direction = Direction { yaw: 0.0, pitch };
        let camera = OrbitCamera::fitted(cloud.ball, direction, Quat::IDENTITY);
        let mut class = Class::new(3, "floor");
        class.color = CLASS;
        let [r, g, b] = BACKGROUND;
        Shot {
            prepared: Prepared {
                cloud,
                values,
                surface: LabelledSurface { surface, posterior },
                objects: None,
            },
            sight: Sight::new(
                &camera,
                Rect::from_min_size(pos2(7.0, 5.0), vec2(side as f32, side as f32)),
            ),
            look: SplatLook {
                layer: Layer::Labels,
                opacity: 1.0,
                see_through: true,
                background: egui::Color32::from_rgb(r, g, b),
            },
            palette: Versioned::new(Palette::new(&[class])),
        }
    }

    #[test]
    fn few_splats_are_larger_and_all_are_as_large_as_they_are() {
        let shot = floor_from(true, 10);
        assert_eq!(shot.beginning(5000), (1600, 1.0));
        let (count, growth) = shot.beginning(400);
        assert_eq!(count, 400);
        assert!((2.0..3.0).contains(&growth), "{growth}");
        assert_eq!(shot.beginning(0), (1, MOST_GROWTH));
    }
}
