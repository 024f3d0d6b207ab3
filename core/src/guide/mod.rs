//! What to label next: the places of the whole scene whose label would settle most.

mod outline;

use std::collections::BTreeSet;

use glam::Vec3;

use crate::labels::{ClassId, Pixel, VOID};
use crate::scene::Scene;
use crate::semantics::{ENTROPY_STEPS_PER_NAT, NO_NODE, Posterior, Surface, SurfaceGraph};

/// A place whose label would settle much.
#[derive(Clone, Debug, PartialEq)]
pub struct Suggestion {
    /// Index of the frame that shows the place best.
    pub frame: usize,
    /// The pixel to label.
    pub pixel: Pixel,
    /// Outline of the region that the label would settle, a closed polygon in pixel coordinates of the frame.
    pub outline: Vec<[f32; 2]>,
    /// What the label is worth, relative to the best suggestion (1).
    pub score: f32,
    /// Entropy at the place, in nats.
    pub entropy: f32,
    /// Share of all pixels of all frames that the region covers, 0..=1.
    pub share: f32,
    /// The two most likely classes there, the likelier first; fewer where fewer are known.
    pub classes: Vec<ClassId>,
}

/// Most suggestions at a time.
const MOST: usize = 8;
/// A label settles little nearer than this to another, in metres.
const NEAR_A_LABEL: f32 = 0.1;
/// Suggestions keep this far from each other, in metres.
const APART: f32 = 0.4;
/// A region is what is at least this unclear, relative to its centre, and in reach along the surface.
const REGION_LEVEL: f32 = 0.6;
const REGION_NODES: usize = 4000;
/// Share of a place's neighbours that must belong to its region: fewer make a ridge along a border.
const INNER: f32 = 0.7;

/// Ranks the places to label next, best first; `said` are the nodes that strokes lie on.
///
/// The worth of a node is u sqrt(a) min(r / 0.1 m, 1)^2: u = (d1 / d2) sqrt(d1) grows with the distance
/// to the nearest class and with how alike the two nearest are, averaged twice over neighbours; a is
/// the number of pixels that show the node, r the distance to the nearest label.
///
/// With `only`, the places are shown in these frames, and those that none of them shows are left out.
pub fn suggest(
    scene: &Scene,
    surface: &Surface,
    posterior: &Posterior,
    said: &[u32],
    only: Option<&BTreeSet<usize>>,
) -> Vec<Suggestion> {
    let graph = &surface.graph;
    let unclear = unclearness(graph, posterior);
    let labels = LabelPlaces::new(graph, said);
    let mut worth: Vec<f32> = graph
        .nodes()
        .iter()
        .zip(&unclear)
        .map(|(node, u)| {
            let near = (labels.distance(node.position) / NEAR_A_LABEL).min(1.0);
            u * node.pixels.sqrt() * near * near
        })
        .collect();
    for &node in said {
        worth[node as usize] = 0.0;
    }

    let mut order: Vec<u32> = (0..graph.len() as u32)
        .filter(|&node| worth[node as usize] > 0.0)
        .collect();
    order.sort_by(|&a, &b| worth[b as usize].total_cmp(&worth[a as usize]).then(a.cmp(&b)));
    let mut region_of = vec![NO_REGION; graph.len()];
    let mut picks: Vec<u32> = Vec::new();
    for node in order {
        let position = graph.nodes()[node as usize].position;
        let close = picks
            .iter()
            .any(|&pick| graph.nodes()[pick as usize].position.distance(position) < APART);
        if close || region_of[node as usize] != NO_REGION {
            continue;
        }
        let level = REGION_LEVEL * unclear[node as usize];
        let neighbours = graph.edges(node).count().max(1);
        let inner = graph
            .edges(node)
            .filter(|(other, _)| unclear[*other as usize] >= level)
            .count();
        if (inner as f32) < INNER * neighbours as f32 {
            continue;
        }
        grow(graph, &unclear, node, level, picks.len() as u8, &mut region_of);
        picks.push(node);
        if picks.len() == MOST {
            break;
        }
    }
    describe((scene, only), surface, posterior, &picks, &region_of, &worth)
}

/// Not in any region.
const NO_REGION: u8 = u8::MAX;

/// u of every node, averaged twice over neighbours, so that thin ridges vanish.
fn unclearness(graph: &SurfaceGraph, posterior: &Posterior) -> Vec<f32> {
    let mut unclear: Vec<f32> = posterior
        .distances
        .iter()
        .map(
            |&[nearest, second]| match (nearest.is_finite(), second.is_finite()) {
                // Without labels every place is as unclear as any other.
                (false, _) => 1.0,
                (true, false) => nearest.sqrt(),
                (true, true) => nearest / second.max(1e-6) * nearest.sqrt(),
            },
        )
        .collect();
    for _ in 0..2 {
        unclear = (0..graph.len() as u32)
            .map(|node| {
                let (sum, count) = graph
                    .edges(node)
                    .fold((unclear[node as usize], 1.0), |(sum, count), (other, _)| {
                        (sum + unclear[other as usize], count + 1.0)
                    });
                sum / count
            })
            .collect();
    }
    unclear
}

/// Marks the connected nodes around `centre` that are at least `level` unclear.
fn grow(graph: &SurfaceGraph, unclear: &[f32], centre: u32, level: f32, region: u8, region_of: &mut [u8]) {
    let mut open = std::collections::VecDeque::from([centre]);
    region_of[centre as usize] = region;
    let mut count = 1;
    while let Some(node) = open.pop_front() {
        for (other, _) in graph.edges(node) {
            let free = region_of[other as usize] == NO_REGION;
            if free && unclear[other as usize] >= level && count < REGION_NODES {
                region_of[other as usize] = region;
                count += 1;
                open.push_back(other);
            }
        }
    }
}

/// Finds for each pick the frame that shows most of its region, the pixel and the outline there.
fn describe(
    (scene, only): (&Scene, Option<&BTreeSet<usize>>),
    surface: &Surface,
    posterior: &Posterior,
    picks: &[u32],
    region_of: &[u8],
    worth: &[f32],
) -> Vec<Suggestion> {
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
    let best = picks.first().map_or(1.0, |&pick| worth[pick as usize]);
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
            let classes = [
                posterior.labels[pick as usize],
                posterior.runners_up[pick as usize],
            ];
            Some(Suggestion {
                frame,
                pixel,
                outline: outline::trace(camera.width, camera.height, pixel, inside),
                score: worth[pick as usize] / best.max(f32::MIN_POSITIVE),
                entropy: f32::from(posterior.entropy[pick as usize]) / ENTROPY_STEPS_PER_NAT,
                share: covered as f32 / total.max(1) as f32,
                classes: classes.into_iter().filter(|&class| class != VOID).collect(),
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

/// The positions of the labelled nodes in a hash of cells, for the distance to the nearest one nearby.
struct LabelPlaces(rustc_hash::FxHashMap<glam::IVec3, Vec<Vec3>>);

impl LabelPlaces {
    fn new(graph: &SurfaceGraph, said: &[u32]) -> Self {
        let mut cells: rustc_hash::FxHashMap<glam::IVec3, Vec<Vec3>> = rustc_hash::FxHashMap::default();
        for &node in said {
            let position = graph.nodes()[node as usize].position;
            cells.entry(Self::cell(position)).or_default().push(position);
        }
        Self(cells)
    }

    fn cell(position: Vec3) -> glam::IVec3 {
        (position / NEAR_A_LABEL).floor().as_ivec3()
    }

    /// Distance to the nearest label, in metres; at least [`NEAR_A_LABEL`] where none is near.
    fn distance(&self, position: Vec3) -> f32 {
        let cell = Self::cell(position);
        let mut nearest = NEAR_A_LABEL;
        for k in 0..27 {
            let offset = glam::IVec3::new(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
            for place in self.0.get(&(cell + offset)).into_iter().flatten() {
                nearest = nearest.min(place.distance(position));
            }
        }
        nearest
    }
}

#[cfg(test)]
mod tests;
