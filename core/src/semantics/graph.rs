//! The surface as a graph: voxels that the frames see, joined to their neighbours.

use glam::{IVec3, Vec3};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Farthest neighbour, in voxels.
const REACH: f32 = 2.5;
/// Cost of a unit of squared colour difference (channels in 0..=1), and the share of it for differences in brightness
/// alone, such as shadows.
const COLOR_COST: f32 = 4000.0;
const BRIGHTNESS_SHARE: f32 = 0.3;
/// Largest cost of a difference in colour: a print on a thing is no border.
const MOST_COLOR_COST: f32 = 30.0;
/// Half the cost of opposite normals: where the surface is concave, as where a thing stands on another, and where it is
/// convex, as around one thing.
const CONCAVE_COST: f32 = 80.0;
const CONVEX_COST: f32 = 10.0;
/// Cost of a distance of one voxel's side.
const DISTANCE_COST: f32 = 0.005;

/// A voxel of the surface: the mean of the points seen in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// Mean of the points seen in the voxel, in metres.
    pub position: Vec3,
    /// Mean colour, each channel in 0..=1.
    pub color: Vec3,
    /// Mean unit normal towards the cameras; zero where there is none.
    pub normal: Vec3,
    /// Pixels of all frames that show it.
    pub pixels: f32,
    /// Side of its voxel, in metres.
    pub voxel: f32,
}

/// A symmetric graph over surface nodes whose edge costs grow with colour, normal and distance.
#[derive(Clone, Debug, Default)]
pub struct SurfaceGraph {
    nodes: Vec<Node>,
    /// First edge of each node, and the number of edges at the end.
    starts: Vec<u32>,
    /// The other end of each edge, and what it costs.
    edges: Vec<(u32, f32)>,
}

impl SurfaceGraph {
    /// Joins each node to its `count` nearest neighbours; as the graph is symmetric, a node can have more. Parts that stay
    /// apart are joined at their nearest nodes, so that every label can reach every node.
    pub fn new(nodes: Vec<Node>, count: usize) -> Self {
        let mut pairs = neighbours(&nodes, count);
        let nodes = smoothed(nodes, &pairs);
        join_parts(&nodes, &mut pairs);
        let mut directed: Vec<(u32, u32)> = pairs.iter().flat_map(|&(a, b)| [(a, b), (b, a)]).collect();
        directed.par_sort_unstable();
        directed.dedup();
        let with_cost = |&(a, b): &(u32, u32)| (a, b, edge_cost(&nodes[a as usize], &nodes[b as usize]));
        let directed = directed.par_iter().map(with_cost).collect();
        Self::of_directed(nodes, directed)
    }

    /// A graph with these edges and costs in ascending order, each edge in both directions.
    pub(super) fn of_directed(nodes: Vec<Node>, edges: Vec<(u32, u32, f32)>) -> Self {
        let mut starts = vec![0_u32; nodes.len() + 1];
        for &(from, ..) in &edges {
            starts[from as usize + 1] += 1;
        }
        for node in 0..nodes.len() {
            starts[node + 1] += starts[node];
        }
        Self {
            nodes,
            starts,
            edges: edges.into_iter().map(|(_, to, cost)| (to, cost)).collect(),
        }
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Whether there are no nodes.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// The nodes.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// Reads from the edges of each of these nodes, so that all come from memory at the same time, not each when its turn
    /// has come.
    pub(super) fn fetch(&self, nodes: impl Iterator<Item = u32>) {
        let read = |node: u32| {
            let [start, end] = [node, node + 1].map(|node| self.starts[node as usize] as usize);
            let outer = [start, end.saturating_sub(1)].map(|edge| self.edges.get(edge));
            outer.into_iter().flatten().fold(0, |all, (to, _)| all ^ to)
        };
        std::hint::black_box(nodes.map(read).fold(0, |all, one| all ^ one));
    }

    /// Neighbours of a node with the costs of the edges to them.
    #[inline]
    pub fn edges(&self, node: u32) -> impl Iterator<Item = (u32, f32)> + '_ {
        let range = self.starts[node as usize] as usize..self.starts[node as usize + 1] as usize;
        self.edges[range].iter().copied()
    }
}

fn edge_cost(a: &Node, b: &Node) -> f32 {
    let difference = a.color - b.color;
    // The part of the squared difference that is along grey.
    let brightness = difference.element_sum().powi(2) / 3.0;
    let color = difference.length_squared() - (1.0 - BRIGHTNESS_SHARE) * brightness;
    let color = COLOR_COST * color.max(0.0);
    let bend = if a.normal == Vec3::ZERO || b.normal == Vec3::ZERO {
        0.0
    } else {
        let is_convex = (a.position - b.position).dot(a.normal - b.normal) > 0.0;
        let cost = if is_convex { CONVEX_COST } else { CONCAVE_COST };
        cost * (1.0 - a.normal.dot(b.normal)).max(0.0)
    };
    let distance = a.position.distance(b.position) / a.voxel.max(b.voxel);
    color / (1.0 + color / MOST_COLOR_COST) + bend + DISTANCE_COST * distance
}

/// Each node's nearest neighbours, so many of them, as pairs with the smaller index first, without repetition.
fn neighbours(nodes: &[Node], count: usize) -> Vec<(u32, u32)> {
    let cell_of = |node: &Node| {
        (
            node.voxel.to_bits(),
            (node.position / node.voxel).floor().as_ivec3(),
        )
    };
    let mut cells: FxHashMap<(u32, IVec3), Vec<u32>> = FxHashMap::default();
    for (index, node) in nodes.iter().enumerate() {
        cells.entry(cell_of(node)).or_default().push(index as u32);
    }
    let most = REACH.ceil() as i32;
    let mut pairs: Vec<(u32, u32)> = nodes
        .par_iter()
        .enumerate()
        .flat_map_iter(|(index, node)| {
            let (level, cell) = cell_of(node);
            let limit = (REACH * node.voxel).powi(2);
            let mut found: Vec<(f32, u32)> = Vec::with_capacity(64);
            for reach in most - 1..=most {
                found.clear();
                for offset in cube(reach) {
                    for &other in cells.get(&(level, cell + offset)).into_iter().flatten() {
                        let squared = nodes[other as usize].position.distance_squared(node.position);
                        if other as usize != index && squared <= limit {
                            found.push((squared, other));
                        }
                    }
                }
                // What lies outside of these cells is at least that far away, so that few nodes need the outermost.
                let outside = (reach as f32 * node.voxel).powi(2);
                if found.iter().filter(|(squared, _)| *squared < outside).count() >= count {
                    break;
                }
            }
            if found.len() > count {
                found.select_nth_unstable_by(count - 1, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                found.truncate(count);
            }
            let index = index as u32;
            found
                .into_iter()
                .map(move |(_, other)| (index.min(other), index.max(other)))
        })
        .collect();
    pairs.par_sort_unstable();
    pairs.dedup();
    pairs
}

/// The offsets that reach at most this far along each axis.
pub(crate) fn cube(reach: i32) -> impl Iterator<Item = IVec3> {
    let side = 2 * reach + 1;
    (0..side.pow(3)).map(move |k| IVec3::new(k % side, k / side % side, k / (side * side)) - reach)
}

/// Colours and normals averaged once with those of the neighbours, so that the noise of one voxel is no border.
fn smoothed(nodes: Vec<Node>, pairs: &[(u32, u32)]) -> Vec<Node> {
    let own_share = 2.0;
    let mut sums: Vec<(Vec3, Vec3, f32)> = nodes
        .iter()
        .map(|node| (own_share * node.color, own_share * node.normal, own_share))
        .collect();
    for &(a, b) in pairs {
        for (to, from) in [(a, b), (b, a)] {
            // Neighbours across a border keep out of the mean.
            let gap = (nodes[to as usize].color - nodes[from as usize].color).length_squared();
            let weight = (-gap * 400.0).exp();
            let sum = &mut sums[to as usize];
            sum.0 += weight * nodes[from as usize].color;
            sum.1 += weight * nodes[from as usize].normal;
            sum.2 += weight;
        }
    }
    nodes
        .into_iter()
        .zip(sums)
        .map(|(node, (color, normal, weight))| Node {
            color: color / weight,
            normal: normal.normalize_or_zero(),
            ..node
        })
        .collect()
}

/// Adds edges until the graph is connected: in ever coarser cells, parts in neighbouring cells are joined between their
/// nearest nodes there.
fn join_parts(nodes: &[Node], pairs: &mut Vec<(u32, u32)>) {
    let mut parts = DisjointSets::new(nodes.len());
    for &(a, b) in pairs.iter() {
        parts.join(a, b);
    }
    let Some(mut size) = nodes.iter().map(|node| node.voxel).reduce(f32::min) else {
        return;
    };
    while parts.count > 1 {
        size *= 2.0;
        // One node of each part in each coarse cell stands for the part there.
        let mut cells: FxHashMap<IVec3, Vec<u32>> = FxHashMap::default();
        for (index, node) in nodes.iter().enumerate() {
            let cell = (node.position / size).floor().as_ivec3();
            let present = cells.entry(cell).or_default();
            let part = parts.root(index as u32);
            if !present.iter().any(|&other| parts.root(other) == part) {
                present.push(index as u32);
            }
        }
        let mut candidates: Vec<(f32, u32, u32)> = Vec::new();
        let half: Vec<IVec3> = cube(1).filter(|d| (d.z, d.y, d.x) >= (0, 0, 0)).collect();
        for (cell, present) in &cells {
            for offset in &half {
                for &other in cells.get(&(*cell + *offset)).into_iter().flatten() {
                    for &index in present {
                        if parts.root(index) != parts.root(other) {
                            let gap = nodes[index as usize]
                                .position
                                .distance(nodes[other as usize].position);
                            candidates.push((gap, index.min(other), index.max(other)));
                        }
                    }
                }
            }
        }
        candidates.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        for (_, a, b) in candidates {
            if parts.join(a, b) {
                pairs.push((a, b));
            }
        }
        if !size.is_finite() {
            return;
        }
    }
}

/// Disjoint sets of things by their numbers.
pub(crate) struct DisjointSets {
    parent: Vec<u32>,
    count: usize,
}

impl DisjointSets {
    /// Each thing by itself.
    pub(crate) fn new(things: usize) -> Self {
        Self {
            parent: (0..things as u32).collect(),
            count: things,
        }
    }

    /// The smallest number in the set of this one.
    pub(crate) fn root(&mut self, mut node: u32) -> u32 {
        while self.parent[node as usize] != node {
            let above = self.parent[self.parent[node as usize] as usize];
            self.parent[node as usize] = above;
            node = above;
        }
        node
    }

    /// Joins two sets; `false` when they were one already.
    pub(crate) fn join(&mut self, a: u32, b: u32) -> bool {
        let (a, b) = (self.root(a), self.root(b));
        if a == b {
            return false;
        }
        self.parent[a.max(b) as usize] = a.min(b);
        self.count -= 1;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::semantics::testing::node;

    fn patch(x: f32, color: f32) -> Vec<Node> {
        let place = |k: usize| Vec3::new(x + 0.05 * (k % 10) as f32, 0.05 * (k / 10) as f32, 0.0);
        let colored = |k| Node {
            color: Vec3::splat(color),
            ..node(place(k))
        };
        (0..100).map(colored).collect()
    }

    #[test]
    fn edges_are_symmetric_and_a_border_costs_more() {
        let mut nodes = patch(0.0, 0.2);
        nodes.extend(patch(0.5, 0.8));
        let graph = SurfaceGraph::new(nodes, 5);
        let mut across = f32::INFINITY;
        let mut within = 0.0_f32;
        for a in 0..graph.len() as u32 {
            for (b, cost) in graph.edges(a) {
                assert!(graph.edges(b).any(|(back, same)| back == a && same == cost));
                if (a < 100) == (b < 100) {
                    within = within.max(cost);
                } else {
                    across = across.min(cost);
                }
            }
        }
        assert!(across > 20.0 * within, "{across} {within}");
    }

    #[test]
    fn shadows_and_prints_cost_less_than_colours_and_edges_around_a_thing_less_than_at_its_foot() {
        let at = |position: Vec3, normal: Vec3, color: Vec3| Node {
            normal,
            color,
            ..node(position)
        };
        let grey = |value: f32| at(Vec3::ZERO, Vec3::Z, Vec3::splat(value));
        let tinted = at(Vec3::ZERO, Vec3::Z, Vec3::new(0.5 + 0.0012_f32.sqrt(), 0.5, 0.5));
        assert!(edge_cost(&grey(0.5), &grey(0.52)) < 0.5 * edge_cost(&grey(0.5), &tinted));
        assert!(edge_cost(&grey(0.0), &grey(1.0)) < MOST_COLOR_COST);
        // The edge of a table top, and its foot on the floor: y points down.
        let floor = |x: f32| at(Vec3::new(x, 0.0, 0.0), -Vec3::Y, Vec3::splat(0.5));
        let side = |x: f32, y: f32| at(Vec3::new(x, y, 0.0), Vec3::X, Vec3::splat(0.5));
        let (convex, concave) = (
            edge_cost(&floor(-0.05), &side(0.0, 0.05)),
            edge_cost(&floor(0.05), &side(0.0, -0.05)),
        );
        assert!(concave > 5.0 * convex, "{concave} {convex}");
    }

    #[test]
    fn parts_far_apart_are_joined() {
        let mut nodes = patch(0.0, 0.5);
        nodes.extend(patch(3.0, 0.5));
        nodes.extend(patch(-40.0, 0.1));
        let graph = SurfaceGraph::new(nodes, 5);
        let mut seen = vec![false; graph.len()];
        let mut open = vec![0];
        while let Some(node) = open.pop() {
            if !std::mem::replace(&mut seen[node as usize], true) {
                open.extend(graph.edges(node).map(|(next, _)| next));
            }
        }
        assert!(seen.iter().all(|&s| s));
    }
}
