//! The objects on a surface: those that labels tell apart, and the parts of things that the surface itself does.

mod parts;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};

use glam::Vec3;
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};

pub(super) use parts::components;
use parts::{Part, parts, smaller_from};

use super::{NearestNodes, Node, Posterior, Surface, innermost};
use crate::labels::{
    Class, ClassId, FoundObject, LabelSet, Object, ObjectId, Stroke, VOID, runs_of, unused_name,
};

/// A part with at least this share of the voxels of the class's largest part is an object of its own when labels say only
/// others of the class.
const WHOLE: f32 = 0.5;

/// How far apart nodes of two surfaces may be that show the same, in voxels.
const NEAR: f32 = 6.0;
/// Places by which a part is found again, at most.
const PLACES: usize = 16;

/// A part of a surface that was found before, and places on it by which it is found again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KnownPart {
    /// Its number, class and name.
    pub object: Object,
    /// Some of its points, in world coordinates, metres.
    pub places: Vec<[f32; 3]>,
}

/// The objects on a surface.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SurfaceObjects {
    /// Those that labels say first, in their order, and then the parts by their numbers.
    pub objects: Vec<Object>,
    /// How many of them labels say.
    told: usize,
    of_nodes: Vec<Option<ObjectId>>,
}

impl SurfaceObjects {
    /// The objects of the `classes` that are things: those of the list `told`, on the nodes that the posterior gives them,
    /// and on the other nodes of each class its connected parts. An object that labels say does not reach a large
    /// part of its class without such a label. A part keeps the number and name of the part in `before`, of the same surface,
    /// that has most of its nodes, so that both are stable while labels change; where a part falls apart, what is labelled
    /// keeps them.
    ///
    /// Connected are nodes of a class that share an edge which is not longer than between neighbours. Parts much smaller
    /// than the class's largest object are fragments: they belong to the nearest larger one.
    pub fn new(
        surface: &Surface,
        posterior: &Posterior,
        (classes, told): (&[Class], &[Object]),
        before: Option<&Self>,
    ) -> Self {
        let things: BTreeMap<ClassId, &Class> = classes
            .iter()
            .filter(|class| class.thing)
            .map(|class| (class.id, class))
            .collect();
        let mut used: BTreeSet<ObjectId> = told.iter().map(|object| object.id).collect();
        // The posterior may be older than the list: what that lacks is no object.
        let listed = |said: &Option<ObjectId>| said.filter(|said| used.contains(said));
        let mut of_nodes: Vec<Option<ObjectId>> = posterior.objects.iter().map(listed).collect();
        of_nodes.resize(surface.graph.len(), None);
        if !posterior.objects.is_empty() {
            let is_thing = |node: u32| things.contains_key(&posterior.labels[node as usize]);
            let tells = |node: &u32| posterior.telling.binary_search(node).is_ok();
            for parts in components(surface, &posterior.labels, &is_thing).into_values() {
                let fewest = WHOLE * parts.first().map_or(0, Vec::len) as f32;
                let (whole, _) = parts.split_at(smaller_from(&parts, fewest));
                for part in whole.iter().filter(|part| !part.iter().any(tells)) {
                    part.iter().for_each(|&node| of_nodes[node as usize] = None);
                }
            }
        }
        let parts = parts(surface, posterior, &things, &mut of_nodes);
        let mut names: BTreeSet<String> = told.iter().map(|object| object.name.clone()).collect();
        let next = used.last().map_or(1, |last| last.number().saturating_add(1));
        let kept = before.map_or_else(BTreeMap::new, |before| before.kept_by(&parts, &used, &names));
        for object in kept.values() {
            used.insert(object.id);
            names.insert(object.name.clone());
        }
        let numbers = (next..=u16::MAX).chain(1..next).filter_map(ObjectId::new);
        let mut numbers = numbers.filter(|id| !used.contains(id));
        let mut free = Vec::new();
        for (number, part) in parts.iter().enumerate() {
            let Some(object) = kept.get(&number).cloned().or_else(|| {
                let class = things.get(&part.class)?;
                let name = unused_name(&class.name, names.iter().map(String::as_str));
                Some(Object {
                    id: numbers.next()?,
                    class: part.class,
                    name,
                })
            }) else {
                continue;
            };
            names.insert(object.name.clone());
            for &node in &part.nodes {
                of_nodes[node as usize] = Some(object.id);
            }
            free.push(object);
        }
        free.sort_by_key(|object| object.id);
        Self {
            objects: [told, &free].concat(),
            told: told.len(),
            of_nodes,
        }
    }

    /// The same objects on another surface of the scene, as one follows another while the geometry is learnt: a node there
    /// has the object of the nearest node of `own`, their surface, if it is near and the object has the node's class.
    pub fn on(&self, own: &Surface, (other, posterior): (&Surface, &Posterior)) -> Self {
        let class_of: FxHashMap<ObjectId, ClassId> = self
            .objects
            .iter()
            .map(|object| (object.id, object.class))
            .collect();
        let nearest = NearestNodes::new(own);
        let reach = NEAR * own.voxel.max(other.voxel);
        let object = |(node, label): (&Node, &ClassId)| {
            let object = self.of_node(nearest.nearest(node.position, reach)?)?;
            (class_of.get(&object) == Some(label)).then_some(object)
        };
        let nodes = other.graph.nodes().iter().zip(&posterior.labels);
        Self {
            objects: self.objects.clone(),
            told: self.told,
            of_nodes: nodes.map(object).collect(),
        }
    }

    /// The objects with where the keyframes show them, and the strokes that lie on each of them with most of their pixels
    /// and name none.
    pub fn found(&self, surface: &Surface, labels: &LabelSet) -> Vec<FoundObject> {
        let objects = self.objects.iter().cloned();
        let mut found: BTreeMap<u16, FoundObject> = objects
            .map(|object| (object.id.number(), object.into()))
            .collect();
        let number = |node: u32| self.of_node(node).map_or(0, ObjectId::number);
        let mut best: BTreeMap<u16, (u64, usize)> = BTreeMap::new();
        let highest = found.last_key_value().map_or(0, |(&highest, _)| highest);
        for (frame, nodes) in surface.pixels.iter().enumerate() {
            let mut counts = vec![0; usize::from(highest) + 1];
            for (node, pixels) in nodes.runs() {
                counts[usize::from(number(node))] += pixels.len() as u64;
            }
            for (number, object) in &mut found {
                let pixels = counts[usize::from(*number)];
                object.pixels += pixels;
                object.frames += usize::from(pixels > 0);
                let most = best.entry(*number).or_default();
                if pixels > most.0 {
                    *most = (pixels, frame);
                }
            }
        }
        let frames: BTreeSet<usize> = best
            .values()
            .filter(|(most, _)| *most > 0)
            .map(|of| of.1)
            .collect();
        for frame in frames {
            let nodes = &surface.pixels[frame];
            let numbers: Vec<u16> = nodes.unpack().into_iter().map(number).collect();
            for (number, (pixel, _)) in innermost(&numbers, nodes.width()) {
                let object = found.get_mut(&number);
                if let Some(object) = object.filter(|_| best.get(&number).is_some_and(|of| of.1 == frame)) {
                    let place = [pixel % nodes.width(), pixel / nodes.width()].map(|at| at as u32);
                    object.click = Some(Stroke::click(frame, object.object.class, place));
                }
            }
        }
        for (&id, stroke) in &labels.strokes {
            if stroke.object.is_some() || stroke.class == VOID {
                continue;
            }
            let nodes = surface.nodes_of(stroke.frame);
            let (width, height) = (nodes.width() as u32, nodes.len().checked_div(nodes.width()));
            let runs = runs_of(stroke, width, height.unwrap_or(0) as u32);
            let pixels = runs.iter().flat_map(|run| run.indices(width));
            let pixels: Vec<u32> = pixels.map(|pixel| pixel as u32).collect();
            let mut shares: BTreeMap<u16, usize> = BTreeMap::new();
            for node in surface.nodes_at(stroke.frame, &pixels) {
                *shares.entry(node.map_or(0, number)).or_default() += 1;
            }
            let most = shares.into_iter().max_by_key(|&(_, pixels)| pixels);
            let object = most.and_then(|(number, _)| found.get_mut(&number));
            if let Some(object) = object.filter(|object| object.object.class == stroke.class) {
                object.strokes.push(id);
            }
        }
        self.objects
            .iter()
            .filter_map(|object| found.remove(&object.id.number()))
            .collect()
    }

    /// The parts on `surface`, which these objects are on, to be [found again](Self::recalled) when the scene is opened again.
    pub fn parts(&self, surface: &Surface) -> Vec<KnownPart> {
        let mut nodes_of: FxHashMap<ObjectId, Vec<&Node>> = FxHashMap::default();
        for (node, object) in surface.graph.nodes().iter().zip(&self.of_nodes) {
            if let Some(object) = object {
                nodes_of.entry(*object).or_default().push(node);
            }
        }
        let part = |object: &Object| {
            let nodes = nodes_of.get(&object.id)?;
            let places = nodes.iter().step_by(nodes.len().div_ceil(PLACES));
            Some(KnownPart {
                object: object.clone(),
                places: places.map(|node| node.position.to_array()).collect(),
            })
        };
        self.objects[self.told..].iter().filter_map(part).collect()
    }

    /// What is left of the objects on a surface of the same scene where only these parts are known: the nodes nearest to their
    /// places.
    pub fn recalled(surface: &Surface, parts: &[KnownPart]) -> Self {
        let nearest = NearestNodes::new(surface);
        let mut of_nodes = vec![None; surface.graph.len()];
        for part in parts {
            let near = |place: &[f32; 3]| nearest.nearest(Vec3::from(*place), NEAR * surface.voxel);
            for node in part.places.iter().filter_map(near) {
                of_nodes[node as usize] = Some(part.object.id);
            }
        }
        Self {
            objects: parts.iter().map(|part| part.object.clone()).collect(),
            told: 0,
            of_nodes,
        }
    }

    /// The object of a node, as far as there is such a node and it has one.
    pub fn of_node(&self, node: u32) -> Option<ObjectId> {
        *self.of_nodes.get(node as usize)?
    }

    /// The objects that parts keep, by the places of the parts: each of these objects goes to the part of its class that
    /// has most of its nodes, if possible one with labels, unless labels say its number or name by now.
    fn kept_by(
        &self,
        parts: &[Part],
        used: &BTreeSet<ObjectId>,
        names: &BTreeSet<String>,
    ) -> BTreeMap<usize, Object> {
        let mut shared: BTreeMap<(usize, ObjectId), usize> = BTreeMap::new();
        for (number, part) in parts.iter().enumerate() {
            for object in part.nodes.iter().filter_map(|&node| self.of_node(node)) {
                *shared.entry((number, object)).or_default() += 1;
            }
        }
        let mut pairs: Vec<((usize, ObjectId), usize)> = shared.into_iter().collect();
        pairs.sort_by_key(|&(pair, nodes)| (std::cmp::Reverse((parts[pair.0].is_labelled, nodes)), pair));
        let mut kept = BTreeMap::new();
        let mut taken: BTreeSet<ObjectId> = used.clone();
        for ((number, id), _) in pairs {
            let is_own = |object: &&Object| {
                object.id == id && object.class == parts[number].class && !names.contains(&object.name)
            };
            if let Some(object) = self.objects.iter().find(is_own)
                && !kept.contains_key(&number)
                && taken.insert(id)
            {
                kept.insert(number, object.clone());
            }
        }
        kept
    }
}
