//! Training targets for the semantic field: random points of the surface, and rays of random pixels.

use glam::Vec3;
use rand::seq::IndexedRandom;
use rand::seq::index::sample;
use rand::{Rng, SeedableRng, rngs::SmallRng};

use super::{Evidence, LabelPropagation, RayTargets, SoftTargets, Surface};
use crate::field::Ray;
use crate::labels::Label;
use crate::scene::Scene;

impl SoftTargets {
    /// Random points of a surface, each moved by at most `jitter` metres along every axis from a node, with the weight and
    /// the class probabilities that are said of that; nodes of which nothing is said are left out.
    pub fn at_random(
        surface: &Surface,
        (count, seed): (usize, u64),
        jitter: f32,
        said: impl Fn(usize) -> Option<(f32, Vec<f32>)>,
    ) -> Self {
        let mut targets = Self::default();
        let nodes = surface.graph.nodes();
        let mut rng = SmallRng::seed_from_u64(seed);
        if nodes.is_empty() {
            return targets;
        }
        for _ in 0..count {
            let node = rng.random_range(0..nodes.len());
            let offset = Vec3::from([(); 3].map(|()| rng.random_range(-1.0..=1.0)));
            if let Some((weight, probabilities)) = said(node) {
                targets.positions.push(nodes[node].position + jitter * offset);
                targets.weights.push(weight);
                targets.probabilities.extend(probabilities);
            }
        }
        targets
    }
}

impl RayTargets {
    /// Rays through random pixels of these keyframes with what is said of their nodes, as above. They have no length, so
    /// that they are rendered like those of any pose.
    pub fn at_random(
        (surface, scene): (&Surface, &Scene),
        frames: &[usize],
        (count, seed): (usize, u64),
        said: impl Fn(usize) -> Option<(f32, Vec<f32>)>,
    ) -> Self {
        let mut targets = Self::default();
        let mut rng = SmallRng::seed_from_u64(seed ^ 0x7a45);
        for _ in 0..count {
            let Some(&number) = frames.choose(&mut rng) else {
                break;
            };
            let frame = &scene.frames[number];
            let pixel = rng.random_range(0..frame.camera.pixels());
            let node = surface.pixels[number].node(pixel);
            if let Some((weight, probabilities)) = node.and_then(|node| said(node as usize)) {
                let ray = Ray::through(frame, pixel);
                targets.rays.push(Ray { length: None, ..ray });
                targets.weights.push(weight);
                targets.probabilities.extend(probabilities);
            }
        }
        targets
    }
}

impl LabelPropagation {
    /// Random points of the surface with their class probabilities by the graph alone; empty without labels.
    pub fn soft_targets(&self, count: usize, seed: u64) -> SoftTargets {
        let evidence = self.evidence();
        let by_graph = Evidence {
            prior: None,
            ..evidence
        };
        SoftTargets::at_random(self.surface(), (count, seed), 0.0, |node| {
            self.target(&by_graph, node)
        })
    }

    /// Random points in the voxels of the surface with the class probabilities of the maps; empty without labels.
    pub fn map_targets(&self, count: usize, seed: u64) -> SoftTargets {
        let (jitter, evidence) = (0.5 * self.surface().voxel, self.evidence());
        SoftTargets::at_random(self.surface(), (count, seed), jitter, |node| {
            self.target(&evidence, node)
        })
    }

    /// Rays through random pixels of all keyframes with the class probabilities of the maps; empty without labels.
    pub fn map_rays(&self, scene: &Scene, count: usize, seed: u64) -> RayTargets {
        let (frames, evidence) = (scene.keyframes(), self.evidence());
        let on = (&**self.surface(), scene);
        RayTargets::at_random(on, &frames, (count, seed), |node| self.target(&evidence, node))
    }

    /// How certain a node's class is, and the probabilities; `None` without labels.
    fn target(&self, evidence: &Evidence<'_>, node: usize) -> Option<(f32, Vec<f32>)> {
        let probabilities = self.is_labelled().then(|| evidence.probabilities(node))?;
        Some((certainty(&probabilities), probabilities))
    }

    /// Rays through at most `count` random labelled pixels, with the class of the stroke.
    pub fn labelled_rays(&self, scene: &Scene, count: usize, seed: u64) -> RayTargets {
        let mut rng = SmallRng::seed_from_u64(seed);
        let mut targets = RayTargets::default();
        let mut pixels = 0;
        let painted: Vec<_> = self
            .painted()
            .map(|(frame, painted)| {
                let first = pixels;
                pixels += painted.len();
                (first, frame, painted)
            })
            .collect();
        for place in sample(&mut rng, pixels, count.min(pixels)) {
            let own = painted.partition_point(|&(first, ..)| first <= place) - 1;
            let (first, frame, painted) = painted[own];
            let (pixel, Label { class, .. }) = painted[place - first];
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
