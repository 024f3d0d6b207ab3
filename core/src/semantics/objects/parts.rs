//! The parts of a surface that nothing joins, class by class.

use std::collections::BTreeMap;

use glam::Vec3;
use rustc_hash::FxHashMap;

use crate::labels::{Class, ClassId, ObjectId};
use crate::semantics::{DisjointSets, Node, NodeCells, Posterior, Surface};

/// Longest edge that joins a part, in voxels.
const JOINED: f32 = 2.5;
/// A part of a class with fewer voxels than this share of the class's largest object is a fragment of the one next to it:
/// one with a label, and one that only looks like what is labelled.
const LABELLED_FRAGMENT: f32 = 0.1;
const FRAGMENT: f32 = 0.25;
/// Side of the cells in which the part next to a fragment is looked for, in voxels.
const CELL: f32 = 16.0;

/// A connected part of a class.
pub(super) struct Part {
    pub(super) class: ClassId,
    pub(super) is_labelled: bool,
    pub(super) nodes: Vec<u32>,
}

/// The parts of all classes that are `things` on the nodes without an object, by class, those with labels before the others,
/// and then the largest first. What is much smaller than the largest object or part of its class is joined to the nearest.
pub(super) fn parts(
    surface: &Surface,
    posterior: &Posterior,
    things: &BTreeMap<ClassId, &Class>,
    of_nodes: &mut [Option<ObjectId>],
) -> Vec<Part> {
    let class_of = |node: u32| posterior.labels[node as usize];
    let mut told: BTreeMap<ClassId, BTreeMap<ObjectId, Vec<u32>>> = BTreeMap::new();
    for (node, object) in (0..).zip(&*of_nodes) {
        if let Some(object) = object {
            let own = told.entry(class_of(node)).or_default();
            own.entry(*object).or_default().push(node);
        }
    }
    let is_free = |node: u32| of_nodes[node as usize].is_none() && things.contains_key(&class_of(node));
    let free = components(surface, &posterior.labels, &is_free);
    let mut all = Vec::new();
    let is_labelled = |part: &Vec<u32>| {
        let mut nodes = part.iter();
        nodes.any(|&node| posterior.distances.get(node as usize) == Some(&0.0))
    };
    for (class, parts) in free {
        let told = told.remove(&class).unwrap_or_default();
        let sizes = parts.iter().chain(told.values()).map(Vec::len);
        let largest = sizes.max().unwrap_or(0) as f32;
        let (mut parts, mut others): (Vec<_>, Vec<_>) = parts.into_iter().partition(is_labelled);
        let mut fragments = parts.split_off(smaller_from(&parts, LABELLED_FRAGMENT * largest));
        fragments.extend(others.split_off(smaller_from(&others, FRAGMENT * largest)));
        let labelled = parts.len();
        parts.extend(others);
        if !fragments.is_empty() {
            let count = parts.len();
            let (objects, nodes): (Vec<ObjectId>, Vec<Vec<u32>>) = told.into_iter().unzip();
            parts.extend(nodes);
            join_fragments(surface.graph.nodes(), &mut parts, fragments);
            for (object, nodes) in objects.into_iter().zip(parts.split_off(count)) {
                nodes
                    .into_iter()
                    .for_each(|node| of_nodes[node as usize] = Some(object));
            }
        }
        all.extend(parts.into_iter().enumerate().map(|(place, nodes)| Part {
            class,
            is_labelled: place < labelled,
            nodes,
        }));
    }
    all
}

/// The connected nodes with each label among those that count, the largest component first.
pub(in crate::semantics) fn components<T: Copy + Ord>(
    surface: &Surface,
    labels: &[T],
    counts: &dyn Fn(u32) -> bool,
) -> BTreeMap<T, Vec<Vec<u32>>> {
    let graph = &surface.graph;
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
    let mut of_label: BTreeMap<T, Vec<Vec<u32>>> = BTreeMap::new();
    for part in of_root.into_values() {
        of_label.entry(labels[part[0] as usize]).or_default().push(part);
    }
    for parts in of_label.values_mut() {
        parts.sort_by_key(|part| (std::cmp::Reverse(part.len()), part[0]));
    }
    of_label
}

/// The place of the first of a class's components, the largest of which comes first, that has fewer nodes.
pub(super) fn smaller_from(components: &[Vec<u32>], fewest: f32) -> usize {
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
