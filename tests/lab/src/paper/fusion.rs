//! Table 4: the fusion of imperfect predictions of single images.
//!
//! In place of the paper's network, a random forest on filter responses, taught by the label images of the test frames,
//! predicts the training frames.

use std::collections::BTreeMap;
use std::time::Instant;

use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng, rngs::SmallRng};
use rayon::prelude::*;

use super::{Found, PaperPoint, evenly};
use crate::Failure;
use crate::learnt::{NodeLabels, spread};
use crate::pixels::{FilterBank, Forest, Prediction, Sample, likeliest};
use crate::truth::in_image;
use inplace_core::labels::{ClassId, ImportedLabels, ImportedMap, Trust, VOID};
use inplace_core::semantics::{NO_NODE, Surface};

/// Frames that teach, and pixels of them, those of a class by the root of its number.
const FRAMES: usize = 30;
const SAMPLES: usize = 8000;
/// Pixels of a frame among which the samples are chosen.
const CANDIDATES: usize = 2000;
/// No probability is taken to be smaller in a product: the forest has only so many trees.
const LEAST_PROBABILITY: f32 = 0.01;

/// A classifier of single images: of each class as many samples as the root of its number of pixels is of all those roots.
fn classifier(found: &Found<'_>) -> Forest {
    let (scene, truth) = (found.scene, found.truth);
    let of_frame = |&place: &usize| -> Vec<Sample> {
        let number = truth.test[place];
        let labels = truth.in_frame(scene, number);
        let bank = FilterBank::of(&scene.frames[number]);
        let mut rng = SmallRng::seed_from_u64(found.seed ^ number as u64);
        let candidate = |_| {
            let pixel = rng.random_range(0..labels.len());
            let sample = bank.at(pixel % bank.width, pixel / bank.width);
            (labels[pixel] != VOID).then_some((sample, labels[pixel]))
        };
        (0..CANDIDATES).filter_map(candidate).collect()
    };
    let frames = evenly(truth.test.len(), FRAMES);
    let candidates: Vec<Vec<Sample>> = frames.par_iter().map(of_frame).collect();
    let mut by_class: BTreeMap<ClassId, Vec<Sample>> = BTreeMap::new();
    for sample in candidates.into_iter().flatten() {
        by_class.entry(sample.1).or_default().push(sample);
    }
    let roots: f64 = by_class.values().map(|own| (own.len() as f64).sqrt()).sum();
    let mut rng = SmallRng::seed_from_u64(found.seed);
    let chosen = by_class.into_values().flat_map(|mut own| {
        let count = (SAMPLES as f64 * (own.len() as f64).sqrt() / roots).ceil() as usize;
        own.shuffle(&mut rng);
        own.truncate(count);
        own
    });
    Forest::grown(&chosen.collect::<Vec<_>>(), found.seed)
}

/// The class of every node by the sums over all pixels that show it of a function of their probabilities.
fn fused(
    surface: &Surface,
    predictions: &[(usize, Prediction)],
    classes: &[ClassId],
    of: impl Fn(f32) -> f32,
) -> NodeLabels {
    let count = classes.len();
    let mut sums = vec![0.0; surface.graph.len() * count];
    for (frame, prediction) in predictions {
        let nodes = surface.nodes_of(*frame);
        for (node, pixels) in nodes.runs().filter(|(node, _)| *node != NO_NODE) {
            let sums = &mut sums[node as usize * count..(node as usize + 1) * count];
            for pixel in pixels {
                for (sum, &p) in sums.iter_mut().zip(prediction.at(pixel)) {
                    *sum += of(p);
                }
            }
        }
    }
    NodeLabels(
        sums.chunks_exact(count)
            .map(|row| likeliest(classes, row))
            .collect(),
    )
}

/// A way to fuse: its name, the paper's mIoU, and what is summed of a probability.
type Known = (&'static str, f64, fn(f32) -> f32);

/// Runs the experiment: the predictions for the training frames, what becomes of them by Bayesian fusion (the product over
/// the pixels that show a voxel) and average fusion on the surface, and in the maps of a session that imports them, where
/// each pixel's likeliest class is a vote.
pub(super) fn run(found: &Found<'_>) -> Result<Vec<PaperPoint>, Failure> {
    let (scene, truth, surface) = (found.scene, found.truth, found.surface);
    let start = Instant::now();
    let (forest, classes) = (classifier(found), truth.classes());
    let predict = |&frame: &usize| (frame, Prediction::of(&scene.frames[frame], &forest, &classes));
    let predictions: Vec<(usize, Prediction)> = truth.train.par_iter().map(predict).collect();
    let predicting = start.elapsed().as_secs_f64();
    let map = |(frame, own): &(usize, Prediction)| ImportedMap::new(*frame, &own.labels());
    let votes = ImportedLabels::new(predictions.iter().map(map).collect(), Trust::VOTES);
    let measured = |labels: &dyn Fn(usize) -> Vec<ClassId>| {
        truth.scores(&truth.train, |frame| in_image(scene, frame, labels(frame)))
    };
    let single = |frame: usize| votes.of_frame(frame).map_or_else(Vec::new, ImportedMap::labels);
    let input = measured(&single)?;
    let point = |name, scores, seconds, paper| found.point(name, scores, input.miou, seconds, Some(paper));
    let mut points = vec![point("fusion-input", input, predicting, 0.659)];
    let log = |p: f32| p.max(LEAST_PROBABILITY).ln();
    let known: [Known; 2] = [("fusion-bayesian", 0.668, log), ("fusion-average", 0.586, |p| p)];
    let begun = found.surface_s + predicting;
    for (name, paper, of) in known {
        let start = Instant::now();
        let nodes = fused(surface, &predictions, &classes, of);
        let seconds = begun + start.elapsed().as_secs_f64();
        let scores = measured(&|frame| nodes.of_frame(surface, frame))?;
        points.push(point(name, scores, seconds, paper));
    }
    let start = Instant::now();
    let spread = spread(scene, surface, &classes, votes.clone());
    let seconds = begun + start.elapsed().as_secs_f64();
    let scores = measured(&|frame| spread.map(scene, frame, 0).labels().into_owned())?;
    points.push(point(super::FUSION, scores, seconds, 0.680));
    Ok(points)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::SceneTruth;
    use crate::testing::{capture, opened};

    #[test]
    fn every_way_of_fusing_tells_the_halves_of_a_wall_apart() {
        let (_root, folder) = capture();
        let scene = opened(&folder);
        let found = Found {
            scene: &scene,
            truth: &SceneTruth::read(&scene).unwrap(),
            surface: &Arc::new(Surface::build(&scene, &[], 5.0).unwrap()),
            surface_s: 0.0,
            seed: 1,
        };
        let points = run(&found).unwrap();
        let names: Vec<&str> = points.iter().map(|point| point.experiment).collect();
        let all = "fusion-input fusion-bayesian fusion-average fusion";
        assert_eq!(names.join(" "), all);
        assert!(points.iter().all(|point| point.scores.miou > 0.9), "{points:?}");
    }
}
