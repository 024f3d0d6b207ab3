//! Shortest paths from the labelled nodes, one distance field per class, kept exact under changes. Of several objects of
//! a class a node belongs to that of the nearest labelled node, so that objects cost neither time nor memory and change
//! nothing of the classes.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::SurfaceGraph;
use super::queue::DistanceQueue;
use crate::labels::{ClassId, Label, ObjectId};

/// No seed reaches the node.
const NO_SEED: u32 = u32::MAX;

/// Distance of every node to the nearest of a set of seeds, along the graph's edges.
#[derive(Clone, Debug, PartialEq)]
pub struct Geodesics {
    distance: Vec<f32>,
    /// The seed that each node's shortest path starts from.
    seed: Vec<u32>,
}

impl Geodesics {
    /// No seeds yet: every distance is infinite.
    pub fn new(nodes: usize) -> Self {
        Self {
            distance: vec![f32::INFINITY; nodes],
            seed: vec![NO_SEED; nodes],
        }
    }

    /// Distance of each node to its nearest seed; infinite where there is none.
    pub fn distances(&self) -> &[f32] {
        &self.distance
    }

    /// Adds seeds and visits only the nodes that are nearest to them (Dijkstra). Returns those nodes, some more than
    /// once.
    pub fn add(&mut self, graph: &SurfaceGraph, seeds: &[u32]) -> Vec<u32> {
        let mut queue = DistanceQueue::new();
        for &seed in seeds {
            self.distance[seed as usize] = 0.0;
            self.seed[seed as usize] = seed;
            queue.push(0.0, seed);
        }
        let mut changed = seeds.to_vec();
        self.relax(graph, queue, &mut changed);
        changed
    }

    /// Removes seeds and visits only the nodes that were nearest to them, from the border of the others. Returns those
    /// nodes, some more than once.
    pub fn remove(&mut self, graph: &SurfaceGraph, seeds: &[u32]) -> Vec<u32> {
        let mut gone = vec![false; self.distance.len()];
        for &seed in seeds {
            gone[seed as usize] = true;
        }
        let orphans: Vec<u32> = (0..self.seed.len() as u32)
            .filter(|&node| {
                let owner = self.seed[node as usize];
                owner != NO_SEED && gone[owner as usize]
            })
            .collect();
        for &orphan in &orphans {
            self.distance[orphan as usize] = f32::INFINITY;
            self.seed[orphan as usize] = NO_SEED;
        }
        let mut queue = DistanceQueue::new();
        for &orphan in &orphans {
            for (neighbour, _) in graph.edges(orphan) {
                let distance = self.distance[neighbour as usize];
                if distance.is_finite() {
                    queue.push(distance, neighbour);
                }
            }
        }
        let mut changed = orphans;
        self.relax(graph, queue, &mut changed);
        changed
    }

    /// Continues from the nodes in the queue; adds the nodes that come nearer to `changed`.
    fn relax(&mut self, graph: &SurfaceGraph, mut queue: DistanceQueue, changed: &mut Vec<u32>) {
        while let Some((distance, node)) = queue.pop(graph) {
            if distance > self.distance[node as usize] {
                continue;
            }
            let seed = self.seed[node as usize];
            for (neighbour, cost) in graph.edges(node) {
                let through = distance + cost;
                if through < self.distance[neighbour as usize] {
                    self.distance[neighbour as usize] = through;
                    self.seed[neighbour as usize] = seed;
                    queue.push(through, neighbour);
                    changed.push(neighbour);
                }
            }
        }
    }
}

/// The distance fields of all classes that have labelled nodes. Copies share the fields until one of them changes.
#[derive(Clone, Debug, Default)]
pub struct ClassGeodesics {
    classes: BTreeMap<ClassId, Arc<Geodesics>>,
    seeds: FxHashMap<u32, Label>,
}

impl ClassGeodesics {
    /// The label of each labelled node.
    pub fn seeds(&self) -> &FxHashMap<u32, Label> {
        &self.seeds
    }

    /// The distance field of each class that has labelled nodes.
    pub fn classes(&self) -> &BTreeMap<ClassId, Arc<Geodesics>> {
        &self.classes
    }

    /// The distances to each of these classes; `None` for one without labelled nodes.
    pub(super) fn fields(&self, classes: &[ClassId]) -> Vec<Option<&[f32]>> {
        let field = |class| self.classes.get(class).map(|field| field.distances());
        classes.iter().map(field).collect()
    }

    /// The object of a node, if it is of this class: that of the class's nearest labelled node, where that says one.
    pub fn object(&self, class: ClassId, node: u32) -> Option<ObjectId> {
        let nearest = *self.classes.get(&class)?.seed.get(node as usize)?;
        self.seeds.get(&nearest)?.object
    }

    /// Replaces the labelled nodes by `seeds`; only what changed is computed. Returns the nodes whose distance to any
    /// class, or whose nearest label of it, may have changed, ascending.
    pub fn update(&mut self, graph: &SurfaceGraph, seeds: FxHashMap<u32, Label>) -> Vec<u32> {
        // The nodes that each class loses, and those that it gets.
        let mut changes: BTreeMap<ClassId, [Vec<u32>; 2]> = BTreeMap::new();
        for (kind, own, others) in [(0, &self.seeds, &seeds), (1, &seeds, &self.seeds)] {
            for (&node, label) in own {
                if others.get(&node) != Some(label) {
                    changes.entry(label.class).or_default()[kind].push(node);
                }
            }
        }
        for class in changes.keys() {
            self.classes
                .entry(*class)
                .or_insert_with(|| Arc::new(Geodesics::new(graph.len())));
        }
        let of_class = |(class, field): (&ClassId, &mut Arc<Geodesics>)| -> Vec<u32> {
            let Some([removed, added]) = changes.get(class) else {
                return Vec::new();
            };
            let field = Arc::make_mut(field);
            let mut changed = if removed.is_empty() {
                Vec::new()
            } else {
                field.remove(graph, removed)
            };
            changed.extend(field.add(graph, added));
            changed
        };
        let changed: Vec<Vec<u32>> = self.classes.par_iter_mut().map(of_class).collect();
        let mut is_changed = vec![false; graph.len()];
        for node in changed.into_iter().flatten() {
            is_changed[node as usize] = true;
        }
        self.seeds = seeds;
        let present: BTreeSet<ClassId> = self.seeds.values().map(|label| label.class).collect();
        self.classes.retain(|class, _| present.contains(class));
        (0..graph.len() as u32)
            .filter(|&node| is_changed[node as usize])
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::semantics::testing::joined;
    use rand::{Rng, SeedableRng, rngs::SmallRng};

    fn random_graph(rng: &mut SmallRng, nodes: u32) -> SurfaceGraph {
        let mut edges = Vec::new();
        for a in 0..nodes {
            for _ in 0..3 {
                let b = rng.random_range(0..nodes);
                if a != b {
                    edges.push((a, b, rng.random_range(0.01..5.0)));
                }
            }
        }
        joined(nodes as usize, &edges)
    }

    /// Repeats relaxing every edge until nothing changes (Bellman-Ford).
    fn brute_force(graph: &SurfaceGraph, seeds: &[u32]) -> Vec<f32> {
        let mut distance = vec![f32::INFINITY; graph.len()];
        for &seed in seeds {
            distance[seed as usize] = 0.0;
        }
        loop {
            let before = distance.clone();
            for node in 0..graph.len() as u32 {
                for (neighbour, cost) in graph.edges(node) {
                    let through = distance[node as usize] + cost;
                    distance[neighbour as usize] = through.min(distance[neighbour as usize]);
                }
            }
            if distance == before {
                return distance;
            }
        }
    }

    #[test]
    fn distances_under_changes_equal_a_brute_force_search() {
        let mut rng = SmallRng::seed_from_u64(12);
        let graph = random_graph(&mut rng, 120);
        let mut geodesics = ClassGeodesics::default();
        let mut seeds: FxHashMap<u32, Label> = FxHashMap::default();
        for _ in 0..200 {
            let node = rng.random_range(0..120);
            if rng.random_bool(0.4) {
                seeds.remove(&node);
            } else {
                let object = ObjectId::new(rng.random_range(0..3));
                let class = rng.random_range(1..4);
                seeds.insert(node, Label { class, object });
            }
            let before = geodesics.clone();
            let changed = geodesics.update(&graph, seeds.clone());
            for class in 1..4 {
                let own = seeds.iter().filter(|seed| seed.1.class == class);
                let own: Vec<u32> = own.map(|(&node, _)| node).collect();
                let field = geodesics.classes().get(&class).map(|field| field.distances());
                assert_eq!(field.is_some(), !own.is_empty());
                let Some(field) = field else { continue };
                assert_eq!(field, brute_force(&graph, &own));
                let by_object: Vec<(Option<ObjectId>, Vec<f32>)> = [None, ObjectId::new(1), ObjectId::new(2)]
                    .map(|object| {
                        let seeds = own.iter().filter(|seed| seeds[*seed].object == object);
                        (object, brute_force(&graph, &seeds.copied().collect::<Vec<_>>()))
                    })
                    .into();
                let earlier = before.classes().get(&class).map(|field| field.distances());
                for (node, &distance) in field.iter().enumerate() {
                    let object = geodesics.object(class, node as u32);
                    let (_, to_object) = by_object.iter().find(|(other, _)| *other == object).unwrap();
                    assert_eq!(distance, to_object[node], "objects have what is nearest to them");
                    let same = distance == earlier.map_or(f32::INFINITY, |earlier| earlier[node])
                        && object == before.object(class, node as u32);
                    assert!(same || changed.binary_search(&(node as u32)).is_ok());
                }
            }
        }
    }
}
