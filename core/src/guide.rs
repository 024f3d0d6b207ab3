//! What to label next: the places of the whole scene whose label would tell most; and audits of how right the maps are.

pub mod audit;
mod candidates;
mod effect;
pub(crate) mod outline;

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{self, AtomicBool};

use glam::Vec3;
use rayon::prelude::*;

use candidates::{candidates, class_weights, unclearness, visible};
use effect::{Context, Effect, EffectSearch};

use crate::labels::{ClassId, ObjectId, Pixel, VOID};
use crate::scene::Scene;
use crate::semantics::{LabelPropagation, NO_NODE, NodeCells, Weights};

/// A place to label next.
#[derive(Clone, Debug, PartialEq)]
pub struct Suggestion {
    /// Index of the keyframe that shows the place best.
    pub frame: usize,
    /// The pixel to label.
    pub pixel: Pixel,
    /// Where the place is, in world coordinates, in metres.
    pub position: Vec3,
    /// Outline of the region that the label would settle, a closed polygon in pixel coordinates of the frame.
    pub outline: Vec<[f32; 2]>,
    /// Share of all pixels of all keyframes that the region covers, 0..=1.
    pub share: f32,
    /// The two most likely classes there, the likelier first; fewer where fewer are known.
    pub classes: Vec<Likely>,
}

/// A class that a place may have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Likely {
    /// The class; never void.
    pub class: ClassId,
    /// Its probability in the maps, 0..=1.
    pub probability: f32,
    /// The object that the nearest label of the class says, where it says one.
    pub object: Option<ObjectId>,
}

/// Most suggestions at a time.
const MOST: usize = 8;
/// Suggestions keep this far from each other, in metres.
const APART: f32 = 0.4;
/// Nearer than this to a label, in metres, another one tells little.
const NEAR_A_LABEL: f32 = 0.1;
/// Number of nodes to visit to compute effects; after that, no more candidates are considered.
const MOST_VISITS: usize = 250_000;
/// Candidates whose effects are computed together.
const BLOCK: usize = 32;

/// Ranks the places to label next, best first.
///
/// The score of a node x is min(r / 0.1 m, 1)^2 v. Here r is the distance in space to the nearest label, and v the value of
/// the information that a label there would give: the number of pixels that are expected to become right, class by
/// class by how likely x has it, each pixel weighted by its class, more the fewer pixels the class has. The maps
/// are too sure of what looks like the room and of what a pretrained network sees alike. So places are judged as if no class
/// were part of the room, and by the mean of what is likely with and without the network.
///
/// Places are shown in keyframes; with `only`, in the keyframes among these frames. A place that none of them shows is
/// left out. `None` where it is cancelled before the end.
pub fn suggest(
    scene: &Scene,
    propagation: &LabelPropagation,
    only: Option<&BTreeSet<usize>>,
    cancelled: &AtomicBool,
) -> Option<Vec<Suggestion>> {
    let (surface, said) = (propagation.surface(), propagation.said());
    let graph = &surface.graph;
    let doubted = propagation.doubted();
    let (evidence, posterior) = match &doubted {
        Some((likeness, posterior)) => (propagation.doubted_evidence(likeness), posterior),
        None => (propagation.evidence(), propagation.posterior()),
    };
    let unclear = unclearness(graph, posterior);
    let weights = class_weights(graph, posterior, propagation.classes());
    let weight_of: BTreeMap<ClassId, f32> = propagation
        .classes()
        .iter()
        .copied()
        .zip(weights.iter().copied())
        .collect();
    let value = |node: usize| {
        let weight = weight_of.get(&posterior.labels[node]).copied().unwrap_or(1.0);
        graph.nodes()[node].pixels * weight
    };
    let position = |node: u32| graph.nodes()[node as usize].position;
    let mut open = visible(surface, only);
    for &node in &said {
        open[node as usize] = false;
    }
    let labels = NodeCells::new(graph.nodes(), said, 2.0 * NEAR_A_LABEL);
    let away = |node: u32| {
        let nearest = labels.nearest(graph.nodes(), position(node), NEAR_A_LABEL);
        let distance = nearest.map_or(NEAR_A_LABEL, |label| position(label).distance(position(node)));
        (distance / NEAR_A_LABEL).powi(2)
    };
    let promise = |node: u32| match open[node as usize] {
        true => unclear[node as usize] * value(node as usize).sqrt(),
        false => 0.0,
    };

    let known = Context {
        graph,
        evidence,
        posterior,
        class_weights: &weights,
    };
    let ranked_after = |picks: usize, effect: Effect| Ranked {
        score: away(effect.node) * effect.value,
        effect,
        picks,
    };
    let mut ranked: Vec<Ranked> = Vec::new();
    let mut visits = 0;
    // In blocks, so that the result does not depend on the number of threads.
    for block in candidates(graph, &unclear, promise, away).chunks(BLOCK) {
        let effect = |search: &mut EffectSearch<'_>, &node: &u32| {
            let is_wanted = !cancelled.load(atomic::Ordering::Relaxed);
            is_wanted.then(|| search.effect(node, |_| true))
        };
        let effects = block.par_iter().map_init(|| EffectSearch::new(known), effect);
        let effects: Vec<Effect> = effects.collect::<Option<_>>()?;
        visits += effects.iter().map(|effect| effect.visits).sum::<usize>();
        ranked.extend(effects.into_iter().map(|effect| ranked_after(0, effect)));
        if visits > MOST_VISITS {
            break;
        }
    }

    // Of places whose labels would settle the same, the second is worth only what the first leaves. Values only fall, so that
    // those of a few have to be computed anew (lazy greedy, Minoux 1978).
    let mut region_of = vec![NO_REGION; graph.len()];
    let mut picks: Vec<u32> = Vec::new();
    let mut search = EffectSearch::new(known);
    while picks.len() < MOST
        && let Some(best) = (0..ranked.len()).max_by(|&a, &b| ranked[a].compare(&ranked[b]))
    {
        let Ranked {
            effect, picks: known, ..
        } = ranked.swap_remove(best);
        let close = |&pick: &u32| position(pick).distance(position(effect.node)) < APART;
        if region_of[effect.node as usize] != NO_REGION || picks.iter().any(close) {
            continue;
        }
        if known < picks.len() {
            if cancelled.load(atomic::Ordering::Relaxed) {
                return None;
            }
            let effect = search.effect(effect.node, |node| region_of[node as usize] == NO_REGION);
            ranked.push(ranked_after(picks.len(), effect));
            continue;
        }
        for &node in &effect.settled {
            region_of[node as usize] = picks.len() as u8;
        }
        picks.push(effect.node);
    }
    Some(describe((scene, only), propagation, &picks, &region_of))
}

/// A candidate with its score.
struct Ranked {
    score: f32,
    effect: Effect,
    /// How many picks the score takes into account.
    picks: usize,
}

impl Ranked {
    /// By the score; of equal ones the first node is greater.
    fn compare(&self, other: &Self) -> Ordering {
        let by_score = self.score.total_cmp(&other.score);
        by_score.then(other.effect.node.cmp(&self.effect.node))
    }
}

/// Not in any region.
const NO_REGION: u8 = u8::MAX;

/// Finds for each pick the frame that shows most of its region, the pixel and the outline there.
fn describe(
    (scene, only): (&Scene, Option<&BTreeSet<usize>>),
    propagation: &LabelPropagation,
    picks: &[u32],
    region_of: &[u8],
) -> Vec<Suggestion> {
    let surface = propagation.surface();
    let total: usize = surface.pixels.iter().map(|pixels| pixels.len()).sum();
    // Pixels of each region in each frame, and whether the pick itself is seen there.
    let mut counts = vec![vec![(0_usize, false); picks.len()]; surface.pixels.len()];
    for (counts, pixels) in counts.iter_mut().zip(&surface.pixels) {
        for (node, run) in pixels.runs().filter(|&(node, _)| node != NO_NODE) {
            let region = region_of[node as usize];
            if region != NO_REGION {
                let entry = &mut counts[region as usize];
                entry.0 += run.len();
                entry.1 |= picks[region as usize] == node;
            }
        }
    }
    picks
        .iter()
        .enumerate()
        .filter_map(|(region, &pick)| {
            let allowed = |frame: &usize| only.is_none_or(|only| only.contains(frame));
            let seen = (0..counts.len()).filter(|&frame| allowed(&frame) && counts[frame][region].1);
            let frame = seen.max_by_key(|&frame| (counts[frame][region].0, std::cmp::Reverse(frame)))?;
            let camera = &scene.frames[frame].camera;
            let pixels = surface.pixels[frame].unpack();
            let pixel = middle_pixel(&pixels, pick, camera.width)?;
            let inside = |x: u32, y: u32| {
                let node = pixels[(y * camera.width + x) as usize];
                node != NO_NODE && region_of[node as usize] == region as u8
            };
            let covered: usize = counts.iter().map(|counts| counts[region].0).sum();
            Some(Suggestion {
                frame,
                pixel,
                position: surface.graph.nodes()[pick as usize].position,
                outline: outline::trace(camera.width, camera.height, pixel, inside),
                share: covered as f32 / total.max(1) as f32,
                classes: likely(propagation, pick),
            })
        })
        .collect()
}

/// The two most likely classes of a node, as far as they are known. The posterior keeps only the first one's
/// probability; the second's is computed anew for the few places that are suggested.
fn likely(propagation: &LabelPropagation, node: u32) -> Vec<Likely> {
    let posterior = propagation.posterior();
    let known = [
        posterior.labels[node as usize],
        posterior.runners_up[node as usize],
    ];
    let evidence = propagation.evidence();
    let (probabilities, weights) = (evidence.probabilities(node as usize), Weights::new(evidence));
    let of_class = |class: ClassId| propagation.classes().iter().position(|&other| other == class);
    known
        .into_iter()
        .filter(|&class| class != VOID)
        .filter_map(|class| {
            let probability = probabilities[of_class(class)?];
            Some(Likely {
                class,
                probability,
                object: weights.object(node, class),
            })
        })
        .collect()
}

/// The pixel of a node nearest to the middle of its pixels.
fn middle_pixel(pixels: &[u32], node: u32, width: u32) -> Option<Pixel> {
    let own: Vec<Pixel> = (0..pixels.len() as u32)
        .filter(|&pixel| pixels[pixel as usize] == node)
        .map(|pixel| [pixel % width, pixel / width])
        .collect();
    let count = own.len().max(1) as f32;
    let middle = own.iter().fold([0.0, 0.0], |[x, y], pixel| {
        [x + pixel[0] as f32 / count, y + pixel[1] as f32 / count]
    });
    let gap = |pixel: &Pixel| (pixel[0] as f32 - middle[0]).powi(2) + (pixel[1] as f32 - middle[1]).powi(2);
    own.into_iter().min_by(|a, b| gap(a).total_cmp(&gap(b)))
}

#[cfg(test)]
mod tests;
