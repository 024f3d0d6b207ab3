//! How like the labelled regions of each class the regions of a surface look.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::Look;
use super::posterior::stretch;
use crate::labels::{ClassId, Label};

/// The regions that have labelled nodes of each class, with the number of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct LabelledRegions {
    of_class: BTreeMap<ClassId, BTreeMap<u32, u32>>,
    /// The classes that are things; none where all are, as that tells nothing of any.
    things: BTreeSet<ClassId>,
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

    /// The factor on the distances to a class in a region: that of the most similar labelled region of the class.
    pub(super) fn stretch(&self, look: &Look, class: ClassId, region: u32) -> f32 {
        let is_thing = self.things.contains(&class);
        let gaps = self.of(class).map(|other| look.gap(region, other, is_thing));
        // Without labels the distances are infinite anyway.
        gaps.reduce(f32::min).map_or(1.0, stretch)
    }
}

/// The factors on the distances to each class in each region, kept in step with the labels.
#[derive(Clone, Debug)]
pub struct Likeness {
    look: Arc<Look>,
    classes: Vec<ClassId>,
    labelled: LabelledRegions,
    /// At least 1, row-major `[regions, classes]`.
    stretches: Vec<f32>,
}

impl Likeness {
    /// Of a surface without labels.
    pub(super) fn new(look: Arc<Look>) -> Self {
        Self {
            look,
            classes: Vec::new(),
            labelled: LabelledRegions::default(),
            stretches: Vec::new(),
        }
    }

    /// Factors on the distances of the classes at a node, in their order: the weight of a class there is exp(-gap)
    /// times what it would be in a region that looks like its labels.
    pub(crate) fn stretches(&self, node: usize) -> &[f32] {
        let region = self.look.region(node) as usize;
        &self.stretches[region * self.classes.len()..(region + 1) * self.classes.len()]
    }

    /// Whether a class is a thing and others are none.
    pub(crate) fn is_thing(&self, class: ClassId) -> bool {
        self.labelled.things.contains(&class)
    }

    /// The regions with labels.
    pub(super) fn labelled(&self) -> &LabelledRegions {
        &self.labelled
    }

    /// Follows the labelled nodes of these classes, of which some are things. Returns whether each region's factors may
    /// have changed.
    pub(super) fn update(
        &mut self,
        (classes, things): (&[ClassId], &BTreeSet<ClassId>),
        seeds: &FxHashMap<u32, Label>,
    ) -> Vec<bool> {
        let mut labelled = LabelledRegions::default();
        if !classes.iter().all(|class| things.contains(class)) {
            labelled.things.clone_from(things);
        }
        for (&node, label) in seeds {
            labelled.add(label.class, self.look.region(node as usize));
        }
        if classes != self.classes {
            self.classes = classes.to_vec();
            self.labelled = LabelledRegions::default();
            self.stretches = vec![1.0; self.look.len() * classes.len()];
        }
        let before = std::mem::replace(&mut self.labelled, labelled);
        if classes.is_empty() {
            return vec![false; self.look.len()];
        }
        let differs = |&(_, class): &(usize, &ClassId)| {
            let [was, is] = [&before, &self.labelled].map(|labelled| labelled.things.contains(class));
            was != is || !before.of(*class).eq(self.labelled.of(*class))
        };
        let differing: Vec<(usize, &ClassId)> = self.classes.iter().enumerate().filter(differs).collect();
        let (look, labelled) = (&self.look, &self.labelled);
        let rows = self.stretches.par_chunks_exact_mut(classes.len());
        let follow = |(region, row): (usize, &mut [f32])| {
            let mut has_changed = false;
            for &(column, &class) in &differing {
                let now = labelled.stretch(look, class, region as u32);
                has_changed |= std::mem::replace(&mut row[column], now) != now;
            }
            has_changed
        };
        rows.enumerate().map(follow).collect()
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::semantics::testing::node;
    use crate::semantics::{ClassGeodesics, Evidence, Node, Posterior, SurfaceGraph};

    /// A wall in three parts, side by side, grey, red and grey; 100 nodes each.
    fn striped() -> SurfaceGraph {
        let colors = [Vec3::splat(0.5), Vec3::new(0.7, 0.2, 0.2), Vec3::splat(0.5)];
        let nodes = (0..300).map(|k| Node {
            color: colors[k / 100],
            ..node(Vec3::new(0.05 * (k / 10) as f32, 0.05 * (k % 10) as f32, 0.0))
        });
        SurfaceGraph::new(nodes.collect())
    }

    #[test]
    fn what_looks_like_a_label_has_its_class_though_another_label_is_nearer() {
        let graph = striped();
        let mut likeness = Likeness::new(Arc::new(Look::new(&graph, Vec3::Y)));
        let mut geodesics = ClassGeodesics::default();
        let seeds: FxHashMap<u32, Label> = [(50, 1.into()), (150, 2.into())].into_iter().collect();
        assert_eq!(likeness.update((&[1, 2], &BTreeSet::new()), &seeds), [true; 3]);
        assert_eq!(likeness.update((&[1, 2], &BTreeSet::new()), &seeds), [false; 3]);
        geodesics.update(&graph, seeds.clone());
        let evidence = Evidence::by_distance(&[1, 2], &geodesics);
        let label = |evidence: &Evidence<'_>, node: usize| Posterior::new(evidence, graph.len()).labels[node];
        assert_eq!(label(&evidence, 250), 2);
        let looked_at = Evidence {
            likeness: Some(&likeness),
            ..evidence
        };
        assert_eq!([50, 150, 250].map(|node| label(&looked_at, node)), [1, 2, 1]);
        // A label that is taken back says nothing any more.
        let mut others = seeds;
        others.insert(250, 2.into());
        likeness.update((&[1, 2], &BTreeSet::new()), &others);
        assert_eq!(likeness.stretches(250)[1], 1.0);
        others.remove(&250);
        likeness.update((&[1, 2], &BTreeSet::new()), &others);
        assert!(likeness.stretches(250)[1] > likeness.stretches(250)[0]);
    }

    #[test]
    fn a_thing_ends_once_it_is_known_that_it_is_one() {
        // Of the last part only the beginning is left.
        let graph = SurfaceGraph::new(striped().nodes()[..230].to_vec());
        let look = Arc::new(Look::new(&graph, Vec3::Y));
        let seeds: FxHashMap<u32, Label> = [(50, 2.into()), (225, 1.into())].into_iter().collect();
        let follow = |likeness: &mut Likeness, things: &[ClassId]| {
            likeness.update((&[1, 2], &things.iter().copied().collect()), &seeds)
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
