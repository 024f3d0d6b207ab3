//! Whole label images on the surface: trusted pixels by shortest paths, votes by diffusion.

use std::collections::BTreeSet;
use std::sync::Arc;

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::{NO_NODE, Posterior, Propagation, Surface, diffuse};
use crate::labels::{ClassId, ImportedLabels, LabelSet, Trust, VOID};

/// Strength of the diffusion where all votes in a voxel agree, and how it grows as fewer do.
const STRENGTH: f32 = 3.0;
const STRENGTH_POWER: f32 = -1.5;
/// Chance that a vote that all around agree with is wrong all the same: errors that all images share contradict
/// nothing, so they cannot be measured.
const SHARED_ERROR: f32 = 0.02;

/// How many pixels say which class of each voxel.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeVotes {
    classes: Vec<ClassId>,
    /// Pixels, `[nodes, classes]`.
    counts: Vec<f32>,
}

impl NodeVotes {
    /// Counts the pixels of the images that say one of `classes`.
    pub fn count(surface: &Surface, classes: &[ClassId], labels: &ImportedLabels) -> Self {
        let index: FxHashMap<ClassId, usize> = classes.iter().copied().zip(0..).collect();
        let mut counts = vec![0.0; surface.graph.len() * classes.len()];
        for map in &labels.maps {
            // Frames that have vanished or changed their size say nothing.
            let nodes = surface.nodes_of(map.frame);
            if nodes.len() != map.pixels() {
                continue;
            }
            let said = map.labels();
            for (node, pixels) in nodes.runs() {
                if node == NO_NODE {
                    continue;
                }
                for label in &said[pixels] {
                    if let Some(class) = index.get(label) {
                        counts[node as usize * classes.len() + class] += 1.0;
                    }
                }
            }
        }
        Self {
            classes: classes.to_vec(),
            counts,
        }
    }

    /// Number of a node's votes and the share of each class in them; `None` where it has none.
    pub(super) fn shares(&self, node: usize) -> Option<(f32, Vec<f32>)> {
        let count = self.classes.len();
        let own = &self.counts[node * count..(node + 1) * count];
        let sum: f32 = own.iter().sum();
        (sum > 0.0).then(|| (sum, own.iter().map(|votes| votes / sum).collect()))
    }

    /// The class that most pixels say, for each node of which any pixel says one.
    pub fn majority(&self) -> FxHashMap<u32, ClassId> {
        let rows = self.counts.chunks_exact(self.classes.len().max(1));
        let with_votes = rows
            .enumerate()
            .filter(|(_, row)| row.iter().any(|&count| count > 0.0));
        with_votes
            .map(|(node, row)| (node as u32, most_likely(&self.classes, row)))
            .collect()
    }

    /// The chance that two votes in one voxel agree, over the voxels that have at least two, each as often as
    /// it has votes; 1 where there are none.
    ///
    /// Of C classes with a share r of random votes it is about (1 - r)^2 + r (2 - r) / C.
    pub fn agreement(&self) -> f32 {
        let (mut agreed, mut votes) = (0.0_f64, 0.0_f64);
        for row in self.counts.chunks_exact(self.classes.len().max(1)) {
            let total: f64 = row.iter().map(|&count| f64::from(count)).sum();
            if total >= 2.0 {
                let same = |&count: &f32| f64::from(count) * (f64::from(count) - 1.0);
                agreed += row.iter().map(same).sum::<f64>() / (total - 1.0);
                votes += total;
            }
        }
        if votes > 0.0 { (agreed / votes) as f32 } else { 1.0 }
    }

    /// Shares of the classes at every node, `[nodes, classes]`, after diffusion whose strength follows from how
    /// much the votes contradict each other.
    fn diffused(&self, surface: &Surface) -> Vec<f32> {
        let strength = STRENGTH * self.agreement().max(1e-3).powf(STRENGTH_POWER);
        diffuse(&surface.graph, &self.counts, self.classes.len(), strength)
    }

    /// The share of random votes r that explains the agreement a of C classes: (1 - r)^2 (1 - 1/C) = a - 1/C.
    fn random_share(&self) -> f32 {
        let even = 1.0 / self.classes.len().max(2) as f32;
        1.0 - ((self.agreement() - even) / (1.0 - even)).clamp(0.0, 1.0).sqrt()
    }

    /// Class probabilities of every node, `[nodes, classes]`: the diffused shares without what random votes add to
    /// all of them, r / C, and with the errors that agreement cannot tell. Rows that no vote reaches are zero.
    pub fn probabilities(&self, surface: &Surface) -> Vec<f32> {
        let count = self.classes.len().max(1);
        let even = 1.0 / count as f32;
        let random = self.random_share() * even;
        let mut rows = self.diffused(surface);
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
fn most_likely(classes: &[ClassId], values: &[f32]) -> ClassId {
    let best = |best: (f32, ClassId), (&value, &class): (&f32, &ClassId)| {
        if value > best.0 { (value, class) } else { best }
    };
    values.iter().zip(classes).fold((0.0, VOID), best).1
}

/// What imported label images say of a surface, for [`Spread`](super::Spread). Making it takes seconds where they
/// are votes, so a session does that beside its other work.
#[derive(Clone, Debug)]
pub struct SurfaceImport {
    images: Arc<ImportedLabels>,
    /// The classes of the images that the label set has, ascending.
    classes: Vec<ClassId>,
    said: Said,
}

#[derive(Clone, Debug)]
enum Said {
    /// The class of each node with trusted pixels, and the images without classes that there are not.
    Trusted(FxHashMap<u32, ClassId>, Arc<ImportedLabels>),
    /// Class probabilities `[nodes, classes]`.
    Votes(Vec<f32>),
}

impl SurfaceImport {
    /// Spreads the imported images of a label set over a surface; `None` where there are none.
    pub fn new(surface: &Surface, labels: &LabelSet) -> Option<Self> {
        let images = Arc::clone(labels.imported.as_ref()?);
        let in_images = images.classes();
        let classes = shared_classes(&in_images, labels);
        let votes = NodeVotes::count(surface, &classes, &images);
        let said = match images.trust {
            Trust::Trusted => {
                let known = |class: ClassId| if classes.contains(&class) { class } else { VOID };
                let shown = if classes.len() == in_images.len() {
                    Arc::clone(&images)
                } else {
                    Arc::new(images.relabelled(known))
                };
                Said::Trusted(votes.majority(), shown)
            }
            Trust::Votes => Said::Votes(votes.probabilities(surface)),
        };
        Some(Self {
            images,
            classes,
            said,
        })
    }

    /// Whether these are the images of a label set, and all of its classes that they show.
    pub fn is_of(&self, labels: &LabelSet) -> bool {
        let same = |images: &Arc<ImportedLabels>| Arc::ptr_eq(images, &self.images);
        labels.imported.as_ref().is_some_and(same)
            && shared_classes(&self.images.classes(), labels) == self.classes
    }

    /// The images whose pixels are as they say.
    pub fn trusted(&self) -> Option<&Arc<ImportedLabels>> {
        match &self.said {
            Said::Trusted(_, shown) => Some(shown),
            Said::Votes(_) => None,
        }
    }

    /// The class of each node with trusted pixels.
    pub fn seeds(&self) -> impl Iterator<Item = (u32, ClassId)> + '_ {
        let seeds = match &self.said {
            Said::Trusted(seeds, _) => Some(seeds),
            Said::Votes(_) => None,
        };
        seeds.into_iter().flatten().map(|(&node, &class)| (node, class))
    }

    /// The probabilities that votes give these classes at every node, `[nodes, classes]`.
    pub fn votes(&self, classes: &[ClassId]) -> Option<Vec<f32>> {
        let Said::Votes(probabilities) = &self.said else {
            return None;
        };
        let own = self.classes.len().max(1);
        let columns: Vec<Option<usize>> = classes
            .iter()
            .map(|class| self.classes.iter().position(|own| own == class))
            .collect();
        let rows = probabilities.chunks_exact(own);
        let all = rows.flat_map(|row| {
            columns
                .iter()
                .map(|column| column.map_or(0.0, |column| row[column]))
        });
        Some(all.collect())
    }
}

/// The classes of images that a label set has, ascending.
fn shared_classes(in_images: &BTreeSet<ClassId>, labels: &LabelSet) -> Vec<ClassId> {
    let known = |class: &ClassId| labels.class(*class).is_some();
    in_images.iter().copied().filter(known).collect()
}

/// The class of every node of a surface.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NodeLabels(pub Vec<ClassId>);

impl NodeLabels {
    /// Spreads label images over a surface: trusted pixels are sources of shortest paths, votes are diffused
    /// with a strength that follows from how much they contradict each other.
    pub fn spread(surface: &Surface, classes: &[ClassId], labels: &ImportedLabels) -> Self {
        let votes = NodeVotes::count(surface, classes, labels);
        match labels.trust {
            Trust::Trusted => {
                let mut propagation = Propagation::default();
                propagation.update(&surface.graph, votes.majority());
                Self(Posterior::new(&propagation, classes, surface.graph.len(), None, None).labels)
            }
            Trust::Votes => {
                let shares = votes.diffused(surface);
                let rows = shares.par_chunks_exact(classes.len().max(1));
                Self(rows.map(|row| most_likely(classes, row)).collect())
            }
        }
    }

    /// The class of every pixel of a frame, row-major; void where it shows no node.
    pub fn of_frame(&self, surface: &Surface, frame: usize) -> Vec<ClassId> {
        let map = surface.nodes_of(frame);
        let mut labels = Vec::with_capacity(map.len());
        for (node, pixels) in map.runs() {
            let label = if node == NO_NODE {
                VOID
            } else {
                self.0[node as usize]
            };
            labels.resize(pixels.end, label);
        }
        labels
    }
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng, rngs::SmallRng};

    use super::*;
    use crate::labels::ImportedMap;
    use crate::scene::Scene;
    use crate::scene::testing::wall;

    fn truth(scene: &Scene, frame: usize) -> Vec<ClassId> {
        let color = scene.frames[frame].color();
        (0..64 * 48)
            .map(|pixel| 1 + ClassId::from(color.pixel(pixel)[0] > 128))
            .collect()
    }

    fn right(labels: &[ClassId], truth: &[ClassId]) -> f32 {
        let same = labels.iter().zip(truth).filter(|(a, b)| a == b).count();
        same as f32 / truth.len() as f32
    }

    #[test]
    fn two_trusted_pixels_label_frames_that_none_is_on() {
        let scene = wall(5, 64, 48);
        let surface = Surface::build(&scene, &[], 5.0).unwrap();
        let mut labels = vec![VOID; 64 * 48];
        labels[20 * 64 + 10] = 1;
        labels[20 * 64 + 55] = 2;
        let maps = vec![ImportedMap::new(0, &labels)];
        let trusted = ImportedLabels {
            maps,
            trust: Trust::Trusted,
        };
        let spread = NodeLabels::spread(&surface, &[1, 2], &trusted);
        assert!(right(&spread.of_frame(&surface, 4), &truth(&scene, 4)) > 0.95);
    }

    #[test]
    fn votes_that_are_mostly_noise_still_tell_the_halves_apart() {
        let scene = wall(5, 64, 48);
        let surface = Surface::build(&scene, &[], 5.0).unwrap();
        let mut rng = SmallRng::seed_from_u64(3);
        let classes: Vec<ClassId> = (1..=4).collect();
        let maps: Vec<ImportedMap> = (0..3)
            .map(|frame| {
                let mut labels = truth(&scene, frame);
                for label in &mut labels {
                    if rng.random_bool(0.7) {
                        *label = rng.random_range(1..=4);
                    }
                }
                ImportedMap::new(frame, &labels)
            })
            .collect();
        let noisy = ImportedLabels {
            maps,
            trust: Trust::Votes,
        };
        let votes = NodeVotes::count(&surface, &classes, &noisy);
        let expected = 0.3_f32.powi(2) + 0.7 * 1.3 / 4.0;
        assert!(
            (votes.agreement() - expected).abs() < 0.05,
            "{}",
            votes.agreement()
        );
        let spread = NodeLabels::spread(&surface, &classes, &noisy);
        assert!(right(&noisy.maps[0].labels(), &truth(&scene, 0)) < 0.5);
        assert!(right(&spread.of_frame(&surface, 4), &truth(&scene, 4)) > 0.95);
    }
}
