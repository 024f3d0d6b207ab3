//! Training targets for the semantic field: random points of the surface, and rays of random pixels.

use glam::Vec3;
use rand::seq::{IndexedRandom, IteratorRandom};
use rand::{Rng, SeedableRng, rngs::SmallRng};

use super::{LabelPropagation, NodeVotes, RayTargets, SoftTargets, Surface};
use crate::field::Ray;
use crate::scene::Scene;

impl LabelPropagation {
    /// Random points of the surface with their class probabilities by the graph alone; empty without labels.
    pub fn soft_targets(&self, count: usize, seed: u64) -> SoftTargets {
        self.targets(count, seed, 0.0, |node| self.graph_probabilities(node))
    }

    /// Random points in the voxels of the surface with the class probabilities of the maps; empty without labels.
    pub fn map_targets(&self, count: usize, seed: u64) -> SoftTargets {
        let half = 0.5 * self.surface().voxel;
        self.targets(count, seed, half, |node| self.probabilities(node))
    }

    fn targets(
        &self,
        count: usize,
        seed: u64,
        jitter: f32,
        probabilities: impl Fn(usize) -> Vec<f32>,
    ) -> SoftTargets {
        if !self.is_labelled() {
            return SoftTargets::default();
        }
        let with_certainty = |node| {
            let own = probabilities(node);
            Some((certainty(&own), own))
        };
        random_nodes(self.surface(), count, seed, jitter, with_certainty)
    }

    /// Rays through random pixels of all keyframes with the class probabilities of the maps. They have no length, so
    /// that they are rendered like those of any pose. Empty without labels.
    pub fn map_rays(&self, scene: &Scene, count: usize, seed: u64) -> RayTargets {
        if !self.is_labelled() {
            return RayTargets::default();
        }
        random_pixels(self.surface(), scene, &scene.keyframes(), count, seed, |node| {
            let own = self.probabilities(node);
            Some((certainty(&own), own))
        })
    }

    /// Rays through at most `count` random labelled pixels, with the class of the stroke.
    pub fn labelled_rays(&self, scene: &Scene, count: usize, seed: u64) -> RayTargets {
        let mut rng = SmallRng::seed_from_u64(seed);
        let mut targets = RayTargets::default();
        for (frame, pixel, class) in self.labelled_pixels().choose_multiple(&mut rng, count) {
            if !self.classes().contains(&class) {
                continue;
            }
            let said = self.classes().iter().map(|&known| f32::from(known == class));
            targets.probabilities.extend(said);
            targets.weights.push(1.0);
            targets
                .rays
                .push(Ray::through(&scene.frames[frame], pixel as usize));
        }
        targets
    }
}

impl NodeVotes {
    /// Random points in the voxels with the shares of their votes, weighted by the number of votes. The cross-entropy
    /// is then that with all the single votes.
    pub fn targets(&self, surface: &Surface, count: usize, seed: u64) -> SoftTargets {
        random_nodes(surface, count, seed, 0.5 * surface.voxel, |node| {
            self.shares(node)
        })
    }

    /// The same for rays without length through random pixels of these keyframes.
    pub fn rays(
        &self,
        surface: &Surface,
        scene: &Scene,
        frames: &[usize],
        count: usize,
        seed: u64,
    ) -> RayTargets {
        random_pixels(surface, scene, frames, count, seed, |node| {
            // Rays hit a voxel in proportion to its votes already, so that they need no weight.
            self.shares(node).map(|(_, shares)| (1.0, shares))
        })
    }
}

/// The training target of a node: its weight, and the class probabilities; `None` where it has none.
type NodeTarget = Option<(f32, Vec<f32>)>;

/// Random nodes as targets, each moved by at most `jitter` metres along every axis.
fn random_nodes(
    surface: &Surface,
    count: usize,
    seed: u64,
    jitter: f32,
    target: impl Fn(usize) -> NodeTarget,
) -> SoftTargets {
    let mut targets = SoftTargets::default();
    let nodes = surface.graph.nodes();
    if nodes.is_empty() {
        return targets;
    }
    let mut rng = SmallRng::seed_from_u64(seed);
    for _ in 0..count {
        let node = rng.random_range(0..nodes.len());
        let offset = Vec3::from([(); 3].map(|()| rng.random_range(-1.0..=1.0)));
        if let Some((weight, probabilities)) = target(node) {
            targets.positions.push(nodes[node].position + jitter * offset);
            targets.weights.push(weight);
            targets.probabilities.extend(probabilities);
        }
    }
    targets
}

/// Rays without length through random pixels of some keyframes, as far as their node has a target.
fn random_pixels(
    surface: &Surface,
    scene: &Scene,
    frames: &[usize],
    count: usize,
    seed: u64,
    target: impl Fn(usize) -> NodeTarget,
) -> RayTargets {
    let mut targets = RayTargets::default();
    let mut rng = SmallRng::seed_from_u64(seed ^ 0x7a45);
    for _ in 0..count {
        let Some(&number) = frames.choose(&mut rng) else {
            break;
        };
        let frame = &scene.frames[number];
        let pixel = rng.random_range(0..frame.camera.pixels());
        let node = surface.pixels[number].node(pixel);
        let Some((weight, probabilities)) = node.and_then(|node| target(node as usize)) else {
            continue;
        };
        targets.rays.push(Ray {
            length: None,
            ..Ray::through(frame, pixel)
        });
        targets.weights.push(weight);
        targets.probabilities.extend(probabilities);
    }
    targets
}

/// Certainty of probabilities: 1 - entropy / ln C, 0..=1.
fn certainty(probabilities: &[f32]) -> f32 {
    let entropy: f32 = probabilities
        .iter()
        .filter(|&&p| p > 0.0)
        .map(|p| -p * p.ln())
        .sum();
    let most = (probabilities.len().max(2) as f32).ln();
    (1.0 - entropy / most).clamp(0.0, 1.0)
}
