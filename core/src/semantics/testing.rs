//! Small surfaces with labels for the core's own tests.

use std::sync::Arc;

use glam::Vec3;

use super::{ClassGeodesics, Evidence, LabelPropagation, Look, Node, Surface, SurfaceGraph};
use crate::labels::{ClassId, LabelSet};
use crate::scene::Scene;

/// A grey node that one pixel shows, facing along z, with voxels of 5 cm.
pub fn node(position: Vec3) -> Node {
    Node {
        position,
        color: Vec3::splat(0.5),
        normal: Vec3::Z,
        pixels: 1.0,
        voxel: 0.05,
    }
}

/// Nodes at one place, joined by edges of these costs.
pub fn joined(nodes: usize, edges: &[(u32, u32, f32)]) -> SurfaceGraph {
    let both_ways = edges
        .iter()
        .flat_map(|&(a, b, cost)| [(a, b, cost), (b, a, cost)]);
    let mut directed: Vec<(u32, u32, f32)> = both_ways.collect();
    directed.sort_by_key(|edge| (edge.0, edge.1));
    SurfaceGraph::of_directed(vec![node(Vec3::ZERO); nodes], directed)
}

/// A surface of these nodes without edges that no frame shows.
pub fn loose(nodes: Vec<Node>, voxel: f32) -> Surface {
    let graph = SurfaceGraph::of_directed(nodes, Vec::new());
    Surface {
        look: Arc::new(Look::new(&graph, Vec3::Y)),
        graph,
        voxel,
        is_sharp: true,
        ..Surface::default()
    }
}

/// Evidence of distances alone.
pub fn by_distance<'a>(classes: &'a [ClassId], geodesics: &'a ClassGeodesics) -> Evidence<'a> {
    Evidence {
        classes,
        geodesics,
        likeness: None,
        second_likeness: None,
        votes: None,
        objects: None,
        prior: None,
    }
}

/// The surface of a scene in a box of 5 m.
pub fn surface(scene: &Scene) -> Arc<Surface> {
    Arc::new(Surface::build(scene, &[], 5.0).unwrap())
}

/// Labels propagated over the surface of a scene.
pub fn propagated(scene: &Scene, labels: &LabelSet) -> LabelPropagation {
    let mut propagation = LabelPropagation::new(surface(scene));
    propagation.set_labels(scene, labels);
    propagation
}

/// The class of every pixel of a frame of a wall: 1 where it is dark, 2 where it is bright.
pub fn truth(scene: &Scene, frame: usize) -> Vec<ClassId> {
    let frame = &scene.frames[frame];
    let color = frame.color();
    let class = |pixel: usize| 1 + ClassId::from(color.pixel(pixel)[0] > 128);
    (0..frame.camera.pixels()).map(class).collect()
}
