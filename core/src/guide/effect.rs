//! What a label at a place is worth.

use super::candidates::LEAST_DOUBT;
use crate::labels::VOID;
use crate::semantics::{DistanceQueue, Evidence, Posterior, SurfaceGraph, Weights, stretched, weight_at};

/// Most nodes that are visited from one place.
const MOST_FOLLOWED: usize = 20_000;
/// A label settles the nodes whose distance to it is at most this share of that to the nearest other label.
const SETTLED: f32 = 0.5;
/// Classes less likely than this at a place are not considered one by one.
const LIKELY: f32 = 0.02;

/// The effect of a label at a node.
pub(super) struct Effect {
    /// The node.
    pub(super) node: u32,
    /// The pixels, weighted by their classes, that are expected to become right.
    pub(super) value: f32,
    /// The nodes that would be settled.
    pub(super) settled: Vec<u32>,
    /// Number of nodes that were visited.
    pub(super) visits: usize,
}

/// What is known before the label.
#[derive(Clone, Copy)]
pub(super) struct Context<'a> {
    pub(super) graph: &'a SurfaceGraph,
    pub(super) evidence: Evidence<'a>,
    pub(super) posterior: &'a Posterior,
    /// The weight of a pixel of each class, in the order of the classes.
    pub(super) class_weights: &'a [f32],
}

/// A class that a place may have.
struct Outcome {
    /// Its index; `None` for one that is not among the likely.
    class: Option<usize>,
    probability: f32,
    /// The pixels, weighted by their classes, that would become right.
    gain: f32,
}

/// Computes effects from one place at a time.
pub(super) struct EffectSearch<'a> {
    known: Context<'a>,
    weights: Weights<'a>,
    /// Infinite except at the nodes reached from the present place; 0 at those that have been visited.
    distance: Vec<f32>,
    /// The weights of the classes at a node.
    row: Vec<f32>,
}

impl<'a> EffectSearch<'a> {
    pub(super) fn new(known: Context<'a>) -> Self {
        Self {
            weights: Weights::new(known.evidence),
            distance: vec![f32::INFINITY; known.graph.len()],
            row: vec![0.0; known.evidence.classes.len()],
            known,
        }
    }

    /// The effect of a label at `place`, found by shortest paths as those of a click are: over the nodes y that are nearer
    /// to it than to every label, the sum of
    ///
    /// ```text
    /// sum over classes c: p_c(place) a k max(p'_c(y) - p'_l(y), 0)
    /// ```
    ///
    /// where p are the probabilities now and p' those with a label of c at the place, l is the class of y now, a the
    /// number of pixels that show y, and k the mean weight of the pixels of c and l. Only nodes that are `open` count.
    pub(super) fn effect(&mut self, place: u32, open: impl Fn(u32) -> bool) -> Effect {
        let Context {
            graph,
            evidence,
            posterior,
            ..
        } = self.known;
        let mut outcomes = self.outcomes(place);
        let likeliest = posterior.labels[place as usize];
        let look = evidence
            .likeness
            .map(|likeness| (likeness.look(), likeness.kind(likeliest)));
        let to_label = |node: u32| posterior.distances[node as usize];
        let mut effect = Effect {
            node: place,
            value: 0.0,
            settled: Vec::new(),
            visits: 0,
        };
        let mut reached = vec![place];
        let mut queue = DistanceQueue::new();
        self.distance[place as usize] = 0.0;
        queue.push(0.0, place);
        while let Some((distance, node)) = queue.pop(graph) {
            if distance > self.distance[node as usize] {
                continue;
            }
            let counting = match look {
                Some((look, kind)) => stretched(distance, look.stretch(node, place, kind)),
                None => distance,
            };
            // Where a label counts as nearer, one here leaves the class as it is.
            if counting < to_label(node) && open(node) {
                self.add_gains(node, counting, &mut outcomes);
                if counting <= SETTLED * to_label(node) {
                    effect.settled.push(node);
                }
            }
            effect.visits += 1;
            if effect.visits == MOST_FOLLOWED {
                break;
            }
            // Nothing comes nearer than 0, so that it counts once.
            self.distance[node as usize] = 0.0;
            for (neighbour, cost) in graph.edges(node) {
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
        effect.value = outcomes
            .iter()
            .map(|outcome| outcome.probability * outcome.gain)
            .sum();
        effect
    }

    /// The likely classes of a place, and the chance that it is none of them.
    fn outcomes(&mut self, place: u32) -> Vec<Outcome> {
        self.weights.fill(place as usize, &mut self.row);
        let sum: f32 = self.row.iter().sum();
        let of_class = |(class, weight): (usize, &f32)| Outcome {
            class: Some(class),
            probability: weight / sum,
            gain: 0.0,
        };
        let all = self.row.iter().enumerate().map(of_class);
        let mut outcomes: Vec<Outcome> = all.filter(|outcome| outcome.probability > LIKELY).collect();
        let likely: f32 = outcomes.iter().map(|outcome| outcome.probability).sum();
        outcomes.push(Outcome {
            class: None,
            probability: (1.0 - likely).max(LEAST_DOUBT),
            gain: 0.0,
        });
        outcomes
    }

    /// Adds what each outcome gains at a node at this distance from the place.
    fn add_gains(&mut self, node: u32, distance: f32, outcomes: &mut [Outcome]) {
        let Context {
            graph,
            evidence,
            posterior,
            class_weights,
            ..
        } = self.known;
        let now = posterior.labels[node as usize];
        let now = evidence
            .classes
            .iter()
            .position(|&class| class == now && class != VOID);
        self.weights.fill(node as usize, &mut self.row);
        let sum: f32 = self.row.iter().sum();
        let near = weight_at(distance);
        let pixels = graph.nodes()[node as usize].pixels;
        let of_now = now.map_or(0.0, |now| self.row[now]);
        for outcome in outcomes
            .iter_mut()
            .filter(|outcome| outcome.class != now || now.is_none())
        {
            let before = outcome.class.map_or(0.0, |class| self.row[class]);
            let prior = outcome
                .class
                .map_or(1.0, |class| self.weights.prior(node as usize, class));
            let after = before.max(prior * near);
            let gain = (after - of_now).max(0.0) / (sum - before + after);
            let both = [outcome.class.or(now), now.or(outcome.class)];
            let weight: f32 = both
                .iter()
                .map(|class| class.map_or(1.0, |class| class_weights[class]))
                .sum();
            outcome.gain += 0.5 * weight * pixels * gain;
        }
    }
}

#[cfg(test)]
mod tests {
    use rustc_hash::FxHashMap;

    use super::*;
    use crate::labels::ClassId;
    use crate::semantics::ClassGeodesics;
    use crate::semantics::testing::{by_distance, joined};

    /// The effect of a label at a node of a row of five, which are a step apart but for the last, which is far, with
    /// classes 1 and 2 and these labels.
    fn effect(labels: &[(u32, ClassId)], place: u32) -> Effect {
        effect_on(0b11111, labels, place)
    }

    /// The same on the nodes whose bits are set.
    fn effect_on(open: u32, labels: &[(u32, ClassId)], place: u32) -> Effect {
        let graph = joined(5, &[(0, 1, 1.0), (1, 2, 1.0), (2, 3, 1.0), (3, 4, 100.0)]);
        let mut geodesics = ClassGeodesics::default();
        geodesics.update(
            &graph,
            labels
                .iter()
                .map(|&(node, class)| (node, class.into()))
                .collect::<FxHashMap<_, _>>(),
        );
        let evidence = by_distance(&[1, 2], &geodesics);
        let known = Context {
            posterior: &Posterior::new(&evidence, graph.len()),
            class_weights: &[1.0, 1.0],
            graph: &graph,
            evidence,
        };
        let mut search = EffectSearch::new(known);
        search.effect(place, |_| true);
        search.effect(place, |node| open & 1 << node != 0)
    }

    #[test]
    fn a_label_settles_what_is_much_nearer_to_it_than_to_others() {
        let found = effect(&[(0, 1)], 3);
        assert_eq!(found.settled, [3, 2]);
        assert_eq!(found.visits, 3, "the last is nearer to it, too");
        assert_eq!(effect(&[], 1).settled.len(), 5, "without labels all");
    }

    #[test]
    fn what_is_settled_otherwise_does_not_count() {
        let whole = effect(&[(0, 1)], 3);
        let rest = effect_on(0b01111, &[(0, 1)], 3);
        assert!(0.0 < rest.value && rest.value < whole.value);
        let none = effect_on(0, &[(0, 1)], 3);
        assert_eq!(
            (none.value, none.settled.len(), none.visits),
            (0.0, 0, whole.visits)
        );
    }

    #[test]
    fn a_label_is_worth_most_where_two_classes_are_as_likely() {
        let even = effect(&[(1, 1), (3, 2)], 2).value;
        assert!((0.3..0.5).contains(&even), "half of one pixel: {even}");
        let clear = effect(&[(0, 1), (4, 2)], 1).value;
        assert!((0.0..1e-3).contains(&clear) && clear > 0.0, "{clear}");
    }
}
