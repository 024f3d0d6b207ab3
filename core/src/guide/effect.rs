//! What a label at a place would change.

use crate::semantics::{DistanceQueue, SurfaceGraph};

/// Most nodes that are followed from one place.
const MOST_FOLLOWED: usize = 20_000;
/// The region that a label settles is what is nearer to it than this share of the way to the nearest label.
const SETTLED: f32 = 0.5;

/// A place with what a label there would change.
pub(super) struct Effect {
    /// The place.
    pub(super) node: u32,
    /// How much would change.
    pub(super) size: f32,
    /// The nodes that would be settled.
    pub(super) settled: Vec<u32>,
    /// Nodes that were looked at.
    pub(super) visits: usize,
}

/// Distances from one place at a time.
pub(super) struct EffectSearch<'a> {
    graph: &'a SurfaceGraph,
    /// Infinite but for the nodes reached from the place of now.
    distance: Vec<f32>,
}

impl<'a> EffectSearch<'a> {
    pub(super) fn new(graph: &'a SurfaceGraph) -> Self {
        Self {
            graph,
            distance: vec![f32::INFINITY; graph.len()],
        }
    }

    /// The effect of a label at `place`: the sum of v (1 - d / d1) over the nodes that are nearer to it (d)
    /// than to every label (d1, `to_label`), v being the `value` of a node.
    pub(super) fn effect(
        &mut self,
        place: u32,
        to_label: impl Fn(u32) -> f32,
        value: impl Fn(u32) -> f32,
    ) -> Effect {
        let mut effect = Effect {
            node: place,
            size: 0.0,
            settled: Vec::new(),
            visits: 0,
        };
        let mut reached = vec![place];
        let mut queue = DistanceQueue::new();
        self.distance[place as usize] = 0.0;
        queue.push(0.0, place);
        while let Some((distance, node)) = queue.pop() {
            if distance > self.distance[node as usize] {
                continue;
            }
            let share = distance / to_label(node).max(f32::MIN_POSITIVE);
            effect.size += value(node) * (1.0 - share).max(0.0);
            if share <= SETTLED {
                effect.settled.push(node);
            }
            effect.visits += 1;
            if effect.visits == MOST_FOLLOWED {
                break;
            }
            for (neighbour, cost) in self.graph.edges(node) {
                let through = distance + cost;
                let known = &mut self.distance[neighbour as usize];
                if through < to_label(neighbour) && through < *known {
                    if known.is_infinite() {
                        reached.push(neighbour);
                    }
                    *known = through;
                    queue.push(through, neighbour);
                }
            }
        }
        for node in reached {
            self.distance[node as usize] = f32::INFINITY;
        }
        effect
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::semantics::Node;

    /// Nodes in a row, a step apart but for the last, which is far.
    fn row() -> SurfaceGraph {
        let node = Node {
            position: Vec3::ZERO,
            color: Vec3::ZERO,
            normal: Vec3::Z,
            pixels: 1.0,
            voxel: 1.0,
        };
        let edges = [(0, 1, 1.0), (1, 2, 1.0), (2, 3, 1.0), (3, 4, 100.0)];
        SurfaceGraph::from_edges(vec![node; 5], &edges)
    }

    #[test]
    fn a_label_settles_what_is_much_nearer_to_it_than_to_others() {
        let graph = row();
        // A label beyond the first node.
        let to_label = |node: u32| if node == 4 { 1000.0 } else { 0.5 + node as f32 };
        let mut reach = EffectSearch::new(&graph);
        for _ in 0..2 {
            let effect = reach.effect(3, to_label, |node| if node == 4 { 10.0 } else { 1.0 });
            assert_eq!(effect.settled, [3, 2, 4]);
            assert_eq!(effect.visits, 3);
            let expected = 1.0 + (1.0 - 1.0 / 2.5) + 10.0 * (1.0 - 100.0 / 1000.0);
            assert!((effect.size - expected).abs() < 1e-5, "{}", effect.size);
        }
    }

    #[test]
    fn without_labels_a_label_changes_everything() {
        let graph = row();
        let effect = EffectSearch::new(&graph).effect(1, |_| f32::INFINITY, |_| 1.0);
        assert_eq!((effect.size, effect.settled.len()), (5.0, 5));
    }
}
