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
/// A part that lies within so many pixels of where a scribble ends, and its radius, is a slip whatever its size, unless the
/// scribble starts there: the start is aimed at.
const OVERSHOT: f32 = 5.0;

/// Nodes under a stroke where it slipped over an edge, ascending; none unless it is a scribble.
pub(super) fn strays(surface: &Surface, camera: &Camera, stroke: &Stroke) -> Vec<u32> {
    if stroke.kind() != StrokeKind::Scribble {
        return Vec::new();
    }
    let [Some(start), Some(end)] = [stroke.first_point(), stroke.last_point()] else {
        return Vec::new();
    };
    let own = pixels_of(stroke, camera.width, camera.height);
    let reach = OVERSHOT + stroke.radius as f32;
    let mut covered: BTreeMap<u32, Covered> = BTreeMap::new();
    for (&pixel, node) in own.iter().zip(surface.nodes_at(stroke.frame, &own)) {
        let Some(node) = node else { continue };
        let [x, y] = [pixel % camera.width, pixel / camera.width];
        let node = covered.entry(node).or_default();
        node.pixels += 1;
        node.starts |= [x, y] == start;
        node.goes_on |= (x.abs_diff(end[0]) as f32).hypot(y.abs_diff(end[1]) as f32) > reach;
    }
    slipped(&surface.graph, &covered)
}

/// What a scribble covers of a node.
#[derive(Clone, Copy, Default)]
struct Covered {
    pixels: u32,
    /// Whether it starts there.
    starts: bool,
    /// Whether any of the pixels is not near its end.
    goes_on: bool,
}

/// The nodes, ascending, in parts of a scribble that lie beyond an edge of the surface at its end, and in other small
/// ones, where there is one large part.
fn slipped(graph: &SurfaceGraph, covered: &BTreeMap<u32, Covered>) -> Vec<u32> {
    let any = |part: &[u32], is: fn(&Covered) -> bool| part.iter().any(|node| is(&covered[node]));
    let size = |part: &[u32]| -> u32 { part.iter().map(|node| covered[node].pixels).sum() };
    let parts = parts(graph, covered.keys().copied().collect());
    let (others, overshot): (Vec<Vec<u32>>, Vec<Vec<u32>>) =
        (parts.into_iter()).partition(|part| any(part, |node| node.starts || node.goes_on));
    if others.is_empty() {
        return Vec::new();
    }
    let all = size(&others.concat());
    let is_small = |part: &&Vec<u32>| part.len() <= FEW && size(part) as f32 <= SLIPPED * all as f32;
    let mut small: Vec<u32> = others.iter().filter(is_small).flatten().copied().collect();
    // A scribble over many small things labels all of them.
    if 2 * size(&small) >= all {
        small.clear();
    }
    let mut slipped = [overshot.concat(), small].concat();
    slipped.sort_unstable();
    slipped
}

/// These nodes in parts that cheap edges join.
fn parts(graph: &SurfaceGraph, mut rest: BTreeSet<u32>) -> Vec<Vec<u32>> {
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

    const NONE: [u32; 0] = [];

    /// The strays of a scribble over this number of nodes in a row, three pixels each, from the first on, with edges after
    /// these; so many at the end are near its end.
    fn strays(count: u32, edges: &[u32], last: u32) -> Vec<u32> {
        let cost = |node: u32| if edges.contains(&node) { 2.0 * EDGE } else { 1.0 };
        let costs: Vec<_> = (1..count).map(|next| (next - 1, next, cost(next - 1))).collect();
        let covered = |node: u32| Covered {
            pixels: 3,
            starts: node == 0,
            goes_on: node + last < count,
        };
        let covered = (0..count).map(|node| (node, covered(node))).collect();
        slipped(&joined(count as usize, &costs), &covered)
    }

    #[test]
    fn what_lies_beyond_an_edge_is_a_stray_if_it_is_small() {
        assert_eq!(strays(10, &[], 3), NONE);
        assert_eq!(strays(10, &[6], 0), [7, 8, 9]);
        assert_eq!(strays(10, &[0, 7], 0), [0, 8, 9], "it starts beyond another edge");
        assert_eq!(strays(10, &[4], 3), NONE, "two things, and it means both");
        assert_eq!(strays(40, &[29], 3), NONE, "a part that is as long as a thing");
        assert_eq!(strays(10, &[1, 3, 5, 7], 0), NONE, "many things");
    }

    #[test]
    fn the_last_pixels_beyond_an_edge_are_strays_however_short_the_scribble_is() {
        assert_eq!(strays(4, &[0], 3), [1, 2, 3]);
        assert_eq!(strays(8, &[2, 4, 6], 3), [5, 6, 7]);
        assert_eq!(strays(4, &[1], 4), [2, 3], "where it starts is meant");
        let covered = [(0, Covered::default())].into_iter().collect();
        assert_eq!(
            slipped(&joined(1, &[]), &covered),
            NONE,
            "it starts where nothing is known"
        );
    }
}
