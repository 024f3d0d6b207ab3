//! Whole label images on the surface: trusted pixels by shortest paths, votes by diffusion.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::posterior::votes_weight;
use super::votes::most_likely;
use super::{CERTAIN, NodeVotes, ObjectVotes, Surface};
use crate::labels::{ClassId, ImportedLabels, ImportedMap, Label, LabelSet, ObjectId, VOID};

/// Probability from which pixels keep the class of their node where the image would decide: many pixels of label images
/// agree there, also along borders. It falls with the share of random votes by this much, as those leave less for the
/// right class.
const SURE: f32 = 0.8;
const LESS_IF_RANDOM: f32 = 0.5;

/// Imported label images on a surface, for [`LabelPropagation`](super::LabelPropagation). Making it takes seconds where
/// they are votes, so that a session does that in the background.
#[derive(Clone, Debug)]
pub struct SurfaceImport {
    images: Arc<ImportedLabels>,
    /// The classes and objects of the images.
    in_images: (BTreeSet<ClassId>, BTreeSet<ObjectId>),
    known: Known,
    /// The images without what the label set lacks.
    pub(super) shown: Arc<ImportedLabels>,
    on_nodes: NodeAnswers,
    /// The class of each node by the images; void where they say none.
    of_nodes: Vec<ClassId>,
    /// The share of the votes that is random, as far as it shows on the surface.
    pub(super) random_share: f32,
    /// The share of the images' pixels that are labelled.
    pub(super) labelled_share: f32,
}

#[derive(Clone, Debug)]
enum NodeAnswers {
    /// The label of each node with trusted pixels.
    Trusted(FxHashMap<u32, Label>),
    /// Class probabilities `[nodes, classes]`, times the weight that follows from the trust, and the objects.
    Votes(Vec<f32>, Option<ObjectVotes>),
}

/// What of the images' classes and objects a label set has, too.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Known {
    /// Ascending.
    classes: Vec<ClassId>,
    /// Those of things, with their classes.
    objects: BTreeMap<ObjectId, ClassId>,
}

impl Known {
    fn new((classes, objects): &(BTreeSet<ClassId>, BTreeSet<ObjectId>), labels: &LabelSet) -> Self {
        let known = |class: &ClassId| labels.class(*class).is_some();
        let is_thing = |class| labels.class(class).is_some_and(|class| class.thing);
        let listed = labels
            .objects
            .iter()
            .filter(|object| objects.contains(&object.id));
        let things = listed.filter(|object| is_thing(object.class));
        Self {
            classes: classes.iter().copied().filter(known).collect(),
            objects: things.map(|object| (object.id, object.class)).collect(),
        }
    }

    /// What is left of a label.
    fn label(&self, Label { class, object }: Label) -> Label {
        if self.classes.binary_search(&class).is_err() {
            return VOID.into();
        }
        let object = object.filter(|object| self.objects.get(object) == Some(&class));
        Label { class, object }
    }
}

impl SurfaceImport {
    /// Propagates the imported images of a label set over a surface; `None` where there are none.
    pub fn new(surface: &Surface, labels: &LabelSet) -> Option<Self> {
        let images = Arc::clone(labels.imported.as_ref()?);
        let in_images = (images.classes(), images.objects());
        let known = Known::new(&in_images, labels);
        let votes = NodeVotes::count(surface, &known.classes, &images);
        let is_all = (known.classes.len(), known.objects.len()) == (in_images.0.len(), in_images.1.len());
        let shown = match is_all {
            true => Arc::clone(&images),
            false => Arc::new(images.relabelled(|label| known.label(label))),
        };
        let mut seeds = votes.majority_labels(surface, &shown);
        if images.trust.is_right() && !surface.is_sharp {
            // Labels beside an edge whose depth is off lie on what is behind it.
            let probabilities = votes.probabilities(surface);
            let rows: Vec<&[f32]> = probabilities.chunks_exact(known.classes.len().max(1)).collect();
            seeds.retain(|&node, label| label.class == most_likely(&known.classes, rows[node as usize]));
        }
        let labelled = |map: &ImportedMap| map.labels().into_iter().filter(|&class| class != VOID).count();
        let labelled: usize = shown.maps.par_iter().map(labelled).sum();
        let pixels: usize = shown.maps.iter().map(ImportedMap::pixels).sum();
        let mut of_nodes = vec![VOID; surface.graph.len()];
        let on_nodes = if images.trust.is_right() {
            seeds
                .iter()
                .for_each(|(&node, label)| of_nodes[node as usize] = label.class);
            NodeAnswers::Trusted(seeds)
        } else {
            let weight = votes_weight(images.trust);
            let mut probabilities = votes.probabilities(surface);
            let rows = probabilities.chunks_exact(known.classes.len().max(1));
            for (class, row) in of_nodes.iter_mut().zip(rows) {
                *class = most_likely(&known.classes, row);
            }
            probabilities.iter_mut().for_each(|share| *share *= weight);
            NodeAnswers::Votes(probabilities, ObjectVotes::new(surface, &seeds))
        };
        Some(Self {
            images,
            in_images,
            known,
            shown,
            on_nodes,
            of_nodes,
            random_share: votes.random_share(),
            labelled_share: labelled as f32 / pixels.max(1) as f32,
        })
    }

    /// Whether these are the images of a label set, with the same classes and objects.
    pub fn is_of(&self, labels: &LabelSet) -> bool {
        let same = |images: &Arc<ImportedLabels>| Arc::ptr_eq(images, &self.images);
        labels.imported.as_ref().is_some_and(same) && Known::new(&self.in_images, labels) == self.known
    }

    /// Confidence, in parts of [`CERTAIN`], from which pixels keep the class of their node where the image decides.
    pub(super) fn sure(&self) -> u16 {
        (SURE * (1.0 - LESS_IF_RANDOM * self.random_share) * f32::from(CERTAIN)) as u16
    }

    /// The images, where they are trusted.
    pub(super) fn trusted(&self) -> Option<&ImportedLabels> {
        matches!(self.on_nodes, NodeAnswers::Trusted(..)).then_some(&self.shown)
    }

    /// Whether a node has a class that the images do not give it: strokes know better there.
    pub(super) fn is_overruled(&self, node: u32, class: ClassId) -> bool {
        let own = self.of_nodes.get(node as usize);
        own.is_some_and(|&own| own != VOID && own != class)
    }

    /// The label of each node with trusted pixels.
    pub fn seeds(&self) -> impl Iterator<Item = (u32, Label)> + '_ {
        let seeds = match &self.on_nodes {
            NodeAnswers::Trusted(seeds) => Some(seeds),
            NodeAnswers::Votes(..) => None,
        };
        seeds.into_iter().flatten().map(|(&node, &label)| (node, label))
    }

    /// The objects by votes, where images that are votes say any.
    pub fn objects(&self) -> Option<&ObjectVotes> {
        match &self.on_nodes {
            NodeAnswers::Trusted(..) => None,
            NodeAnswers::Votes(_, objects) => objects.as_ref(),
        }
    }

    /// Weights of these classes at every node by votes, `[nodes, classes]`: probabilities times the weight of the
    /// images, which is 1 for [`Trust::VOTES`](crate::labels::Trust::VOTES). `None` where nothing is voted for: the images
    /// are trusted, or the label set has none of their classes.
    pub fn votes(&self, classes: &[ClassId]) -> Option<Arc<[f32]>> {
        let NodeAnswers::Votes(probabilities, _) = &self.on_nodes else {
            return None;
        };
        let own = self.known.classes.len();
        if own == 0 {
            return None;
        }
        let columns: Vec<Option<usize>> = classes
            .iter()
            .map(|class| self.known.classes.iter().position(|own| own == class))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::{Likeliest, Probabilities, Trust};
    use crate::scene::testing::wall;
    use crate::semantics::testing::surface;

    #[test]
    fn probabilities_are_votes_in_parts_that_agree_as_often_as_two_draws_from_them() {
        let surface = surface(&wall(3, 64, 48));
        let cell = Likeliest::of([(1, 0.75), (2, 0.25)].into_iter());
        let maps = (0..3).map(|frame| {
            let grid = Probabilities::new([32, 24], [64, 48], vec![cell; 32 * 24]).unwrap();
            ImportedMap::of_probabilities(frame, grid)
        });
        let said = ImportedLabels::new(maps.collect(), Trust::VOTES);
        let votes = NodeVotes::count(&surface, &[1, 2], &said);
        let expected = 0.75_f32.powi(2) + 0.25_f32.powi(2);
        let agreement = votes.agreement();
        assert!((agreement - expected).abs() < 0.01, "{agreement}");
        assert!(votes.majority().values().all(|&class| class == 1));
        // The whole grid is counted, each cell once.
        let total: f32 = (0..surface.graph.len())
            .filter_map(|node| Some(votes.shares(node)?.0))
            .sum();
        assert!((total - 3.0 * 32.0 * 24.0).abs() < 1.0, "{total}");
    }
}
