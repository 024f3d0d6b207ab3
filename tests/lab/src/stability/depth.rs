//! What happens to measured depth: holes, a wrong scale, none at all.

use std::sync::Arc;

use rand::{Rng, rngs::SmallRng};

use super::trial::{Measured, Trial};
use super::{Condition, Line, Settings, Way, disturbed};
use crate::{Failure, unusable_scene};
use inplace_core::field::Trainer;
use inplace_core::scene::DepthMap;

/// Fields that are begun without depth, and their steps.
const STARTS: usize = 8;
const STEPS: u64 = 200;
/// Median error of the ray length, as a share of it, up to which a field is on its way to the scene; one that put a
/// picture before each camera is off by nearly all of it.
const ON_ITS_WAY: f32 = 0.5;

pub(super) fn conditions() -> Vec<Condition> {
    vec![
        disturbed(
            "depth-holes",
            "a third of the depth is missing, in round holes and where surfaces end",
            "fills wide holes with what other frames measured there, narrow ones from beside them up to a border, and both from the field once that is within 3% of the depth",
            Line::OfClean(0.9),
            holes,
        )
        .limited_by("a third of the clicks and of the measured pixels fall into holes, and small things lie in them whole"),
        disturbed(
            "depth-scale",
            "all depth is 5% too long",
            "fuses what the views agree on; layers that do not meet are joined where they are nearest",
            Line::OfClean(0.8),
            |trial, _| each(trial, |length| 1.05 * length),
        )
        .in_short(),
        disturbed(
            "depth-noise",
            "depth is off by 1% of itself, pixel by pixel",
            "makes voxels up to twice as large, and averages positions, colours and normals in them",
            Line::OfClean(0.9),
            |trial, rng| each(trial, |length| length * (1.0 + 0.0173 * rng.random_range(-1.0..1.0_f32))),
        )
        .limited_by("normals of noisy depth hardly tell where surfaces bend: what colour does not part leaks"),
        Condition::new(
            "starts-no-depth",
            "eight fields begin on colours alone: share that is on its way to the scene after 200 steps",
            "leaves the space next to the cameras out at first: a picture before each camera would explain all that it sees",
            Line::Least(1.0),
            Way::Course(starts),
        ),
    ]
}

fn starts(trial: &Trial, settings: &Settings, rng: &mut SmallRng) -> Result<Measured, Failure> {
    let mut blind = trial.clone();
    blind.without_depth();
    let scene = Arc::new(blind.scene);
    let mut found = 0;
    for _ in 0..STARTS {
        let mut trainer = Trainer::new(Arc::clone(&scene), settings.training.preset, rng.random())?;
        for _ in 0..STEPS {
            trainer.step()?;
        }
        let error = trainer.evaluate_against(&trial.scene)?;
        let error = error.and_then(|error| error.relative_depth_error);
        let none = "no depth is measured that fields without depth could be compared with";
        let error = error.ok_or_else(|| unusable_scene(&trial.scene, none))?;
        found += usize::from(error <= ON_ITS_WAY);
    }
    Ok((found as f64 / STARTS as f64, Vec::new()))
}

/// Changes every ray length that is known; 0 makes it unknown.
fn each(trial: &mut Trial, mut change: impl FnMut(f32) -> f32) {
    for frame in &mut trial.scene.frames {
        if let Some(depth) = frame.depth() {
            let lengths = (0..depth.len()).map(|pixel| depth.ray_length(pixel).map_or(0.0, &mut change));
            let changed = DepthMap::from_ray_lengths(depth.width(), &lengths.collect::<Vec<f32>>());
            frame.set_depth(Some(changed));
        }
    }
}

fn holes(trial: &mut Trial, rng: &mut SmallRng) {
    for frame in &mut trial.scene.frames {
        let Some(depth) = frame.depth() else { continue };
        let (width, height) = (frame.camera.width as i32, frame.camera.height as i32);
        let length = |pixel| depth.ray_length(pixel).unwrap_or(0.0);
        let mut lengths: Vec<f32> = (0..depth.len()).map(length).collect();
        // Sensors lose the pixels beside a step.
        let at = |x: i32, y: i32| lengths[(y.clamp(0, height - 1) * width + x.clamp(0, width - 1)) as usize];
        let beside_step = |pixel: usize| {
            let (x, y) = (pixel as i32 % width, pixel as i32 / width);
            let around = [(-2, 0), (2, 0), (0, -2), (0, 2)];
            let gaps = around.map(|(dx, dy)| (at(x + dx, y + dy) - at(x, y)).abs());
            gaps.into_iter().any(|gap| gap > 0.1 * at(x, y))
        };
        let mut lost: Vec<bool> = (0..lengths.len()).map(beside_step).collect();
        let enough = lengths.len() / 3;
        while lost.iter().filter(|&&lost| lost).count() < enough {
            let (x, y) = (rng.random_range(0..width), rng.random_range(0..height));
            let radius = width / 40 + rng.random_range(0..=width / 16);
            for row in (y - radius).max(0)..(y + radius).min(height) {
                for column in (x - radius).max(0)..(x + radius).min(width) {
                    if (column - x).pow(2) + (row - y).pow(2) < radius.pow(2) {
                        lost[(row * width + column) as usize] = true;
                    }
                }
            }
        }
        for (length, _) in lengths.iter_mut().zip(lost).filter(|(_, lost)| *lost) {
            *length = 0.0;
        }
        frame.set_depth(Some(DepthMap::from_ray_lengths(width as u32, &lengths)));
    }
}
