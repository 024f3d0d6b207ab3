//! The objects that the pixels of label images give the voxels.

use std::cmp::Reverse;
use std::collections::BTreeSet;

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::{ClassGeodesics, NO_NODE, NodeVotes, Surface};
use crate::labels::{ClassId, ImportedLabels, ImportedMap, Label, ObjectId};

/// The labels that most pixels of label images give the nodes of a surface, and which of them is nearest to every node of
/// the same class.
#[derive(Clone, Debug)]
pub struct ObjectVotes {
    nearest: ClassGeodesics,
    /// The nodes with an object, ascending, and their classes.
    telling: Vec<(u32, ClassId)>,
}

impl ObjectVotes {
    /// Spreads the objects of images over a surface; `None` where they say none.
    pub(super) fn new(surface: &Surface, seeds: &FxHashMap<u32, Label>) -> Option<Self> {
        let with_object = seeds.iter().filter(|(_, label)| label.object.is_some());
        let mut telling: Vec<(u32, ClassId)> =
            with_object.map(|(&node, label)| (node, label.class)).collect();
        telling.sort_unstable();
        let classes: BTreeSet<ClassId> = telling.iter().map(|&(_, class)| class).collect();
        let of_classes = seeds.iter().filter(|(_, label)| classes.contains(&label.class));
        let mut nearest = ClassGeodesics::default();
        nearest.update(
            &surface.graph,
            of_classes.map(|(&node, &label)| (node, label)).collect(),
        );
        (!telling.is_empty()).then_some(Self { nearest, telling })
    }

    /// The object of a node, if it is of this class.
    pub(super) fn object(&self, class: ClassId, node: u32) -> Option<ObjectId> {
        self.nearest.object(class, node)
    }

    /// The nodes with an object of the class that they have here, ascending.
    pub(super) fn telling(&self, labels: &[ClassId]) -> impl Iterator<Item = u32> {
        let telling = self.telling.iter();
        let shown = telling.filter(|&&(node, class)| labels[node as usize] == class);
        shown.map(|&(node, _)| node)
    }
}

impl NodeVotes {
    /// The class that most pixels give a node, and the object of that class that most of them do, for each node with votes.
    pub(super) fn majority_labels(
        &self,
        surface: &Surface,
        images: &ImportedLabels,
    ) -> FxHashMap<u32, Label> {
        let classes = self.majority();
        let counts = images
            .maps
            .par_iter()
            .fold(FxHashMap::default, |mut counts, map| {
                count_objects(surface, &classes, map, &mut counts);
                counts
            });
        let counts = counts.reduce(FxHashMap::default, |mut counts, others| {
            for (said, pixels) in others {
                *counts.entry(said).or_default() += pixels;
            }
            counts
        });
        let mut most: FxHashMap<u32, (u32, Reverse<ObjectId>)> = FxHashMap::default();
        for ((node, object), pixels) in counts {
            let own = most.entry(node).or_insert((pixels, Reverse(object)));
            *own = (*own).max((pixels, Reverse(object)));
        }
        let label = |(node, class)| {
            let object = most.get(&node).map(|(_, object)| object.0);
            (node, Label { class, object })
        };
        classes.into_iter().map(label).collect()
    }
}

/// Counts the pixels of an image by node and object, as far as they say the class of the node.
fn count_objects(
    surface: &Surface,
    classes: &FxHashMap<u32, ClassId>,
    map: &ImportedMap,
    counts: &mut FxHashMap<(u32, ObjectId), u32>,
) {
    let nodes = surface.nodes_of(map.frame);
    let Some(objects) = map.objects().filter(|_| nodes.len() == map.pixels()) else {
        return;
    };
    let labels = map.labels();
    for (node, pixels) in nodes.runs().filter(|&(node, _)| node != NO_NODE) {
        let class = classes.get(&node);
        for pixel in pixels {
            if let Some(object) = objects[pixel].filter(|_| Some(&labels[pixel]) == class) {
                *counts.entry((node, object)).or_default() += 1;
            }
        }
    }
}
