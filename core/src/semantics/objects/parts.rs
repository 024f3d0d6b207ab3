//! The parts of a surface that nothing joins, class by class.

use std::collections::BTreeMap;

use glam::Vec3;
use rustc_hash::FxHashMap;

use crate::labels::ClassId;
use crate::semantics::{DisjointSets, Node, NodeCells, Posterior, Surface};

/// Longest edge that joins a part, in voxels.
const JOINED: f32 = 2.5;
/// A part of a class with fewer voxels than this share of the class's largest part is a fragment of the part next to it.
const FRAGMENT: f32 = 0.1;
/// Side of the cells in which the part next to a fragment is looked for, in voxels.
const CELL: f32 = 16.0;

/// A connected part of a class.
pub(super) struct Part {
    pub(super) class: ClassId,
    pub(super) nodes: Vec<u32>,
}

/// The parts of all classes on the free nodes, by class and then the largest first.
pub(super) fn parts(surface: &Surface, posterior: &Posterior, is_free: &dyn Fn(u32) -> bool) -> Vec<Part> {
    let mut all = Vec::new();
    for (class, mut parts) in components(surface, posterior, is_free) {
        let fragments = parts.split_off(smaller_from(&parts, FRAGMENT));
        if !fragments.is_empty() {
            join_fragments(surface.graph.nodes(), &mut parts, fragments);
        }
        all.extend(parts.into_iter().map(|nodes| Part { class, nodes }));
    }
    all
}

/// The connected nodes of each class among those that count, the largest component first.
pub(super) fn components(
    surface: &Surface,
    posterior: &Posterior,
    counts: &dyn Fn(u32) -> bool,
) -> BTreeMap<ClassId, Vec<Vec<u32>>> {
    let (graph, labels) = (&surface.graph, &posterior.labels);
    let nodes = graph.nodes();
    let mut sets = DisjointSets::new(graph.len());
    for node in (0..graph.len() as u32).filter(|&node| counts(node)) {
        let own = &nodes[node as usize];
        for (other, _) in graph.edges(node) {
            let neighbour = &nodes[other as usize];
            let reach = JOINED * own.voxel.min(neighbour.voxel);
            if other < node
                && labels[other as usize] == labels[node as usize]
                && counts(other)
                && own.position.distance(neighbour.position) <= reach
            {
                sets.join(node, other);
            }
        }
    }
    let mut of_root: FxHashMap<u32, Vec<u32>> = FxHashMap::default();
    for node in (0..graph.len() as u32).filter(|&node| counts(node)) {
        of_root.entry(sets.root(node)).or_default().push(node);
    }
    let mut of_class: BTreeMap<ClassId, Vec<Vec<u32>>> = BTreeMap::new();
    for part in of_root.into_values() {
        of_class.entry(labels[part[0] as usize]).or_default().push(part);
    }
    for parts in of_class.values_mut() {
        parts.sort_by_key(|part| (std::cmp::Reverse(part.len()), part[0]));
    }
    of_class
}

/// The place of the first of a class's components that is smaller than this share of the largest.
pub(super) fn smaller_from(components: &[Vec<u32>], share: f32) -> usize {
    let fewest = share * components.first().map_or(0, Vec::len) as f32;
    components.partition_point(|part| part.len() as f32 >= fewest)
}

/// Gives each fragment to the part with the node that is nearest to its middle.
fn join_fragments(nodes: &[Node], parts: &mut [Vec<u32>], fragments: Vec<Vec<u32>>) {
    let position = |&node: &u32| nodes[node as usize].position;
    let part_of: FxHashMap<u32, usize> = (0..)
        .zip(parts.iter())
        .flat_map(|(number, part)| part.iter().map(move |&node| (node, number)))
        .collect();
    let whole: Vec<u32> = parts.concat();
    let (low, high) = nodes.iter().fold((Vec3::MAX, Vec3::MIN), |(low, high), node| {
        (low.min(node.position), high.max(node.position))
    });
    let side = nodes[whole[0] as usize].voxel * CELL;
    let cells = NodeCells::new(nodes, whole, side);
    for fragment in fragments {
        let sum: Vec3 = fragment.iter().map(position).sum();
        let nearest = cells.nearest(nodes, sum / fragment.len() as f32, low.distance(high));
        if let Some(&part) = nearest.and_then(|node| part_of.get(&node)) {
            parts[part].extend(fragment);
        }
    }
}
