//! What to label next: the places of the whole scene whose label would settle most.

mod candidates;
mod effect;
mod nearby;
pub(crate) mod outline;

use std::collections::BTreeSet;

use glam::Vec3;
use rayon::prelude::*;

use candidates::{candidates, unclearness, values, visible};
use effect::{Effect, Reach};
use nearby::Nearby;

use crate::labels::{ClassId, Pixel, VOID};
use crate::scene::Scene;
use crate::semantics::{ENTROPY_STEPS_PER_NAT, NO_NODE, Spread};

/// A place whose label would settle much.
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
    /// What the label is worth, relative to the best suggestion (1).
    pub score: f32,
    /// Entropy at the place, in nats.
    pub entropy: f32,
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
    /// What the maps say of it there, 0..=1.
    pub probability: f32,
}

/// Most suggestions at a time.
const MOST: usize = 8;
/// Suggestions keep this far from each other, in metres.
const APART: f32 = 0.4;
/// A label settles little nearer than this to another, in metres.
const NEAR_A_LABEL: f32 = 0.1;
/// Nodes that are visited to find out what labels would change, before it is enough.
const MOST_VISITS: usize = 1_000_000;
/// Candidates whose effects are found out together.
const BLOCK: usize = 32;

/// Ranks the places to label next, best first.
///
/// The worth of a node x is u min(r / 0.1 m, 1)^2 sqrt(e): u is the chance that its most likely class is
/// wrong, averaged twice over neighbours, r the distance in space to the nearest label, and e the effect of
/// a label there: the sum of a k (1 - d / d1) over the nodes that are nearer to x than to every label, d
/// being the distance to x, d1 that to the nearest label, both along the graph, a the number of pixels that
/// show the node, and k the weight of its class, which is larger the fewer pixels the class has.
///
/// Places are shown in keyframes. With `only`, in those of them that are among these frames, and those that none of them shows are left out.
pub fn suggest(scene: &Scene, spread: &Spread, only: Option<&BTreeSet<usize>>) -> Vec<Suggestion> {
    let (surface, posterior, said) = (spread.surface(), spread.posterior(), spread.said());
    let graph = &surface.graph;
    let unclear = unclearness(graph, posterior);
    let values = values(graph, posterior);
    let value = |node: u32| values[node as usize];
    let to_label = |node: u32| posterior.distances[node as usize][0];
    let mut labels = Nearby::new(NEAR_A_LABEL);
    for &node in &said {
        labels.add(graph.nodes()[node as usize].position);
    }
    let away = |node: u32| {
        let distance = labels.distance(graph.nodes()[node as usize].position);
        (distance / NEAR_A_LABEL).powi(2)
    };
    let mut open = visible(surface, only);
    for &node in &said {
        open[node as usize] = false;
    }
    let promise = |node: u32| match open[node as usize] {
        true => unclear[node as usize] * value(node).sqrt() * away(node),
        false => 0.0,
    };

    let mut ranked: Vec<(f32, Effect)> = Vec::new();
    let mut visits = 0;
    // In blocks, so that what is looked at does not depend on the number of threads.
    for block in candidates(graph, &unclear, promise).chunks(BLOCK) {
        let effects: Vec<Effect> = block
            .par_iter()
            .map_init(
                || Reach::new(graph),
                |reach, &node| reach.effect(node, to_label, value),
            )
            .collect();
        visits += effects.iter().map(|effect| effect.visits).sum::<usize>();
        ranked.extend(effects.into_iter().map(|effect| {
            let worth = unclear[effect.node as usize] * away(effect.node) * effect.size.sqrt();
            (worth, effect)
        }));
        if visits > MOST_VISITS {
            break;
        }
    }
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.node.cmp(&b.1.node)));

    let position = |node: u32| graph.nodes()[node as usize].position;
    let mut region_of = vec![NO_REGION; graph.len()];
    let mut picks: Vec<(f32, u32)> = Vec::new();
    for (worth, effect) in ranked {
        let close = |&(_, pick): &(f32, u32)| position(pick).distance(position(effect.node)) < APART;
        if region_of[effect.node as usize] != NO_REGION || picks.iter().any(close) {
            continue;
        }
        for &node in &effect.settled {
            let region = &mut region_of[node as usize];
            if *region == NO_REGION {
                *region = picks.len() as u8;
            }
        }
        picks.push((worth, effect.node));
        if picks.len() == MOST {
            break;
        }
    }
    describe((scene, only), spread, &picks, &region_of)
}

/// Not in any region.
const NO_REGION: u8 = u8::MAX;

/// Finds for each pick the frame that shows most of its region, the pixel and the outline there.
fn describe(
    (scene, only): (&Scene, Option<&BTreeSet<usize>>),
    spread: &Spread,
    picks: &[(f32, u32)],
    region_of: &[u8],
) -> Vec<Suggestion> {
    let surface = spread.surface();
    let total: usize = surface.pixels.iter().map(|pixels| pixels.len()).sum();
    // Pixels of each region in each frame, and whether the pick itself is seen there.
    let mut counts = vec![vec![(0_usize, false); picks.len()]; surface.pixels.len()];
    for (counts, pixels) in counts.iter_mut().zip(&surface.pixels) {
        for (node, run) in pixels.runs().filter(|&(node, _)| node != NO_NODE) {
            let region = region_of[node as usize];
            if region != NO_REGION {
                let entry = &mut counts[region as usize];
                entry.0 += run.len();
                entry.1 |= picks[region as usize].1 == node;
            }
        }
    }
    let best = picks.first().map_or(1.0, |&(worth, _)| worth);
    picks
        .iter()
        .enumerate()
        .filter_map(|(region, &(worth, pick))| {
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
                score: worth / best.max(f32::MIN_POSITIVE),
                entropy: f32::from(spread.posterior().entropy[pick as usize]) / ENTROPY_STEPS_PER_NAT,
                share: covered as f32 / total.max(1) as f32,
                classes: likely(spread, pick),
            })
        })
        .collect()
}

/// The two most likely classes of a node, as far as they are known. The posterior keeps the probability of the first
/// alone; that of the second is worth computing anew for the few places that are suggested.
fn likely(spread: &Spread, node: u32) -> Vec<Likely> {
    let posterior = spread.posterior();
    let known = [
        posterior.labels[node as usize],
        posterior.runners_up[node as usize],
    ];
    let probabilities = spread.probabilities(node as usize);
    let of_class = |class: ClassId| spread.classes().iter().position(|&other| other == class);
    known
        .into_iter()
        .filter(|&class| class != VOID)
        .filter_map(|class| {
            let probability = probabilities[of_class(class)?];
            Some(Likely { class, probability })
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
