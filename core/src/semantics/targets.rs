//! What the labels and their spreading teach: random places, and rays of random pixels.

use glam::Vec3;
use rand::seq::{IndexedRandom, IteratorRandom};
use rand::{Rng, SeedableRng, rngs::SmallRng};

use super::{LabelPropagation, NodeVotes, RayTargets, SoftTargets, Surface};
use crate::field::Ray;
use crate::scene::Scene;

impl LabelPropagation {
    /// Random places of the surface with the class probabilities that the graph alone gives them; empty
    /// without labels.
    pub fn soft_targets(&self, count: usize, seed: u64) -> SoftTargets {
        self.targets(count, seed, 0.0, |node| self.graph_probabilities(node))
    }

    /// Random places in the voxels of the surface with the class probabilities of the maps; empty without
    /// labels.
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

    /// Rays through random pixels of all keyframes with the class probabilities of the maps, as if nothing
    /// were known of their lengths: so they are rendered from any pose. Empty without labels.
    pub fn map_rays(&self, scene: &Scene, count: usize, seed: u64) -> RayTargets {
        if !self.is_labelled() {
            return RayTargets::default();
        }
        random_pixels(self.surface(), scene, &scene.keyframes(), count, seed, |node| {
            let own = self.probabilities(node);
            Some((certainty(&own), own))
        })
    }

    /// Rays through random labelled pixels, at most so many, with what the person said.
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
    /// Random places in the voxels with the shares of their votes, each weighted by their number: the
    /// cross-entropy is that with the votes themselves, many of which come at once.
    pub fn targets(&self, surface: &Surface, count: usize, seed: u64) -> SoftTargets {
        random_nodes(surface, count, seed, 0.5 * surface.voxel, |node| {
            self.shares(node)
        })
    }

    /// The same of rays through random pixels of these keyframes, as if nothing were known of their lengths.
    pub fn rays(
        &self,
        surface: &Surface,
        scene: &Scene,
        frames: &[usize],
        count: usize,
        seed: u64,
    ) -> RayTargets {
        random_pixels(surface, scene, frames, count, seed, |node| {
            // A voxel is met by its pixels as often as it has votes.
            self.shares(node).map(|(_, shares)| (1.0, shares))
        })
    }
}

/// What a node teaches: how much it counts, and the class probabilities; `None` where it teaches nothing.
type Lesson = Option<(f32, Vec<f32>)>;

/// Random nodes as targets, each moved by at most `jitter` metres along every axis.
fn random_nodes(
    surface: &Surface,
    count: usize,
    seed: u64,
    jitter: f32,
    lesson: impl Fn(usize) -> Lesson,
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
        if let Some((weight, probabilities)) = lesson(node) {
            targets.positions.push(nodes[node].position + jitter * offset);
            targets.weights.push(weight);
            targets.probabilities.extend(probabilities);
        }
    }
    targets
}

/// Rays of unknown length through random pixels of some keyframes, as far as they show a node that teaches.
fn random_pixels(
    surface: &Surface,
    scene: &Scene,
    frames: &[usize],
    count: usize,
    seed: u64,
    lesson: impl Fn(usize) -> Lesson,
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
        let Some((weight, probabilities)) = node.and_then(|node| lesson(node as usize)) else {
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

/// How sure probabilities are: 1 - entropy / ln C, 0..=1.
fn certainty(probabilities: &[f32]) -> f32 {
    let entropy: f32 = probabilities
        .iter()
        .filter(|&&p| p > 0.0)
        .map(|p| -p * p.ln())
        .sum();
    let most = (probabilities.len().max(2) as f32).ln();
    (1.0 - entropy / most).clamp(0.0, 1.0)
}
