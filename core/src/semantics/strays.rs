//! Where a scribble slipped over an edge: what lies beyond is not what was meant.

use std::collections::{BTreeMap, BTreeSet};

use super::{Surface, SurfaceGraph};
use crate::labels::{Stroke, StrokeKind, pixels_of};
use crate::scene::Camera;

/// Nodes that an edge of at most this cost joins are one part of a scribble.
const EDGE: f32 = 10.0;
/// A part with at most this share of a scribble's pixels, and so many nodes, slipped there, if another has most of them.
const SLIPPED: f32 = 1.0 / 3.0;
const FEW: usize = 8;

/// Nodes under a stroke that it does not speak of, ascending; none unless it is a scribble.
pub(super) fn strays(surface: &Surface, camera: &Camera, stroke: &Stroke) -> Vec<u32> {
    if stroke.kind() != StrokeKind::Scribble {
        return Vec::new();
    }
    let mut pixels: BTreeMap<u32, u32> = BTreeMap::new();
    let own = pixels_of(stroke, camera.width, camera.height);
    for node in surface.nodes_at(stroke.frame, &own).into_iter().flatten() {
        *pixels.entry(node).or_default() += 1;
    }
    slipped(&surface.graph, &pixels)
}

/// Small parts of a scribble, beyond edges of the surface, where it has a large one: their nodes, ascending. `pixels` has
/// the number of the scribble's pixels on each of its nodes.
fn slipped(graph: &SurfaceGraph, pixels: &BTreeMap<u32, u32>) -> Vec<u32> {
    let all: u32 = pixels.values().sum();
    let parts = parts(graph, pixels);
    let size = |part: &[u32]| -> u32 { part.iter().map(|node| pixels[node]).sum() };
    let is_small = |part: &&Vec<u32>| part.len() <= FEW && size(part) as f32 <= SLIPPED * all as f32;
    let mut slipped: Vec<u32> = parts.iter().filter(is_small).flatten().copied().collect();
    slipped.sort_unstable();
    // A scribble over many small things is about all of them.
    if 2 * size(&slipped) < all {
        slipped
    } else {
        Vec::new()
    }
}

/// The nodes in parts that cheap edges join.
fn parts(graph: &SurfaceGraph, pixels: &BTreeMap<u32, u32>) -> Vec<Vec<u32>> {
    let mut rest: BTreeSet<u32> = pixels.keys().copied().collect();
    let mut parts = Vec::new();
    while let Some(first) = rest.pop_first() {
        let mut part = vec![first];
        let mut next = 0;
        while let Some(&node) = part.get(next) {
            for (neighbour, cost) in graph.edges(node) {
                if cost <= EDGE && rest.remove(&neighbour) {
                    part.push(neighbour);
                }
            }
            next += 1;
        }
        parts.push(part);
    }
    parts
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::semantics::Node;

    /// Nodes in a row, with edges of these costs between them.
    fn row(costs: &[f32]) -> SurfaceGraph {
        let node = |x: usize| Node {
            position: Vec3::X * x as f32,
            color: Vec3::ZERO,
            normal: Vec3::ZERO,
            pixels: 9.0,
            voxel: 1.0,
        };
        let edges: Vec<(u32, u32, f32)> = (0..)
            .zip(1..)
            .zip(costs)
            .map(|((a, b), &cost)| (a, b, cost))
            .collect();
        SurfaceGraph::from_edges((0..=costs.len()).map(node).collect(), &edges)
    }

    #[test]
    fn what_lies_beyond_an_edge_is_a_stray_if_it_is_small() {
        let strays = |costs: &[f32]| {
            let everywhere = (0..=costs.len() as u32).map(|node| (node, 3));
            slipped(&row(costs), &everywhere.collect())
        };
        let (near, edge) = (1.0, 2.0 * EDGE);
        assert_eq!(strays(&[near; 9]), [0; 0]);
        assert_eq!(
            strays(&[near, near, near, near, near, near, edge, near, near]),
            [7, 8, 9]
        );
        // It starts beyond another edge, too.
        assert_eq!(
            strays(&[edge, near, near, near, near, near, near, edge, near]),
            [0, 8, 9]
        );
        // Two things, of which it means both.
        assert_eq!(
            strays(&[near, near, near, near, edge, near, near, near, near]),
            [0; 0]
        );
        // A part that is as long as a thing.
        let mut long = [near; 39];
        long[29] = edge;
        assert_eq!(strays(&long), [0; 0]);
        // Many things.
        assert_eq!(
            strays(&[near, edge, near, edge, near, edge, near, edge, near]),
            [0; 0]
        );
    }
}
