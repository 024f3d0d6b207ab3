//! Objects of label images whose numbers mean something else in every frame: which of them are one, by the surface that
//! they share.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::objects::components;
use super::{DisjointSets, NO_NODE, Surface};
use crate::labels::{
    Class, ClassId, ImportedMap, Label, LabelImages, LabelSet, Object, ObjectId, VOID, unused_name,
};

/// Least overlap with which a frame shows an object that other frames show: voxels of both by voxels of either.
const LEAST_OVERLAP: f32 = 0.25;
/// Share of an object's visible voxels that one number of a frame must have to hold it.
const HELD: f32 = 0.5;
/// Least size of a part of an object, as a share of its largest part, that may be another object.
const PART: f32 = 0.1;
/// Share of what frames say of an object that must be said of its own nodes: what is left of a part that few frames tell
/// apart is no object.
const KEPT: f32 = 0.5;

/// What the image of a frame says of the nodes that the frame shows: the label of most of their pixels; void where those
/// have no object.
struct View(Vec<(u32, Label)>);

/// Objects by the nodes that frames have given them.
struct Found {
    classes: Vec<ClassId>,
    /// The objects of each node, with the number of frames that say so.
    votes: FxHashMap<u32, BTreeMap<u32, u32>>,
}

/// The label images with the same number for an object in all frames, and names for the objects that no stroke of `known`
/// has. All of a class that is stuff has none.
///
/// Frame by frame, each number is the object of its class with which it overlaps most on the surface, or a new one, as in
/// panoptic fusion (Narita et al. 2019). Then parts of an object that nothing joins are objects of their own, and two objects
/// are one where more frames hold them under one number than under two. A node is of the object that most frames say;
/// objects that keep few of their nodes, and numbers that fit none, are left out.
#[must_use]
pub fn united(surface: &Surface, mut images: LabelImages, known: &LabelSet) -> LabelImages {
    let listed: Vec<Class> = images.classes.iter().chain(&known.classes).cloned().collect();
    let class_of = |id: ClassId| listed.iter().find(|class| class.id == id);
    // A class that is not listed is one of things.
    let is_thing = |id: ClassId| class_of(id).is_none_or(|class| class.thing);
    let views = images.labels.maps.par_iter();
    let views: Vec<View> = views.map(|map| View::new(surface, map, &is_thing)).collect();
    let mut found = Found {
        classes: Vec::new(),
        votes: FxHashMap::default(),
    };
    views.iter().for_each(|view| found.add(view));
    found.divide(surface);
    found.join(&views);
    found.leave_out();
    let same: Vec<BTreeMap<Label, u32>> = views.par_iter().map(|view| found.matched(view)).collect();

    let of_strokes: BTreeSet<ObjectId> = known
        .strokes
        .values()
        .filter_map(|stroke| stroke.object)
        .collect();
    let named = known
        .objects
        .iter()
        .filter(|object| of_strokes.contains(&object.id));
    let mut names: BTreeSet<String> = named.map(|object| object.name.clone()).collect();
    let mut ids: BTreeMap<u32, ObjectId> = BTreeMap::new();
    let mut numbers = (1..=u16::MAX).filter_map(ObjectId::new);
    for &number in same.iter().flat_map(BTreeMap::values) {
        if ids.contains_key(&number) {
            continue;
        }
        let Some(id) = numbers.next() else { break };
        let class = found.classes[number as usize];
        let named = class_of(class).cloned().unwrap_or_else(|| Class::unnamed(class));
        let name = unused_name(&named.name, names.iter().map(String::as_str));
        names.insert(name.clone());
        images.objects.push(Object { id, class, name });
        ids.insert(number, id);
    }
    for (map, same) in images.labels.maps.iter_mut().zip(same) {
        *map = map.relabelled(|label| Label {
            object: same.get(&label).and_then(|number| ids.get(number)).copied(),
            ..label
        });
    }
    images
}

impl View {
    fn new(surface: &Surface, map: &ImportedMap, is_thing: &dyn Fn(ClassId) -> bool) -> Self {
        let shown = surface.nodes_of(map.frame);
        let (classes, objects) = (map.labels(), map.objects());
        let label = |pixel: usize| {
            let class = classes[pixel];
            let object = objects.as_ref().and_then(|objects| objects[pixel]);
            match object.filter(|_| is_thing(class)) {
                Some(_) => Label { class, object },
                None => VOID.into(),
            }
        };
        let mut said: Vec<(u32, Label)> = Vec::new();
        if shown.len() == classes.len() {
            let of_nodes = shown.runs().filter(|(node, _)| *node != NO_NODE);
            said.extend(of_nodes.flat_map(|(node, pixels)| pixels.map(move |pixel| (node, label(pixel)))));
        }
        said.sort_unstable();
        let of_node = |own: &[(u32, Label)]| {
            let labels = own.chunk_by(|a, b| a == b);
            labels.max_by_key(|same| same.len()).map(|same| same[0])
        };
        Self(said.chunk_by(|a, b| a.0 == b.0).filter_map(of_node).collect())
    }

    /// The nodes whose pixels have an object.
    fn told(&self) -> impl Iterator<Item = &(u32, Label)> {
        self.0.iter().filter(|(_, label)| label.object.is_some())
    }
}

impl Found {
    /// The object that most frames give a node; of several the first.
    fn of_node(&self, node: u32) -> Option<u32> {
        let votes = self.votes.get(&node)?.iter().rev();
        votes.max_by_key(|&(_, votes)| votes).map(|(&number, _)| number)
    }

    /// The object that each label of a frame shows, each one at most once.
    fn matched(&self, view: &View) -> BTreeMap<Label, u32> {
        let mut visible: BTreeMap<u32, u32> = BTreeMap::new();
        let mut covered: BTreeMap<Label, u32> = BTreeMap::new();
        let mut shared: BTreeMap<(Label, u32), u32> = BTreeMap::new();
        for &(node, label) in &view.0 {
            if let Some(number) = self.of_node(node) {
                *visible.entry(number).or_default() += 1;
                *covered.entry(label).or_default() += 1;
                if self.classes[number as usize] == label.class {
                    *shared.entry((label, number)).or_default() += 1;
                }
            }
        }
        let overlap = |((label, number), both): ((Label, u32), u32)| {
            let either = covered[&label] + visible[&number] - both;
            (both as f32 / either as f32, label, number)
        };
        let mut pairs: Vec<(f32, Label, u32)> = shared.into_iter().map(overlap).collect();
        pairs.retain(|(overlap, ..)| *overlap >= LEAST_OVERLAP);
        pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut same = BTreeMap::new();
        let mut taken = BTreeSet::new();
        for (_, label, number) in pairs {
            if !same.contains_key(&label) && taken.insert(number) {
                same.insert(label, number);
            }
        }
        same
    }

    /// Adds what a frame shows, with new objects for the labels that match none.
    fn add(&mut self, view: &View) {
        let mut same = self.matched(view);
        for &(node, label) in view.told() {
            let number = *same.entry(label).or_insert_with(|| {
                self.classes.push(label.class);
                self.classes.len() as u32 - 1
            });
            *self.votes.entry(node).or_default().entry(number).or_default() += 1;
        }
    }

    /// Makes objects of the large parts of an object that the surface does not join.
    fn divide(&mut self, surface: &Surface) {
        let owners: Vec<Option<u32>> = (0..surface.graph.len() as u32)
            .map(|node| self.of_node(node))
            .collect();
        let owned = |node: u32| owners[node as usize].is_some();
        for (owner, parts) in components(surface, &owners, &owned) {
            let Some(owner) = owner else { continue };
            let fewest = PART * parts[0].len() as f32;
            for part in parts
                .into_iter()
                .skip(1)
                .filter(|part| part.len() as f32 >= fewest)
            {
                self.classes.push(self.classes[owner as usize]);
                for node in part {
                    let votes = self.votes.entry(node).or_default();
                    if let Some(count) = votes.remove(&owner) {
                        votes.insert(self.classes.len() as u32 - 1, count);
                    }
                }
            }
        }
    }

    /// Makes one of objects that more of the frames which show both hold under one number than under two.
    fn join(&mut self, views: &[View]) {
        // By pairs, the frames that say that they are one, less the others.
        let mut said: BTreeMap<[u32; 2], i32> = BTreeMap::new();
        for view in views {
            let holders = self.holders(view);
            for (place, (a, by)) in holders.iter().enumerate() {
                for (b, other) in &holders[..place] {
                    if self.classes[*a as usize] == self.classes[*b as usize] {
                        *said.entry([*b, *a]).or_default() += if by == other { 1 } else { -1 };
                    }
                }
            }
        }
        let mut sets = DisjointSets::new(self.classes.len());
        for ([a, b], votes) in said {
            if votes > 0 {
                sets.join(a, b);
            }
        }
        for votes in self.votes.values_mut() {
            let mut joined = BTreeMap::new();
            for (&number, &count) in &*votes {
                *joined.entry(sets.root(number)).or_default() += count;
            }
            *votes = joined;
        }
    }

    /// Forgets the objects that have lost most of their nodes to others.
    fn leave_out(&mut self) {
        let mut votes = vec![0; self.classes.len()];
        let mut kept = votes.clone();
        for (&node, of_node) in &self.votes {
            let own = self.of_node(node);
            for (&number, count) in of_node {
                votes[number as usize] += count;
                kept[number as usize] += if own == Some(number) { *count } else { 0 };
            }
        }
        let is_kept = |number: u32| kept[number as usize] as f32 >= KEPT * votes[number as usize] as f32;
        for of_node in self.votes.values_mut() {
            of_node.retain(|&number, _| is_kept(number));
        }
    }

    /// The objects that a frame shows with the label that most of their visible nodes have there, ascending.
    fn holders(&self, view: &View) -> Vec<(u32, Label)> {
        let mut visible: BTreeMap<u32, BTreeMap<Label, u32>> = BTreeMap::new();
        for &(node, label) in &view.0 {
            if let Some(number) = self.of_node(node) {
                let labels = visible.entry(number).or_default();
                *labels.entry(label).or_default() += 1;
            }
        }
        let held = visible.into_iter().filter_map(|(number, labels)| {
            let all: u32 = labels.values().sum();
            let (label, most) = labels.into_iter().max_by_key(|&(_, nodes)| nodes)?;
            let is_held = label.object.is_some() && most as f32 >= HELD * all as f32;
            is_held.then_some((number, label))
        });
        held.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::testing::{clicked, label_images};
    use crate::labels::{Stroke, Trust};
    use crate::scene::testing::wall;
    use crate::semantics::testing::{surface, truth};

    #[test]
    fn an_object_has_one_number_whatever_its_numbers_in_the_frames_are() {
        let scene = wall(5, 64, 48);
        // Panels side by side: numbered from either side, both as one, one of them in two pieces, and left out.
        let said = |frame: usize, half: ClassId, row: usize| match (frame, half) {
            (0, half) => half,
            (1, half) => 9 - half,
            (2, _) => 4,
            (3, 1) if row < 12 => 5,
            (3, half) => 20 + half,
            (_, 1) => 0,
            _ => 1,
        };
        let map = |frame: usize| {
            let halves = truth(&scene, frame).into_iter().enumerate();
            let label = |(pixel, half)| Label::new(1, ObjectId::new(said(frame, half, pixel / 64)));
            ImportedMap::with_objects(frame, &halves.map(label).collect::<Vec<_>>())
        };
        let images = label_images((0..5).map(map).collect(), Trust::VOTES);
        let mut history = clicked(&["panel"], &[]);
        history.add_object(Stroke::click(0, 1, [1, 1]), &[]).unwrap();
        let mut known = history.labels().clone();
        let united = |known: &LabelSet| united(&surface(&scene), images.clone(), known);
        let one = united(&known);
        assert!(images.is_by_frame() && !one.is_by_frame());
        // A stroke is on panel 1.
        let names: Vec<&str> = one.objects.iter().map(|object| object.name.as_str()).collect();
        assert_eq!(names, ["panel 2", "panel 3"]);
        let numbers = one.labels.maps.iter().map(|map| {
            let objects = map.objects().unwrap();
            [24 * 64 + 8, 24 * 64 + 56].map(|pixel| objects[pixel].map(ObjectId::number))
        });
        let numbers: Vec<[Option<u16>; 2]> = numbers.collect();
        assert!(numbers[0] == [Some(1), Some(2)] || numbers[0] == [Some(2), Some(1)]);
        assert_eq!([numbers[1], numbers[3]], [numbers[0]; 2]);
        assert_eq!(numbers[4], [None, numbers[0][1]]);

        known.classes[0].thing = false;
        assert!(united(&known).labels.objects().is_empty());
    }
}
