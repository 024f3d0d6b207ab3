//! Candidates for the places to label next.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use crate::labels::ClassId;
use crate::semantics::{CERTAIN, NO_NODE, Posterior, Surface, SurfaceGraph};

/// Most candidates, the number of nodes that they are chosen from, and their smallest distance to each other, in
/// metres.
const MOST: usize = 250;
const PROMISING: usize = 40_000;
const APART: f32 = 0.2;
/// Share of a place's neighbours that must be at least this unclear, relative to it: fewer make a ridge
/// along a border.
const INNER: f32 = 0.7;
const RIDGE_LEVEL: f32 = 0.6;
/// Lower bound on the chance that a class is wrong, so that there is a next place when all seems clear.
pub(super) const LEAST_DOUBT: f32 = 1e-4;
/// A pixel counts with this power of the number of all pixels over those of its class: at 0 all pixels count the same,
/// at 1 all classes do.
const CLASS_POWER: f32 = 0.5;

/// The chance that the most likely class of each node is wrong, averaged twice over neighbours, so that thin
/// ridges vanish.
pub(super) fn unclearness(graph: &SurfaceGraph, posterior: &Posterior) -> Vec<f32> {
    let mut unclear: Vec<f32> = posterior
        .confidence
        .iter()
        .map(|&confidence| (1.0 - f32::from(confidence) / f32::from(CERTAIN)).max(LEAST_DOUBT))
        .collect();
    for _ in 0..2 {
        unclear = (0..graph.len() as u32)
            .into_par_iter()
            .map(|node| {
                let own = (unclear[node as usize], 1.0);
                let (sum, count) = graph.edges(node).fold(own, |(sum, count), (other, _)| {
                    (sum + unclear[other as usize], count + 1.0)
                });
                sum / count
            })
            .collect();
    }
    unclear
}

/// The weight of a pixel of each of these classes: larger, the fewer pixels the class has.
pub(super) fn class_weights(graph: &SurfaceGraph, posterior: &Posterior, classes: &[ClassId]) -> Vec<f32> {
    let mut pixels: BTreeMap<ClassId, f32> = BTreeMap::new();
    for (node, label) in graph.nodes().iter().zip(&posterior.labels) {
        *pixels.entry(*label).or_default() += node.pixels;
    }
    let all: f32 = pixels.values().sum();
    // A class with few pixels may be a mistake: its weight is that of a thousandth of all pixels at most.
    let weight = |class: &ClassId| {
        let own = pixels.get(class).copied().unwrap_or(0.0).max(1e-3 * all);
        (all / own.max(f32::MIN_POSITIVE)).powf(CLASS_POWER)
    };
    classes.iter().map(weight).collect()
}

/// Whether each node is seen in any of the frames that places may be shown in.
pub(super) fn visible(surface: &Surface, only: Option<&BTreeSet<usize>>) -> Vec<bool> {
    let Some(only) = only else {
        return vec![true; surface.graph.len()];
    };
    let mut visible = vec![false; surface.graph.len()];
    for pixels in only.iter().filter_map(|&frame| surface.pixels.get(frame)) {
        for (node, _) in pixels.runs().filter(|&(node, _)| node != NO_NODE) {
            visible[node as usize] = true;
        }
    }
    visible
}

/// Of the nodes with the largest promise, those that lie apart and on no ridge, the largest promise times `away` first;
/// nodes without promise are left out.
pub(super) fn candidates(
    graph: &SurfaceGraph,
    unclear: &[f32],
    promise: impl Fn(u32) -> f32 + Sync,
    away: impl Fn(u32) -> f32 + Sync,
) -> Vec<u32> {
    let mut order: Vec<(f32, u32)> = (0..graph.len() as u32)
        .into_par_iter()
        .map(|node| (promise(node), node))
        .filter(|&(promise, _)| promise > 0.0)
        .collect();
    let better = |a: &(f32, u32), b: &(f32, u32)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
    if order.len() > PROMISING {
        order.select_nth_unstable_by(PROMISING, better);
        order.truncate(PROMISING);
    }
    order
        .par_iter_mut()
        .for_each(|(promise, node)| *promise *= away(*node));
    order.par_sort_unstable_by(better);
    let position = |node: u32| graph.nodes()[node as usize].position;
    let mut candidates: Vec<u32> = Vec::with_capacity(MOST);
    for (_, node) in order {
        let is_close = |&other: &u32| position(other).distance(position(node)) < APART;
        if candidates.iter().any(is_close) || is_ridge(graph, unclear, node) {
            continue;
        }
        candidates.push(node);
        if candidates.len() == MOST {
            break;
        }
    }
    candidates
}

/// Whether too few of a node's neighbours are about as unclear as the node.
fn is_ridge(graph: &SurfaceGraph, unclear: &[f32], node: u32) -> bool {
    let level = RIDGE_LEVEL * unclear[node as usize];
    let (inner, all) = graph.edges(node).fold((0, 0), |(inner, all), (other, _)| {
        (inner + usize::from(unclear[other as usize] >= level), all + 1)
    });
    (inner as f32) < INNER * all as f32
}
