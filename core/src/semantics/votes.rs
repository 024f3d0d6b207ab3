//! The pixels of label images, counted by voxel and class.

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::diffusion::diffuse;
use super::{NO_NODE, Surface};
use crate::labels::{ClassId, ImportedLabels, VOID};

/// Strength of the diffusion where all votes in a voxel agree, and how it grows as fewer do.
const STRENGTH: f32 = 3.0;
const STRENGTH_POWER: f32 = -1.5;
/// Chance that votes which all agree are wrong all the same. Errors that all images share contradict nothing, so that
/// they cannot be measured.
const SHARED_ERROR: f32 = 0.02;

/// How many pixels give each voxel each class; a pixel with probabilities counts in parts.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeVotes {
    classes: Vec<ClassId>,
    /// `[nodes, classes]`.
    counts: Vec<f32>,
    /// Sums over the single votes of each node.
    alone: Vec<Alone>,
}

/// Sums over the votes of a node, each compared with itself. They are taken off where pairs of votes are compared.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Alone {
    /// Squares of the votes: 1 for a pixel with one class.
    votes: f32,
    /// Agreement of each with itself: 1 for such a pixel, less for a vote in parts.
    agreed: f32,
}

impl NodeVotes {
    /// Counts the pixels of the images that have one of `classes`. A pixel with probabilities is a vote in parts: each
    /// class gets its probability.
    pub fn count(surface: &Surface, classes: &[ClassId], labels: &ImportedLabels) -> Self {
        let mut votes = Self {
            classes: classes.to_vec(),
            counts: vec![0.0; surface.graph.len() * classes.len()],
            alone: vec![Alone::default(); surface.graph.len()],
        };
        let index: FxHashMap<ClassId, usize> = classes.iter().copied().zip(0..).collect();
        for map in &labels.maps {
            // Images of frames that have vanished or changed their size do not count.
            let nodes = surface.nodes_of(map.frame);
            if nodes.len() != map.pixels() {
                continue;
            }
            if let Some(probabilities) = map.probabilities() {
                let nodes = nodes.unpack();
                for (number, cell) in probabilities.cells().iter().enumerate() {
                    votes.add(nodes[probabilities.middle_of(number)], cell.iter(), &index);
                }
                continue;
            }
            let said = map.labels();
            for (node, pixels) in nodes.runs() {
                for &label in &said[pixels] {
                    votes.add(node, std::iter::once((label, 1.0)), &index);
                }
            }
        }
        votes
    }

    /// Adds a vote in parts for a node, if it is one; `index` has the place of each class that counts.
    fn add(
        &mut self,
        node: u32,
        vote: impl Iterator<Item = (ClassId, f32)>,
        index: &FxHashMap<ClassId, usize>,
    ) {
        if node == NO_NODE {
            return;
        }
        let own = node as usize * self.classes.len();
        let (mut sum, mut agreed) = (0.0, 0.0);
        for (class, part) in vote {
            if let Some(place) = index.get(&class) {
                self.counts[own + place] += part;
                sum += part;
                agreed += part * part;
            }
        }
        let alone = &mut self.alone[node as usize];
        alone.votes += sum * sum;
        alone.agreed += agreed;
    }

    /// Number of a node's votes and the share of each class in them; `None` where it has none.
    pub fn shares(&self, node: usize) -> Option<(f32, Vec<f32>)> {
        let count = self.classes.len();
        let own = &self.counts[node * count..(node + 1) * count];
        let sum: f32 = own.iter().sum();
        (sum > 0.0).then(|| (sum, own.iter().map(|votes| votes / sum).collect()))
    }

    /// The class that most pixels give a node, for each node with votes.
    pub fn majority(&self) -> FxHashMap<u32, ClassId> {
        let rows = self.counts.chunks_exact(self.classes.len().max(1));
        let with_votes = rows
            .enumerate()
            .filter(|(_, row)| row.iter().any(|&count| count > 0.0));
        with_votes
            .map(|(node, row)| (node as u32, most_likely(&self.classes, row)))
            .collect()
    }

    /// The chance that two votes in one voxel agree, averaged over the voxels with at least two votes, each weighted by
    /// its votes; 1 where there are none.
    ///
    /// Of C classes with a share r of random votes it is about (1 - r)^2 + r (2 - r) / C.
    pub fn agreement(&self) -> f32 {
        let (mut agreed, mut votes) = (0.0_f64, 0.0_f64);
        let rows = self.counts.chunks_exact(self.classes.len().max(1));
        for (row, alone) in rows.zip(&self.alone) {
            let total: f64 = row.iter().map(|&count| f64::from(count)).sum();
            let pairs = total * total - f64::from(alone.votes);
            if total >= 2.0 && pairs > 0.0 {
                let same = row.iter().map(|&count| f64::from(count).powi(2)).sum::<f64>();
                agreed += total * (same - f64::from(alone.agreed)).max(0.0) / pairs;
                votes += total;
            }
        }
        if votes > 0.0 { (agreed / votes) as f32 } else { 1.0 }
    }

    /// The share of random votes r that explains the agreement a of C classes: (1 - r)^2 (1 - 1/C) = a - 1/C.
    pub(super) fn random_share(&self) -> f32 {
        let even = 1.0 / self.classes.len().max(2) as f32;
        1.0 - ((self.agreement() - even) / (1.0 - even)).clamp(0.0, 1.0).sqrt()
    }

    /// Class probabilities of every node, `[nodes, classes]`: the shares, diffused the more the votes contradict each
    /// other, less the r / C that random votes add to all classes, with room for errors that all images share. Rows that
    /// no vote reaches are zero.
    pub fn probabilities(&self, surface: &Surface) -> Vec<f32> {
        let count = self.classes.len().max(1);
        let even = 1.0 / count as f32;
        let random = self.random_share() * even;
        let strength = STRENGTH * self.agreement().max(1e-3).powf(STRENGTH_POWER);
        let mut rows = diffuse(&surface.graph, &self.counts, self.classes.len(), strength);
        rows.par_chunks_exact_mut(count)
            .with_min_len(1024)
            .for_each(|row| {
                row.iter_mut()
                    .for_each(|share| *share = (*share - random).max(0.0));
                let sum: f32 = row.iter().sum();
                if sum > 0.0 {
                    let scale = (1.0 - SHARED_ERROR) / sum;
                    row.iter_mut()
                        .for_each(|share| *share = *share * scale + SHARED_ERROR * even);
                }
            });
        rows
    }
}

/// The class with the largest value, the first of those with it; void where all are zero.
pub(super) fn most_likely(classes: &[ClassId], values: &[f32]) -> ClassId {
    let best = |best: (f32, ClassId), (&value, &class): (&f32, &ClassId)| {
        if value > best.0 { (value, class) } else { best }
    };
    values.iter().zip(classes).fold((0.0, VOID), best).1
}
