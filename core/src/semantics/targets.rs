//! Training targets for the semantic field: random points of the surface, and rays of random pixels.

use glam::Vec3;
use rand::seq::{IndexedRandom, IteratorRandom};
use rand::{Rng, SeedableRng, rngs::SmallRng};

use super::{Evidence, LabelPropagation, RayTargets, SoftTargets};
use crate::field::Ray;
use crate::scene::Scene;

impl LabelPropagation {
    /// Random points of the surface with their class probabilities by the graph alone; empty without labels.
    pub fn soft_targets(&self, count: usize, seed: u64) -> SoftTargets {
        let evidence = self.evidence();
        let by_graph = Evidence {
            prior: None,
            ..evidence
        };
        self.targets(count, seed, 0.0, &by_graph)
    }

    /// Random points in the voxels of the surface with the class probabilities of the maps; empty without labels.
    pub fn map_targets(&self, count: usize, seed: u64) -> SoftTargets {
        self.targets(count, seed, 0.5 * self.surface().voxel, &self.evidence())
    }

    /// Random nodes as targets, each moved by at most `jitter` metres along every axis.
    fn targets(&self, count: usize, seed: u64, jitter: f32, evidence: &Evidence<'_>) -> SoftTargets {
        let mut targets = SoftTargets::default();
        let nodes = self.surface().graph.nodes();
        if !self.is_labelled() || nodes.is_empty() {
            return targets;
        }
        let mut rng = SmallRng::seed_from_u64(seed);
        for _ in 0..count {
            let node = rng.random_range(0..nodes.len());
            let offset = Vec3::from([(); 3].map(|()| rng.random_range(-1.0..=1.0)));
            let probabilities = evidence.probabilities(node);
            targets.positions.push(nodes[node].position + jitter * offset);
            targets.weights.push(certainty(&probabilities));
            targets.probabilities.extend(probabilities);
        }
        targets
    }

    /// Rays through random pixels of all keyframes with the class probabilities of the maps. They have no length, so
    /// that they are rendered like those of any pose. Empty without labels.
    pub fn map_rays(&self, scene: &Scene, count: usize, seed: u64) -> RayTargets {
        let mut targets = RayTargets::default();
        if !self.is_labelled() {
            return targets;
        }
        let frames = scene.keyframes();
        let mut rng = SmallRng::seed_from_u64(seed ^ 0x7a45);
        for _ in 0..count {
            let Some(&number) = frames.choose(&mut rng) else {
                break;
            };
            let frame = &scene.frames[number];
            let pixel = rng.random_range(0..frame.camera.pixels());
            let Some(node) = self.surface().pixels[number].node(pixel) else {
                continue;
            };
            let probabilities = self.probabilities(node as usize);
            targets.rays.push(Ray {
                length: None,
                ..Ray::through(frame, pixel)
            });
            targets.weights.push(certainty(&probabilities));
            targets.probabilities.extend(probabilities);
        }
        targets
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
