//! What lies under the pointer, found on a thread of its own.

use std::sync::Arc;

use glam::Vec3;
use inplace_core::labels::Pixel;
use inplace_core::scene::Scene;
use inplace_core::semantics::best_view;
use inplace_model::workspace::Chosen;

use super::camera::{NEAR, Ray};
use super::cloud::Cloud;
use super::shot::SPLAT_RADIUS;
use crate::background::{Desk, Gone};

/// Among splats that are hardly farther than the nearest, in sides of its voxel, the one that the ray passes closest
/// counts.
const SAME_SURFACE: f32 = 2.0;

/// Why something is looked for.
#[derive(Clone, Debug, PartialEq)]
pub enum Purpose {
    /// To label it as what was chosen when it was clicked on.
    Label(Chosen),
    /// To turn around it.
    Pivot,
    /// To tell what it is.
    Tell,
}

/// A place of the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The node of the surface.
    pub node: u32,
    /// Where it is, in metres.
    pub position: Vec3,
    /// The frame that shows it best, and the pixel there, where it is to be labelled.
    pub seen: Option<(usize, Pixel)>,
}

/// The answer to a question.
#[derive(Clone, Debug)]
pub struct Picked {
    /// The scene that it is about.
    pub scene: Arc<Scene>,
    /// Why it was asked.
    pub purpose: Purpose,
    /// What lies there; `None` where there is nothing.
    pub hit: Option<Hit>,
}

/// What is looked for, and among what.
pub struct Question {
    pub scene: Arc<Scene>,
    /// What is drawn.
    pub cloud: Arc<Cloud>,
    /// The ray through the pointer.
    pub ray: Ray,
    /// How far beside the ray a splat may be missed, in radians.
    pub slack: f32,
    /// Whether splats that face away from the eye are not drawn.
    pub see_through: bool,
    pub purpose: Purpose,
}

impl Question {
    fn answer(self) -> Picked {
        let node = pick(&self.cloud, self.ray, self.slack, self.see_through);
        let hit = node.map(|node| Hit {
            node,
            position: self.cloud.surface.graph.nodes()[node as usize].position,
            seen: match self.purpose {
                Purpose::Label(_) => best_view(&self.scene, &self.cloud.surface, node),
                Purpose::Pivot | Purpose::Tell => None,
            },
        });
        Picked {
            scene: self.scene,
            purpose: self.purpose,
            hit,
        }
    }
}

/// The node whose splat a ray meets first, or passes at less than `slack` radians. With `see_through`, those that face
/// away from the ray's origin are no obstacle.
pub fn pick(cloud: &Cloud, ray: Ray, slack: f32, see_through: bool) -> Option<u32> {
    // Depth along the ray and squared distance from it, where it is met.
    let met = |index: usize| {
        let splat = &cloud.splats[index];
        let offset = Vec3::from(splat.position) - ray.origin;
        let depth = offset.dot(ray.direction);
        let beside = offset.length_squared() - depth * depth;
        let reach = SPLAT_RADIUS * splat.voxel + slack * depth;
        if depth < NEAR || beside > reach * reach {
            return None;
        }
        let away = splat.normal().dot(offset) > 0.0;
        (!see_through || !away).then_some((depth, beside))
    };
    let candidates: Vec<(usize, f32, f32)> = (0..cloud.splats.len())
        .filter_map(|index| met(index).map(|(depth, beside)| (index, depth, beside)))
        .collect();
    let nearest = candidates.iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
    let deepest = nearest.1 + SAME_SURFACE * cloud.splats[nearest.0].voxel;
    let same = candidates.iter().filter(|candidate| candidate.1 <= deepest);
    let (index, ..) = same.min_by(|a, b| a.2.total_cmp(&b.2))?;
    Some(cloud.nodes[*index])
}

/// Answers questions in their order.
pub fn answer(desk: &Desk<Question, Picked>) -> Result<(), Gone> {
    loop {
        desk.tell(desk.next()?.answer())?;
    }
}

#[cfg(test)]
mod tests {
    use super::super::cloud::tests::floor;
    use super::*;

    fn ray(from: Vec3, to: Vec3) -> Ray {
        Ray {
            origin: from,
            direction: (to - from).normalize(),
        }
    }

    #[test]
    fn the_splat_that_the_ray_meets_is_found() {
        let surface = floor(20);
        let cloud = Cloud::new(&surface);
        for node in [0, 57, 399] {
            let position = surface.graph.nodes()[node as usize].position;
            let from = Vec3::new(1.0, -2.0, -1.0);
            let beside = position + Vec3::new(0.02, 0.0, -0.02);
            assert_eq!(pick(&cloud, ray(from, beside), 0.001, true), Some(node));
            // Away from it there is nothing.
            let away = ray(from, from + (from - position));
            assert_eq!(pick(&cloud, away, 0.001, true), None);
        }
    }

    #[test]
    fn what_faces_away_is_looked_through_where_it_is_not_drawn() {
        let cloud = Cloud::new(&floor(20));
        let below = ray(Vec3::new(1.0, 2.0, 1.0), Vec3::new(1.0, 0.0, 1.0));
        assert_eq!(pick(&cloud, below, 0.001, true), None);
        assert_eq!(pick(&cloud, below, 0.001, false), Some(10 * 20 + 10));
    }
}
