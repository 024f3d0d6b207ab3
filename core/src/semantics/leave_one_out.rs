//! Leave-one-out checks of the strokes: the class that a stroke's pixels would have if it were not there.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use rustc_hash::FxHashMap;

use super::likeness::LabelledRegions;
use super::posterior::label_at;
use super::{ClassGeodesics, Geodesics, Surface};
use crate::labels::{ClassId, Stroke, StrokeId, VOID, pixels_of};
use crate::scene::Scene;

/// The check of one stroke against all the others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrokeCheck {
    /// The stroke.
    pub stroke: StrokeId,
    /// Its class according to the others: its own, unless they contradict most of its pixels; then the class that most
    /// of those would get.
    pub class: ClassId,
    /// Share of its pixels that would get another class from the others, 0..=1.
    pub contradicting: f32,
}

impl StrokeCheck {
    /// Whether the others contradict most of the stroke.
    pub fn is_contradicted(&self) -> bool {
        self.contradicting > 0.5
    }
}

/// The strokes checked against each other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LeaveOneOut {
    /// One check for each stroke that can be checked, in the order of the strokes. Left out are void strokes, strokes
    /// whose pixels show no node, and the only stroke of a class: the others cannot predict a class that they lack.
    pub strokes: Vec<StrokeCheck>,
    /// Mean over the classes of the share of their strokes that are not contradicted, so that a class with many
    /// easy strokes does not hide one whose strokes are all wrong; `None` where nothing can be checked.
    pub accuracy: Option<f32>,
}

/// The two latest strokes on a pixel. Without the top one, the pixel belongs to the one below.
#[derive(Clone, Copy, Debug)]
struct Layers {
    top: (StrokeId, ClassId),
    below: Option<(StrokeId, ClassId)>,
}

/// The labels on a surface at one time, to be checked in the background.
#[derive(Clone, Debug)]
pub struct CrossValidation {
    pub(super) scene: Arc<Scene>,
    pub(super) surface: Arc<Surface>,
    pub(super) classes: Vec<ClassId>,
    pub(super) strokes: BTreeMap<StrokeId, Arc<Stroke>>,
    /// The nodes where each slipped over an edge, ascending.
    pub(super) strays: BTreeMap<StrokeId, Vec<u32>>,
    pub(super) geodesics: ClassGeodesics,
    /// The classes of nodes by trusted label images.
    pub(super) imported: FxHashMap<u32, ClassId>,
    /// The regions with labels, where looks count.
    pub(super) labelled: Option<LabelledRegions>,
    /// Class probabilities by label images that may be wrong, `[nodes, classes]`.
    pub(super) votes: Option<Arc<[f32]>>,
}

type NodesByClass = BTreeMap<ClassId, Vec<u32>>;

/// The nodes of a stroke, and how the seeds would change without it.
#[derive(Debug, Default)]
struct Absence {
    /// The node of each of its pixels, as far as they show one.
    nodes: Vec<u32>,
    /// Nodes that lose a class.
    removed: NodesByClass,
    /// Nodes that get the class of what it covers.
    added: NodesByClass,
}

/// What the labels say, with or without a stroke.
struct Known {
    fields: BTreeMap<ClassId, Arc<Geodesics>>,
    labelled: Option<LabelledRegions>,
}

impl Known {
    /// Replaces some labelled nodes by others.
    fn replace(&mut self, surface: &Surface, removed: &NodesByClass, added: &NodesByClass) {
        let (graph, look) = (&surface.graph, &surface.look);
        for (&class, nodes) in removed {
            if let Some(field) = self.fields.get_mut(&class) {
                Arc::make_mut(field).remove(graph, nodes);
            }
            if let Some(labelled) = &mut self.labelled {
                nodes
                    .iter()
                    .for_each(|&node| labelled.remove(class, look.region(node as usize)));
            }
        }
        for (&class, nodes) in added {
            let field = self.fields.entry(class);
            let field = field.or_insert_with(|| Arc::new(Geodesics::new(graph.len())));
            Arc::make_mut(field).add(graph, nodes);
            if let Some(labelled) = &mut self.labelled {
                nodes
                    .iter()
                    .for_each(|&node| labelled.add(class, look.region(node as usize)));
            }
        }
    }
}

impl CrossValidation {
    /// Leaves out one stroke at a time. The results are exactly those of propagating the other labels anew, by graph, labelled
    /// regions and imported label images alone: semantic prior and likely regions have learnt from the stroke itself. Only the
    /// nodes that a stroke owned are visited again, so that checking all strokes costs about as much as propagating all
    /// labels twice, however many there are. `None` when `cancelled` was set in the meantime.
    pub fn run(self, cancelled: &AtomicBool) -> Option<LeaveOneOut> {
        let mut seeds: BTreeMap<ClassId, usize> = BTreeMap::new();
        for label in self.geodesics.seeds().values() {
            *seeds.entry(label.class).or_default() += 1;
        }
        if seeds.len() < 2 && self.votes.is_none() {
            // With one class alone there is nothing to contradict.
            return Some(LeaveOneOut::default());
        }
        let absences = self.absences(cancelled)?;
        let mut known = Known {
            fields: self.geodesics.classes().clone(),
            labelled: self.labelled.clone(),
        };
        let mut checks = Vec::new();
        for (id, absence) in absences {
            if cancelled.load(Ordering::Relaxed) {
                return None;
            }
            let Some(own) = self.strokes.get(&id).map(|stroke| stroke.class) else {
                continue;
            };
            let lost = absence.removed.get(&own).map_or(0, Vec::len);
            let told = seeds.get(&own).copied().unwrap_or(0) > lost;
            if told || self.votes.is_some() {
                checks.extend(self.check(&mut known, (id, own), &absence));
            }
        }
        Some(LeaveOneOut {
            accuracy: self.accuracy(&checks),
            strokes: checks,
        })
    }

    fn check(
        &self,
        known: &mut Known,
        (stroke, own): (StrokeId, ClassId),
        absence: &Absence,
    ) -> Option<StrokeCheck> {
        known.replace(&self.surface, &absence.removed, &absence.added);
        let check = self.read(known, (stroke, own), &absence.nodes);
        known.replace(&self.surface, &absence.added, &absence.removed);
        check
    }

    /// The check of a stroke by what is known without it; `None` where that reaches none of its nodes.
    fn read(&self, known: &Known, (stroke, own): (StrokeId, ClassId), nodes: &[u32]) -> Option<StrokeCheck> {
        let in_order: Vec<Option<&[f32]>> = self
            .classes
            .iter()
            .map(|class| known.fields.get(class).map(|field| field.distances()))
            .collect();
        let mut counts: BTreeMap<ClassId, usize> = BTreeMap::new();
        let look = &self.surface.look;
        // By region: a stroke has many nodes in few of them.
        let mut stretches: BTreeMap<u32, Vec<f32>> = BTreeMap::new();
        for &node in nodes {
            let node = node as usize;
            let own = known.labelled.as_ref().map(|labelled| {
                let region = look.region(node);
                let stretch = |&class: &ClassId| labelled.stretch(look, class, region);
                let of_region = || self.classes.iter().map(stretch).collect();
                stretches.entry(region).or_insert_with(of_region).as_slice()
            });
            let class = label_at(&in_order, &self.classes, node, own, self.votes.as_deref());
            if class != VOID {
                *counts.entry(class).or_default() += 1;
            }
        }
        let predicted: usize = counts.values().sum();
        if predicted == 0 {
            return None;
        }
        let right = counts.remove(&own).unwrap_or(0);
        let contradicting = (predicted - right) as f32 / predicted as f32;
        // The first of several classes with as many pixels.
        let other = counts
            .iter()
            .max_by_key(|&(&class, &count)| (count, std::cmp::Reverse(class)));
        let other = other.map_or(own, |(&class, _)| class);
        Some(StrokeCheck {
            stroke,
            class: if contradicting > 0.5 { other } else { own },
            contradicting,
        })
    }

    /// What would change without each stroke that is not void.
    fn absences(&self, cancelled: &AtomicBool) -> Option<BTreeMap<StrokeId, Absence>> {
        let mut of_node: FxHashMap<u32, Vec<Layers>> = FxHashMap::default();
        let mut absences: BTreeMap<StrokeId, Absence> = BTreeMap::new();
        for (frame, pixels) in self.layers(cancelled)? {
            let indices: Vec<u32> = pixels.keys().copied().collect();
            let nodes = self.surface.nodes_at(frame, &indices);
            for (layers, node) in pixels.into_values().zip(nodes) {
                let Some(node) = node else {
                    continue;
                };
                of_node.entry(node).or_default().push(layers);
                if layers.top.1 != VOID {
                    absences.entry(layers.top.0).or_default().nodes.push(node);
                }
            }
        }
        for (&node, layers) in &of_node {
            // The stroke and its class, if it labels the node.
            let says = |(id, class): (StrokeId, ClassId)| {
                let is_stray = (self.strays.get(&id)).is_some_and(|nodes| nodes.binary_search(&node).is_ok());
                (class != VOID && !is_stray).then_some((id, class))
            };
            let class_by = |latest: Option<(StrokeId, ClassId)>| {
                latest
                    .map(|(_, class)| class)
                    .or(self.imported.get(&node).copied())
            };
            let tops = || layers.iter().map(|layers| layers.top);
            let before = class_by(tops().filter_map(says).max());
            let strokes: BTreeSet<StrokeId> = tops().filter(|top| top.1 != VOID).map(|top| top.0).collect();
            for stroke in strokes {
                let rest = layers.iter().filter_map(|layers| match layers.top {
                    (top, _) if top == stroke => layers.below,
                    top => Some(top),
                });
                let after = class_by(rest.filter_map(says).max());
                if after == before {
                    continue;
                }
                let absence = absences.entry(stroke).or_default();
                if let Some(class) = before {
                    absence.removed.entry(class).or_default().push(node);
                }
                if let Some(class) = after {
                    absence.added.entry(class).or_default().push(node);
                }
            }
        }
        Some(absences)
    }

    /// The two latest strokes of every painted pixel of each frame.
    fn layers(&self, cancelled: &AtomicBool) -> Option<BTreeMap<usize, BTreeMap<u32, Layers>>> {
        let mut frames: BTreeMap<usize, BTreeMap<u32, Layers>> = BTreeMap::new();
        for (&id, stroke) in &self.strokes {
            if cancelled.load(Ordering::Relaxed) {
                return None;
            }
            let Some(camera) = self.scene.frames.get(stroke.frame).map(|frame| &frame.camera) else {
                continue;
            };
            let painted = frames.entry(stroke.frame).or_default();
            for pixel in pixels_of(stroke, camera.width, camera.height) {
                let below = painted.get(&pixel).map(|layers| layers.top);
                let top = (id, stroke.class);
                painted.insert(pixel, Layers { top, below });
            }
        }
        Some(frames)
    }

    fn accuracy(&self, checks: &[StrokeCheck]) -> Option<f32> {
        let mut of_class: BTreeMap<ClassId, (f32, f32)> = BTreeMap::new();
        for check in checks {
            if let Some(stroke) = self.strokes.get(&check.stroke) {
                let (right, all) = of_class.entry(stroke.class).or_default();
                *right += f32::from(u8::from(!check.is_contradicted()));
                *all += 1.0;
            }
        }
        let sum: f32 = of_class.values().map(|(right, all)| right / all).sum();
        (!of_class.is_empty()).then(|| sum / of_class.len() as f32)
    }
}

#[cfg(test)]
mod tests;
