//! From distances to class probabilities.

use rayon::prelude::*;

use super::{ClassGeodesics, Likeness, ObjectVotes};
use crate::labels::{ClassId, ObjectId, Trust, VOID};

/// Steps of a stored entropy, per nat.
pub const ENTROPY_STEPS_PER_NAT: f32 = 10_000.0;
/// A stored probability of 1.
pub const CERTAIN: u16 = u16::MAX;
/// A class's weight falls with this power of its distance.
const POWER: i32 = 3;
/// Distance that is added to all: much nearer than this, classes are equally likely.
const SOFTNESS: f32 = 0.5;
/// A class at this distance weighs as much as the uniform share of not knowing anything.
const HORIZON: f32 = 400.0;
/// A class at this distance weighs as much as all votes on a node that have a trust of one half.
const VOTES_HORIZON: f32 = 5.0;

/// Weight of votes with this trust, relative to votes with a trust of one half. A class weighs as much as they do at
/// the distance [`VOTES_HORIZON`] (1 - trust) / trust: 0 where every vote is right, and [`HORIZON`] at most.
pub(super) fn votes_weight(trust: Trust) -> f32 {
    let distrust = (1.0 - trust.value()) / trust.value();
    let horizon = (VOTES_HORIZON * distrust).min(HORIZON);
    ((VOTES_HORIZON + SOFTNESS) / (horizon + SOFTNESS)).powi(POWER)
}

/// Class probabilities of every node, summarised.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Posterior {
    /// Most likely class of each node; void where there are no labels at all.
    pub labels: Vec<ClassId>,
    /// Entropy of each node, in nats times [`ENTROPY_STEPS_PER_NAT`].
    pub entropy: Vec<u16>,
    /// Probability of the most likely class of each node, times [`CERTAIN`]; 0 where that is void.
    pub confidence: Vec<u16>,
    /// Second most likely class of each node; void where there is none.
    pub runners_up: Vec<ClassId>,
    /// Distance to the nearest class of each node, stretched where it looks different; where there are votes, the distance
    /// at which labels alone would weigh as much.
    pub distances: Vec<f32>,
    /// The object that labels or votes say of each node's class; empty where none say any.
    pub objects: Vec<Option<ObjectId>>,
    /// The nodes whose own labels say an object, or whose own votes one of the class that they have, ascending.
    pub telling: Vec<u32>,
}

impl Posterior {
    /// The classes of this number of nodes by what is known of them.
    pub fn new(evidence: &Evidence<'_>, nodes: usize) -> Self {
        let mut posterior = Self {
            labels: vec![VOID; nodes],
            entropy: vec![0; nodes],
            confidence: vec![0; nodes],
            runners_up: vec![VOID; nodes],
            distances: vec![f32::INFINITY; nodes],
            ..Self::default()
        };
        let all: Vec<u32> = (0..nodes as u32).collect();
        posterior.update(evidence, &all);
        posterior
    }

    /// What is known of a node; `None` where there is no such node.
    pub(super) fn summary(&self, node: u32) -> Option<NodeSummary> {
        let node = node as usize;
        Some(NodeSummary {
            label: *self.labels.get(node)?,
            entropy: *self.entropy.get(node)?,
            confidence: *self.confidence.get(node)?,
            runner_up: *self.runners_up.get(node)?,
            ..NodeSummary::default()
        })
    }

    /// Computes these nodes anew, as [`Posterior::new`] does, after what is known of them has changed.
    pub fn update(&mut self, evidence: &Evidence<'_>, nodes: &[u32]) {
        let weights = Weights::new(*evidence);
        let rows: Vec<NodeSummary> = nodes
            .par_iter()
            .with_min_len(1024)
            .map_init(
                || vec![0.0; evidence.classes.len()],
                |row, &node| {
                    let nearest = weights.fill(node as usize, row);
                    summarise(evidence.classes, row, nearest)
                },
            )
            .collect();
        for (&node, row) in nodes.iter().zip(rows) {
            let node = node as usize;
            self.labels[node] = row.label;
            self.entropy[node] = row.entropy;
            self.confidence[node] = row.confidence;
            self.runners_up[node] = row.runner_up;
            self.distances[node] = row.nearest;
        }
        let said = evidence.geodesics.seeds().iter();
        let said = said.filter(|(_, label)| label.object.is_some());
        self.telling = said.map(|(&node, _)| node).collect();
        self.telling.sort_unstable();
        if let Some(votes) = evidence.objects {
            self.telling.extend(votes.telling(&self.labels));
            // Two ascending lists are merged.
            self.telling.sort();
        }
        // By votes nodes have objects even where none of those that tell one is left.
        if self.telling.is_empty() && evidence.objects.is_none() {
            self.objects = Vec::new();
            return;
        }
        // All other nodes have the nearest label that they had, which said no object where none did.
        self.objects.resize(self.labels.len(), None);
        for &node in nodes {
            self.objects[node as usize] = weights.object(node, self.labels[node as usize]);
        }
    }
}

/// What is known of the classes at the nodes of a surface.
///
/// p_c is proportional to (((d_c + softness) s_c)^-power + u_c) w_c. Here d_c is the distance to the class, s_c the
/// stretch of that distance where the surface does not look like the class, w_c the weight by the semantic prior, and
/// u_c an equal share of not knowing, (horizon + softness)^-power. On nodes that votes reach, u_c is the vote for the
/// class instead, with a nearer horizon.
#[derive(Clone, Copy)]
pub struct Evidence<'a> {
    /// The classes, in the order of all weights.
    pub classes: &'a [ClassId],
    /// The distances to the labels of each class.
    pub geodesics: &'a ClassGeodesics,
    /// How like the labelled regions of each class each region is, where that counts.
    pub likeness: Option<&'a Likeness>,
    /// Another account of that: probabilities are then the mean by both.
    pub second_likeness: Option<&'a Likeness>,
    /// Votes, weighted probabilities `[nodes, classes]`.
    pub votes: Option<&'a [f32]>,
    /// The objects by votes.
    pub objects: Option<&'a ObjectVotes>,
    /// Weights by the semantic prior, positive, `[nodes, classes]`.
    pub prior: Option<&'a [f32]>,
}

impl Evidence<'_> {
    /// Class probabilities of one node, in the order of the classes.
    pub fn probabilities(&self, node: usize) -> Vec<f32> {
        let mut probabilities = vec![0.0; self.classes.len()];
        Weights::new(*self).fill(node, &mut probabilities);
        let sum: f32 = probabilities.iter().sum();
        let sum = sum.max(f32::MIN_POSITIVE);
        probabilities.iter_mut().for_each(|p| *p /= sum);
        probabilities
    }
}

/// Unnormalised weights of the classes by what is known of them.
pub(crate) struct Weights<'a> {
    evidence: Evidence<'a>,
    /// The distance field of each class; `None` where it has no labelled node.
    fields: Vec<Option<&'a [f32]>>,
}

impl<'a> Weights<'a> {
    pub(crate) fn new(evidence: Evidence<'a>) -> Self {
        Self {
            fields: evidence.geodesics.fields(evidence.classes),
            evidence,
        }
    }

    /// The weight of a class at a node by the semantic prior.
    pub(crate) fn prior(&self, node: usize, class: usize) -> f32 {
        let index = node * self.fields.len() + class;
        self.evidence.prior.map_or(1.0, |prior| prior[index])
    }

    /// The object of a node of this class: that of its nearest label, or by votes where that says none or weighs less than
    /// they do.
    pub(crate) fn object(&self, node: u32, class: ClassId) -> Option<ObjectId> {
        let Evidence {
            classes,
            geodesics,
            votes,
            objects,
            ..
        } = self.evidence;
        let said = geodesics.object(class, node);
        let Some(voted) = objects.and_then(|objects| objects.object(class, node)) else {
            return said;
        };
        let column = classes.iter().position(|other| *other == class)?;
        let near = self.fields[column].map_or(0.0, |field| weight_at(field[node as usize]));
        let shares = votes.map_or(0.0, |votes| votes[node as usize * classes.len() + column]);
        said.filter(|_| near > voted_weight(shares)).or(Some(voted))
    }

    /// Fills in the weights of the classes at a node; returns the smallest distance as it counts.
    pub(crate) fn fill(&self, node: usize, weights: &mut [f32]) -> f32 {
        let Evidence {
            likeness,
            second_likeness,
            votes,
            prior,
            ..
        } = self.evidence;
        let own = node * weights.len()..(node + 1) * weights.len();
        let stretches = likeness.map(|likeness| likeness.stretches(node));
        let votes = votes.map(|votes| &votes[own.clone()]);
        let nearest = fill_weights(&self.fields, node, stretches, votes, weights);
        if let Some(second) = second_likeness.map(|likeness| likeness.stretches(node)) {
            let mut others = vec![0.0; weights.len()];
            fill_weights(&self.fields, node, Some(second), votes, &mut others);
            let [own, other] = [&*weights, &others].map(|weights| weights.iter().sum::<f32>());
            let both = weights.iter_mut().zip(others);
            both.for_each(|(weight, others)| *weight = 0.5 * (*weight + others * own / other));
        }
        if let Some(prior) = prior {
            weights.iter_mut().zip(&prior[own]).for_each(|(w, p)| *w *= p);
        }
        nearest
    }
}

/// Most likely class of a node by the classes' distance fields, the stretches of their distances there, and all votes,
/// as by [`Posterior::new`] without a prior.
pub(super) fn label_at(
    fields: &[Option<&[f32]>],
    classes: &[ClassId],
    node: usize,
    stretches: Option<&[f32]>,
    votes: Option<&[f32]>,
) -> ClassId {
    let mut weights = vec![0.0; classes.len()];
    let votes = votes.map(|votes| &votes[node * classes.len()..(node + 1) * classes.len()]);
    let nearest = fill_weights(fields, node, stretches, votes, &mut weights);
    summarise(classes, &weights, nearest).label
}

/// The most likely class by these probabilities, and their entropy as a map has it.
pub(crate) fn most_likely(classes: &[ClassId], probabilities: &[f32]) -> (ClassId, u16) {
    let summary = NodeSummary::of(classes, probabilities);
    (summary.label, summary.entropy)
}

/// Unnormalised weights of the classes at a node by their distance fields and the stretches and votes there; returns the
/// smallest distance as it counts.
pub(super) fn fill_weights(
    fields: &[Option<&[f32]>],
    node: usize,
    stretches: Option<&[f32]>,
    votes: Option<&[f32]>,
    weights: &mut [f32],
) -> f32 {
    let votes = votes.filter(|row| row.iter().any(|&share| share > 0.0));
    let unknown = (HORIZON + SOFTNESS).powi(-POWER) / weights.len().max(1) as f32;
    let mut nearest = f32::INFINITY;
    for (class, (weight, field)) in weights.iter_mut().zip(fields).enumerate() {
        let mut distance = field.map_or(f32::INFINITY, |field| {
            stretched(field[node], stretches.map_or(1.0, |stretches| stretches[class]))
        });
        let near = weight_at(distance);
        if let Some(votes) = votes {
            *weight = near + voted_weight(votes[class]);
            distance = (weight.powf(-1.0 / POWER as f32) - SOFTNESS).max(0.0);
        } else {
            *weight = near + unknown;
        }
        nearest = nearest.min(distance);
    }
    nearest
}

/// The factor on the distances to a class by which a gap in looks makes it exp(-gap) times as likely.
pub(super) fn stretch(gap: f32) -> f32 {
    (gap / POWER as f32).exp()
}

/// The distance to a class as it counts where the surface is unlike the class.
pub(crate) fn stretched(distance: f32, stretch: f32) -> f32 {
    (distance + SOFTNESS) * stretch - SOFTNESS
}

/// The weight of a class by this share of the votes.
fn voted_weight(share: f32) -> f32 {
    share * weight_at(VOTES_HORIZON)
}

/// The weight of a class at this distance.
pub(crate) fn weight_at(distance: f32) -> f32 {
    (distance + SOFTNESS).powi(-POWER)
}

/// What the posterior keeps of a node.
#[derive(Clone, Copy, Default)]
pub(super) struct NodeSummary {
    pub(super) label: ClassId,
    pub(super) entropy: u16,
    pub(super) confidence: u16,
    pub(super) runner_up: ClassId,
    nearest: f32,
}

impl NodeSummary {
    /// Void, as unsure as where nothing is known of so many classes.
    pub(super) fn unknown(classes: usize) -> Self {
        Self {
            entropy: ((classes.max(1) as f32).ln() * ENTROPY_STEPS_PER_NAT).round() as u16,
            ..Self::default()
        }
    }

    /// By the probabilities of these classes.
    pub(super) fn of(classes: &[ClassId], probabilities: &[f32]) -> Self {
        summarise(classes, probabilities, 0.0)
    }
}

fn summarise(classes: &[ClassId], weights: &[f32], nearest: f32) -> NodeSummary {
    let sum: f32 = weights.iter().sum();
    if sum <= 0.0 {
        return NodeSummary {
            nearest,
            ..NodeSummary::default()
        };
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
    if nearest.is_infinite() {
        best = [(0.0, VOID); 2];
    }
    NodeSummary {
        label: best[0].1,
        // A cast saturates: 6.5 nats are the entropy of 700 classes.
        entropy: (entropy * ENTROPY_STEPS_PER_NAT).round() as u16,
        confidence: (best[0].0 * f32::from(CERTAIN)).round() as u16,
        runner_up: best[1].1,
        nearest,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::Label;
    use crate::semantics::Surface;
    use crate::semantics::testing::{by_distance, joined};

    #[test]
    fn equal_distances_give_the_highest_entropy() {
        let even = summarise(&[1, 2], &[1.0, 1.0], 1.0);
        let sure = summarise(&[1, 2], &[1.0, 0.01], 1.0);
        assert_eq!(even.entropy, 6931, "ln 2");
        assert!(sure.entropy < even.entropy / 4);
        assert_eq!((sure.label, sure.runner_up), (1, 2));
        assert_eq!(even.confidence, 32_768);
        assert_eq!(sure.confidence, (f32::from(CERTAIN) / 1.01).round() as u16);
    }

    #[test]
    fn votes_weigh_from_as_little_as_not_knowing_to_as_much_as_a_label_on_the_spot() {
        let weight = |trust| votes_weight(Trust::new(trust).unwrap());
        let voted = (VOTES_HORIZON + SOFTNESS).powi(-POWER);
        let close = |a: f32, b: f32| assert!((a / b - 1.0).abs() < 1e-5, "{a} {b}");
        close(weight(0.0) * voted, (HORIZON + SOFTNESS).powi(-POWER));
        assert_eq!(weight(0.5), 1.0);
        close(weight(1.0) * voted, SOFTNESS.powi(-POWER));
        assert!((0..100).all(|step| weight(0.01 * step as f32) <= weight(0.01 * (step + 1) as f32)));
    }

    #[test]
    fn objects_by_votes_are_as_before_once_a_stroke_over_all_of_them_is_undone() {
        // Votes say class 1 on the first two nodes, and an object on the first; a stroke says class 2 on the last.
        let graph = joined(3, &[(0, 1, 50.0), (1, 2, 30.0)]);
        let surface = Surface {
            graph,
            ..Surface::default()
        };
        let said = [(0, Label::new(1, ObjectId::new(5)))].into_iter().collect();
        let objects = ObjectVotes::new(&surface, &said).unwrap();
        let votes = [1.0, 0.0, 1.0, 0.0, 0.0, 0.0];
        let mut geodesics = ClassGeodesics::default();
        let mut states: Vec<Posterior> = Vec::new();
        let strokes: [&[u32]; 3] = [&[2], &[0, 2], &[2]];
        for nodes in strokes {
            let labels = nodes.iter().map(|&node| (node, Label::from(2)));
            let changed = geodesics.update(&surface.graph, labels.collect());
            let evidence = Evidence {
                votes: Some(&votes),
                objects: Some(&objects),
                ..by_distance(&[1, 2], &geodesics)
            };
            let mut posterior = states.last().cloned();
            let posterior = posterior.get_or_insert_with(|| Posterior::new(&evidence, 3));
            posterior.update(&evidence, &changed);
            states.push(posterior.clone());
        }
        assert_eq!(states[0].objects, [ObjectId::new(5), ObjectId::new(5), None]);
        assert_eq!(states[1].objects, [None, ObjectId::new(5), None]);
        assert!(states[2] == states[0]);
    }

    #[test]
    fn without_labels_everything_is_void_and_unknown() {
        let geodesics = ClassGeodesics::default();
        let evidence = by_distance(&[1, 2, 3], &geodesics);
        let posterior = Posterior::new(&evidence, 5);
        assert_eq!(posterior.labels, [VOID; 5]);
        assert_eq!(posterior.confidence, [0; 5]);
        assert_eq!(posterior.entropy, [10_986; 5], "ln 3");
    }
}
