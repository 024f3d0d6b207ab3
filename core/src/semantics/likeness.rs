//! How like the labelled regions of each class the regions of a surface look.

use std::collections::BTreeMap;
use std::sync::Arc;

use rayon::prelude::*;

use super::posterior::{fill_weights, stretch};
use super::{ClassGeodesics, Kind, Kinds, Look};
use crate::labels::ClassId;

/// Rounds of self-training, and the share of a region that a class must exceed for the class to be learnt from it.
const ROUNDS: usize = 2;
const LEAST_SHARE: f32 = 0.5;
/// The region tells less than a label does, by this times -ln of that share. Steps keep small changes from changing all
/// regions.
const DOUBT: f32 = 4.0;
const DOUBT_STEP: f32 = 0.25;

/// The regions that have labelled nodes of each class, with the number of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct LabelledRegions {
    of_class: BTreeMap<ClassId, BTreeMap<u32, u32>>,
    kinds: Kinds,
}

impl LabelledRegions {
    /// Counts one more labelled node.
    pub(super) fn add(&mut self, class: ClassId, region: u32) {
        *self.of_class.entry(class).or_default().entry(region).or_default() += 1;
    }

    /// Takes back one that was added.
    pub(super) fn remove(&mut self, class: ClassId, region: u32) {
        let regions = self.of_class.entry(class).or_default();
        if let Some(count) = regions.get_mut(&region) {
            *count -= 1;
            if *count == 0 {
                regions.remove(&region);
            }
        }
    }

    /// The labelled regions of a class, ascending.
    fn of(&self, class: ClassId) -> impl Iterator<Item = u32> + '_ {
        self.of_class
            .get(&class)
            .into_iter()
            .flat_map(BTreeMap::keys)
            .copied()
    }

    /// How unlike the labelled regions of a class a region is: the gap to the most similar of them.
    fn gap(&self, look: &Look, class: ClassId, region: u32) -> f32 {
        let kind = self.kinds.of(class);
        let gaps = self.of(class).map(|other| look.gap(region, other, kind));
        // Without labels the distances are infinite anyway.
        gaps.reduce(f32::min).unwrap_or(0.0)
    }

    /// The factor on the distances to a class in a region by labelled regions alone.
    pub(super) fn stretch(&self, look: &Look, class: ClassId, region: u32) -> f32 {
        stretch(self.gap(look, class, region))
    }
}

/// The factors on the distances to each class in each region, kept in step with the labels.
///
/// Labels say what their own regions look like. So do, in rounds of self-training (Scudder 1965), the regions whose class then
/// is likely: a class looks as varied as what its labels reach, not as what was clicked. A pretrained network tells that by
/// itself; both together are too sure.
#[derive(Clone, Debug)]
pub struct Likeness {
    look: Arc<Look>,
    classes: Vec<ClassId>,
    pub(super) labelled: LabelledRegions,
    /// Gaps to what is labelled, row-major `[regions, classes]`.
    told: Vec<f32>,
    /// At least 1, row-major `[regions, classes]`.
    pub(super) stretches: Vec<f32>,
}

impl Likeness {
    /// Of a surface without labels.
    pub(super) fn new(look: Arc<Look>) -> Self {
        Self {
            look,
            classes: Vec::new(),
            labelled: LabelledRegions::default(),
            told: Vec::new(),
            stretches: Vec::new(),
        }
    }

    /// Factors on the distances of the classes at a node, in their order: the weight of a class there is exp(-gap)
    /// times what it would be in a region that looks like its labels.
    pub(crate) fn stretches(&self, node: usize) -> &[f32] {
        let region = self.look.region(node) as usize;
        &self.stretches[region * self.classes.len()..(region + 1) * self.classes.len()]
    }

    /// What the regions look like.
    pub(crate) fn look(&self) -> &Look {
        &self.look
    }

    /// The kind of a class.
    pub(crate) fn kind(&self, class: ClassId) -> Kind {
        self.labelled.kinds.of(class)
    }

    /// Follows the labels of these classes, whose kinds are given. Returns whether each region's factors have changed.
    pub(super) fn update(
        &mut self,
        (classes, kinds): (&[ClassId], &Kinds),
        geodesics: &ClassGeodesics,
    ) -> Vec<bool> {
        let mut labelled = LabelledRegions {
            kinds: kinds.clone(),
            ..LabelledRegions::default()
        };
        for (&node, label) in geodesics.seeds() {
            labelled.add(label.class, self.look.region(node as usize));
        }
        if classes != self.classes {
            self.classes = classes.to_vec();
            self.labelled = LabelledRegions::default();
            self.told = vec![0.0; self.look.len() * classes.len()];
            self.stretches = vec![1.0; self.look.len() * classes.len()];
        }
        let before = std::mem::replace(&mut self.labelled, labelled);
        if classes.is_empty() {
            return vec![false; self.look.len()];
        }
        let differs = |&(_, class): &(usize, &ClassId)| {
            let [was, is] = [&before, &self.labelled].map(|labelled| labelled.kinds.of(*class));
            was != is || !before.of(*class).eq(self.labelled.of(*class))
        };
        let differing: Vec<(usize, &ClassId)> = self.classes.iter().enumerate().filter(differs).collect();
        let (look, labelled) = (&self.look, &self.labelled);
        let rows = self.told.par_chunks_exact_mut(classes.len()).enumerate();
        rows.for_each(|(region, row)| {
            for &(column, &class) in &differing {
                row[column] = labelled.gap(look, class, region as u32);
            }
        });
        let mut stretches: Vec<f32> = self.told.par_iter().map(|&gap| stretch(gap)).collect();
        let rounds = if self.look.has_features() { 0 } else { ROUNDS };
        for _ in 0..rounds {
            let likely = self.likely(&stretches, geodesics);
            stretches = self.learnt(&likely);
        }
        let before = std::mem::replace(&mut self.stretches, stretches);
        self.differing(&before)
    }

    /// Whether each region's factors differ from these others of the same classes, of which there must be one.
    pub(super) fn differing(&self, others: &[f32]) -> Vec<bool> {
        let count = self.classes.len();
        let rows = self.stretches.chunks_exact(count).zip(others.chunks_exact(count));
        rows.map(|(own, other)| own != other).collect()
    }

    /// For each region the column of the class that has most of it with these factors, and how much less than a label it
    /// tells of what that class looks like; `None` where no class has enough.
    fn likely(&self, stretches: &[f32], geodesics: &ClassGeodesics) -> Vec<Option<(usize, f32)>> {
        let fields = geodesics.fields(&self.classes);
        let rows = stretches.par_chunks_exact(self.classes.len()).enumerate();
        let empty = || [vec![0.0; self.classes.len()], vec![0.0; self.classes.len()]];
        let likely = rows.map_init(empty, |[weights, shares], (region, stretches)| {
            shares.fill(0.0);
            let samples = &self.look.samples[region];
            for &node in samples {
                fill_weights(&fields, node as usize, Some(stretches), None, weights);
                let all = samples.len() as f32 * weights.iter().sum::<f32>();
                shares
                    .iter_mut()
                    .zip(&*weights)
                    .for_each(|(share, weight)| *share += weight / all);
            }
            let column = shares.iter().position(|&share| share > LEAST_SHARE)?;
            let doubt = -DOUBT * shares[column].ln();
            Some((column, (doubt / DOUBT_STEP).ceil() * DOUBT_STEP))
        });
        likely.collect()
    }

    /// The factors by labels and by what regions are likely to be.
    fn learnt(&self, likely: &[Option<(usize, f32)>]) -> Vec<f32> {
        let mut stretches = self.told.clone();
        let rows = stretches.par_chunks_exact_mut(self.classes.len()).enumerate();
        rows.for_each(|(region, row)| {
            for &(other, unlike) in &self.look.alike[region] {
                if let Some((column, doubt)) = likely[other as usize] {
                    let kind = self.kind(self.classes[column]);
                    let reserve = self.look.reserve(region as u32, other, kind);
                    row[column] = row[column].min(unlike + reserve + doubt);
                }
            }
            row.iter_mut().for_each(|gap| *gap = stretch(*gap));
        });
        stretches
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::labels::{Class, Label};
    use crate::semantics::testing::{by_distance, node};
    use crate::semantics::{Evidence, Node, Posterior, SurfaceGraph};

    const GREY: Vec3 = Vec3::splat(0.5);
    const RED: Vec3 = Vec3::new(0.7, 0.2, 0.2);

    /// A wall in parts of these colours, side by side; 100 nodes each.
    fn striped(colors: &[Vec3]) -> SurfaceGraph {
        let nodes = (0..100 * colors.len()).map(|k| Node {
            color: colors[k / 100],
            ..node(Vec3::new(0.05 * (k / 10) as f32, 0.05 * (k % 10) as f32, 0.0))
        });
        SurfaceGraph::new(nodes.collect(), 5)
    }

    /// Distances to these labels.
    fn distances(graph: &SurfaceGraph, labels: &[(u32, ClassId)]) -> ClassGeodesics {
        let mut geodesics = ClassGeodesics::default();
        let seeds = labels.iter().map(|&(node, class)| (node, Label::from(class)));
        geodesics.update(graph, seeds.collect());
        geodesics
    }

    #[test]
    fn what_looks_like_a_label_has_its_class_though_another_label_is_nearer() {
        let graph = striped(&[GREY, RED, GREY]);
        let mut likeness = Likeness::new(Arc::new(Look::new(&graph, Vec3::Y)));
        let geodesics = distances(&graph, &[(50, 1), (150, 2)]);
        assert_eq!(
            likeness.update((&[1, 2], &Kinds::default()), &geodesics),
            [true; 3]
        );
        assert_eq!(
            likeness.update((&[1, 2], &Kinds::default()), &geodesics),
            [false; 3]
        );
        let evidence = by_distance(&[1, 2], &geodesics);
        let label = |evidence: &Evidence<'_>, node: usize| Posterior::new(evidence, graph.len()).labels[node];
        assert_eq!(label(&evidence, 250), 2);
        let looked_at = Evidence {
            likeness: Some(&likeness),
            ..evidence
        };
        assert_eq!([50, 150, 250].map(|node| label(&looked_at, node)), [1, 2, 1]);
        // A label that is taken back says nothing any more.
        likeness.update(
            (&[1, 2], &Kinds::default()),
            &distances(&graph, &[(50, 1), (150, 2), (250, 2)]),
        );
        assert_eq!(likeness.stretches(250)[1], 1.0);
        likeness.update((&[1, 2], &Kinds::default()), &geodesics);
        assert!(likeness.stretches(250)[1] > likeness.stretches(250)[0]);
    }

    #[test]
    fn a_class_looks_as_varied_as_what_its_labels_reach() {
        let graph = striped(&[GREY, 0.8 * GREY, RED, 0.6 * GREY]);
        let look = Arc::new(Look::new(&graph, Vec3::Y));
        let mut likeness = Likeness::new(Arc::clone(&look));
        likeness.update(
            (&[1, 2], &Kinds::default()),
            &distances(&graph, &[(50, 1), (250, 2)]),
        );
        let by_labels = |class| likeness.labelled.stretch(&look, class, look.region(350));
        // The darkest grey is like the darker one, which is likely to be of the class of the grey.
        assert!(likeness.stretches(350)[0] < by_labels(1));
        assert_eq!(likeness.stretches(350)[1], by_labels(2));
        // Without that class there is nothing to learn from.
        likeness.update((&[1, 2], &Kinds::default()), &distances(&graph, &[(250, 2)]));
        assert_eq!(likeness.stretches(350)[0], 1.0);
    }

    #[test]
    fn a_thing_ends_once_it_is_known_that_it_is_one() {
        // Of the last part only the beginning is left.
        let graph = SurfaceGraph::new(striped(&[GREY, RED, GREY]).nodes()[..230].to_vec(), 5);
        let look = Arc::new(Look::new(&graph, Vec3::Y));
        let geodesics = distances(&graph, &[(50, 2), (225, 1)]);
        let follow = |likeness: &mut Likeness, things: &[ClassId]| {
            let class = |id| Class {
                thing: things.contains(&id),
                ..Class::unnamed(id)
            };
            likeness.update((&[1, 2], &Kinds::new(&[1, 2].map(class))), &geodesics)
        };
        let (mut likeness, mut anew) = (Likeness::new(Arc::clone(&look)), Likeness::new(look));
        follow(&mut likeness, &[1, 2]);
        let unknown = likeness.stretches(50)[0];
        assert_eq!(follow(&mut likeness, &[1])[..1], [true]);
        follow(&mut anew, &[1]);
        assert_eq!(likeness.stretches, anew.stretches, "as if it had always been one");
        assert!(likeness.stretches(50)[0] > unknown);
    }
}
