//! From distances to class probabilities.

use rayon::prelude::*;

use super::{ENTROPY_STEPS_PER_NAT, Propagation};
use crate::labels::{ClassId, VOID};

/// A class's weight falls with this power of its distance.
const POWER: i32 = 3;
/// Distance that is added to all: inside it, classes are as likely as each other.
const SOFTNESS: f32 = 0.5;
/// A class at this distance weighs as much as not knowing anything.
const HORIZON: f32 = 400.0;
/// A class at this distance weighs as much as all votes on a node.
const VOTES_HORIZON: f32 = 5.0;

/// Class probabilities of every node, summarised.
#[derive(Clone, Debug, Default)]
pub struct Posterior {
    /// Most likely class of each node; void where there are no labels at all.
    pub labels: Vec<ClassId>,
    /// Entropy of each node, in nats times [`ENTROPY_STEPS_PER_NAT`].
    pub entropy: Vec<u16>,
    /// Second most likely class of each node; void where there is none.
    pub runners_up: Vec<ClassId>,
    /// Distances to the nearest and the second nearest class of each node; where there are votes, those at which
    /// labels alone would weigh as much.
    pub distances: Vec<[f32; 2]>,
}

impl Posterior {
    /// Combines the classes' distances with votes (probabilities) and with the head's say (positive weights), where
    /// there are any, each `[nodes, classes]` in the order of `classes`.
    ///
    /// p_c is proportional to (d_c + softness)^-power plus an equal share of not knowing, times the
    /// head's weight. On nodes that votes reach, what they say takes the place of not knowing, with a horizon that is
    /// nearer.
    pub fn new(
        propagation: &Propagation,
        classes: &[ClassId],
        nodes: usize,
        votes: Option<&[f32]>,
        head: Option<&[f32]>,
    ) -> Self {
        let fields: Vec<Option<&[f32]>> = classes
            .iter()
            .map(|class| propagation.classes().get(class).map(super::Geodesics::distances))
            .collect();
        let rows: Vec<(ClassId, u16, ClassId, [f32; 2])> = (0..nodes)
            .into_par_iter()
            .with_min_len(1024)
            .map_init(
                || vec![0.0; classes.len()],
                |weights, node| {
                    let nearest = fill_weights(&fields, node, votes, weights);
                    if let Some(head) = head {
                        let own = &head[node * classes.len()..(node + 1) * classes.len()];
                        weights.iter_mut().zip(own).for_each(|(w, p)| *w *= p);
                    }
                    summarise(classes, weights, nearest)
                },
            )
            .collect();
        let mut posterior = Self::default();
        for (label, entropy, runner_up, distances) in rows {
            posterior.labels.push(label);
            posterior.entropy.push(entropy);
            posterior.runners_up.push(runner_up);
            posterior.distances.push(distances);
        }
        posterior
    }

    /// The graph's class probabilities of one node, in the order of `classes`.
    pub fn of_node(
        propagation: &Propagation,
        classes: &[ClassId],
        node: usize,
        votes: Option<&[f32]>,
    ) -> Vec<f32> {
        let fields: Vec<Option<&[f32]>> = classes
            .iter()
            .map(|class| propagation.classes().get(class).map(super::Geodesics::distances))
            .collect();
        let mut weights = vec![0.0; classes.len()];
        fill_weights(&fields, node, votes, &mut weights);
        let sum: f32 = weights.iter().sum();
        weights.iter_mut().for_each(|w| *w /= sum.max(f32::MIN_POSITIVE));
        weights
    }
}

/// Unnormalised weights of the classes at a node; returns the two smallest distances.
fn fill_weights(
    fields: &[Option<&[f32]>],
    node: usize,
    votes: Option<&[f32]>,
    weights: &mut [f32],
) -> [f32; 2] {
    let count = weights.len();
    let votes = votes.map(|votes| &votes[node * count..(node + 1) * count]);
    let votes = votes.filter(|row| row.iter().any(|&share| share > 0.0));
    let unknown = (HORIZON + SOFTNESS).powi(-POWER) / count.max(1) as f32;
    let voted = (VOTES_HORIZON + SOFTNESS).powi(-POWER);
    let mut nearest = [f32::INFINITY; 2];
    for (class, (weight, field)) in weights.iter_mut().zip(fields).enumerate() {
        let mut distance = field.map_or(f32::INFINITY, |field| field[node]);
        let near = (distance + SOFTNESS).powi(-POWER);
        if let Some(votes) = votes {
            *weight = near + voted * votes[class];
            distance = (weight.powf(-1.0 / POWER as f32) - SOFTNESS).max(0.0);
        } else {
            *weight = near + unknown;
        }
        if distance < nearest[0] {
            nearest = [distance, nearest[0]];
        } else if distance < nearest[1] {
            nearest[1] = distance;
        }
    }
    nearest
}

fn summarise(classes: &[ClassId], weights: &[f32], nearest: [f32; 2]) -> (ClassId, u16, ClassId, [f32; 2]) {
    let sum: f32 = weights.iter().sum();
    if sum <= 0.0 {
        return (VOID, 0, VOID, nearest);
    }
    let mut best = [(0.0, VOID); 2];
    let mut entropy = 0.0;
    for (&class, &weight) in classes.iter().zip(weights) {
        let p = weight / sum;
        if p > 0.0 {
            entropy -= p * p.ln();
        }
        if p > best[0].0 {
            best = [(p, class), best[0]];
        } else if p > best[1].0 {
            best[1] = (p, class);
        }
    }
    if nearest[0].is_infinite() {
        best = [(0.0, VOID); 2];
    }
    // A cast saturates: 6.5 nats are the entropy of 700 classes.
    let entropy = (entropy * ENTROPY_STEPS_PER_NAT).round() as u16;
    (best[0].1, entropy, best[1].1, nearest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_distances_give_the_highest_entropy() {
        let even = summarise(&[1, 2], &[1.0, 1.0], [1.0, 1.0]);
        let sure = summarise(&[1, 2], &[1.0, 0.01], [1.0, 9.0]);
        assert_eq!(even.1, (2.0_f32.ln() * ENTROPY_STEPS_PER_NAT).round() as u16);
        assert!(sure.1 < even.1 / 4);
        assert_eq!((sure.0, sure.2), (1, 2));
    }

    #[test]
    fn without_labels_everything_is_void_and_unknown() {
        let posterior = Posterior::new(&Propagation::default(), &[1, 2, 3], 5, None, None);
        assert_eq!(posterior.labels, [VOID; 5]);
        assert!(
            posterior
                .entropy
                .iter()
                .all(|&e| e == (3.0_f32.ln() * ENTROPY_STEPS_PER_NAT).round() as u16)
        );
    }
}
