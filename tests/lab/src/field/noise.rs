//! The semantic field trained by label images of which most pixels are wrong.

use std::time::Instant;

use rand::{SeedableRng, rngs::SmallRng};
use rayon::prelude::*;

use super::{FieldExperiment, FieldPoint, Learnt, Measured};
use crate::EvalError;
use crate::paper::pixel_noise;
use inplace_core::labels::{ClassId, ImportedLabels, ImportedMap, Trust, VOID};
use inplace_core::semantics::{NodeLabels, NodeVotes, SemanticField, SemanticPart};
use inplace_core::session::sampling;

/// Places of the surface and rays in a step.
const PLACES: usize = 2048;
const RAYS: usize = 512;

/// Teaches a semantic field label images of the training frames in which this share of the pixels has a random
/// class, and measures the labels that it renders for the test frames, beside the majority of each voxel's
/// votes and beside votes diffused along the surface. Seconds are those of its steps alone.
pub(super) fn points(
    experiment: &FieldExperiment,
    learnt: &Learnt,
    share: f64,
) -> Result<Vec<FieldPoint>, EvalError> {
    let (options, scene, truth) = (&learnt.options, &learnt.scene, &learnt.truth);
    let (trainer, surface) = (&learnt.trainer, &learnt.surface);
    let seed = options.seed;
    let classes = truth.classes();
    let noisy = |&frame: &usize| {
        let mut rng = SmallRng::seed_from_u64(seed ^ ((frame as u64 + 1) << 32));
        let mut labels = truth.in_frame(scene, frame);
        pixel_noise(&mut labels, &classes, share, &mut rng);
        ImportedMap::new(frame, &labels)
    };
    let labels = ImportedLabels {
        maps: truth.train.par_iter().map(noisy).collect(),
        trust: Trust::VOTES,
    };
    let kind = format!("{:.0}% pixel noise", 100.0 * share);
    let measured = Measured::new(experiment, scene, truth, kind);
    let votes = NodeVotes::count(surface, &classes, &labels);
    let majority = votes.majority();
    let most = |node: usize| majority.get(&(node as u32)).copied().unwrap_or(VOID);
    let majority = NodeLabels((0..surface.graph.len()).map(most).collect::<Vec<ClassId>>());
    let diffused = NodeLabels::spread(surface, &classes, &labels);
    let mut points = Vec::new();
    for (answer, nodes) in [("majority", majority), ("diffusion", diffused)] {
        let miou = measured.miou_of_maps(|frame| nodes.of_frame(surface, frame))?;
        points.push(measured.point(answer, f64::NAN, miou));
    }

    let field = trainer.field();
    let grid = trainer.capacity().semantic_grid();
    let mut semantics = SemanticField::new(&classes, field.feature_width(), grid, None, seed)?;
    let mut seconds = 0.0;
    for &mark in &experiment.marks {
        while seconds < mark {
            let start = Instant::now();
            let seed = seed ^ (semantics.steps(SemanticPart::Residual) << 1);
            let soft = votes.targets(surface, PLACES, seed);
            let rays = votes.rays(surface, scene, &truth.train, RAYS, seed);
            for part in [SemanticPart::Appearance, SemanticPart::Residual] {
                let (radiance, sampling) = ((field, trainer.occupancy()), sampling(trainer, Some(seed)));
                semantics.step(part, radiance, &soft, &rays, sampling)?;
            }
            seconds += start.elapsed().as_secs_f64();
        }
        points.extend(measured.field_points(&semantics, trainer, mark)?);
    }
    Ok(points)
}
