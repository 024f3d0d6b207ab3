//! Where a scribble slipped over an edge onto something that was not meant.

use std::collections::{BTreeMap, BTreeSet};

use super::{Surface, SurfaceGraph};
use crate::labels::{Stroke, StrokeKind, pixels_of};
use crate::scene::Camera;

/// Nodes that an edge of at most this cost joins are one part of a scribble.
const EDGE: f32 = 10.0;
/// A part with at most this share of a scribble's pixels and this number of nodes is a slip, if another part has most
/// of the pixels.
const SLIPPED: f32 = 1.0 / 3.0;
const FEW: usize = 8;

/// Nodes under a stroke where it slipped over an edge, ascending; none unless it is a scribble.
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

/// The nodes, ascending, in small parts of a scribble beyond edges of the surface, where there is one large part.
/// `pixels` holds the number of the scribble's pixels on each of its nodes.
fn slipped(graph: &SurfaceGraph, pixels: &BTreeMap<u32, u32>) -> Vec<u32> {
    let all: u32 = pixels.values().sum();
    let parts = parts(graph, pixels);
    let size = |part: &[u32]| -> u32 { part.iter().map(|node| pixels[node]).sum() };
    let is_small = |part: &&Vec<u32>| part.len() <= FEW && size(part) as f32 <= SLIPPED * all as f32;
    let mut slipped: Vec<u32> = parts.iter().filter(is_small).flatten().copied().collect();
    slipped.sort_unstable();
    // A scribble over many small things labels all of them.
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
    use super::*;
    use crate::semantics::testing::joined;

    #[test]
    fn what_lies_beyond_an_edge_is_a_stray_if_it_is_small() {
        // Ten nodes in a row or more, with edges after these nodes.
        let strays = |count: u32, edges: &[u32]| {
            let cost = |node: u32| if edges.contains(&node) { 2.0 * EDGE } else { 1.0 };
            let costs: Vec<_> = (1..count).map(|next| (next - 1, next, cost(next - 1))).collect();
            let everywhere = (0..count).map(|node| (node, 3)).collect();
            slipped(&joined(count as usize, &costs), &everywhere)
        };
        let none: [u32; 0] = [];
        assert_eq!(strays(10, &[]), none);
        assert_eq!(strays(10, &[6]), [7, 8, 9]);
        assert_eq!(strays(10, &[0, 7]), [0, 8, 9], "it starts beyond another edge");
        assert_eq!(strays(10, &[4]), none, "two things, and it means both");
        assert_eq!(strays(40, &[29]), none, "a part that is as long as a thing");
        assert_eq!(strays(10, &[1, 3, 5, 7]), none, "many things");
    }
}
