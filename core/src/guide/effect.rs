//! The effect of a label at a place.

use crate::semantics::{DistanceQueue, SurfaceGraph};

/// Most nodes that are visited from one place.
const MOST_FOLLOWED: usize = 20_000;
/// A label settles the nodes whose distance to it is at most this share of that to the nearest other label.
const SETTLED: f32 = 0.5;

/// The effect of a label at a node.
pub(super) struct Effect {
    /// The node.
    pub(super) node: u32,
    /// How much would change.
    pub(super) size: f32,
    /// The nodes that would be settled.
    pub(super) settled: Vec<u32>,
    /// Number of nodes that were visited.
    pub(super) visits: usize,
}

/// Computes effects by distances from one place at a time.
pub(super) struct EffectSearch<'a> {
    graph: &'a SurfaceGraph,
    /// Infinite except at the nodes reached from the present place.
    distance: Vec<f32>,
}

impl<'a> EffectSearch<'a> {
    pub(super) fn new(graph: &'a SurfaceGraph) -> Self {
        Self {
            graph,
            distance: vec![f32::INFINITY; graph.len()],
        }
    }

    /// The effect of a label at `place`: the sum of v (1 - d / d1) over the nodes that are nearer to it (d) than to
    /// every label (d1, `to_label`), where v is the `value` of a node.
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
    use super::*;
    use crate::semantics::testing::joined;

    /// Nodes in a row, a step apart but for the last, which is far.
    fn row() -> SurfaceGraph {
        joined(5, &[(0, 1, 1.0), (1, 2, 1.0), (2, 3, 1.0), (3, 4, 100.0)])
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
