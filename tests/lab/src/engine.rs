//! How fast the field's kernels are, path by path, and how soon a field is good.

use std::sync::Arc;
use std::time::{Duration, Instant};

use candle_core::{Device, Result};
use glam::Vec3;
use rand::{Rng, SeedableRng, rngs::SmallRng};
use serde::Serialize;

use super::Failure;
use super::learnt::pool;
use super::reached::{Progress, Reached};
use inplace_core::field::kernels::Dispatch;
use inplace_core::field::reference::{PixelLabels, ReferenceSettings, ReferenceTrainer};
use inplace_core::field::{
    Backend, Capacity, OccupancyGrid, Preset, RadianceField, Ray, Recipe, RenderedRay, Samples, Sampling,
    Trainer, Volume, best_device,
};
use inplace_core::scene::Scene;

/// Samples of one measured step.
const SAMPLES: usize = 48 * 1024;

/// The speed of one way to compute the field.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PathSpeed {
    /// `fused-<vector unit>`, or `candle` for plain ops.
    pub name: String,
    /// Logarithm (base 2) of the rows of a hashed level.
    pub table_log2: u32,
    /// Samples a second, forward and backward; the median over the runs.
    pub samples_per_s: f64,
}

/// Measures every path that this processor has, in turn, `rounds` times, on random rays through a room
/// of 6 m: forward and backward of the rendered colours.
///
/// # Errors
/// None on the CPU short of a lack of memory.
pub fn path_speeds(
    table_log2: u32,
    rounds: usize,
    threads: usize,
) -> std::result::Result<Vec<PathSpeed>, Failure> {
    let (min, side) = (Vec3::ZERO, 6.0);
    let volume = Volume { min, side };
    let capacity = Capacity {
        levels: 8,
        coarsest: 16,
        finest: 512,
        table_log2,
        most_log2: table_log2,
        hidden: 64,
        steps: 1,
        cell: 6.0 / 512.0,
    };
    let paths = Dispatch::available().map(Backend::Fused);
    let paths = paths.chain([Backend::Plain(Device::Cpu)]);
    let field = |path: Backend| Ok((name(&path), RadianceField::new(volume, &capacity, 1, &path)?));
    let fields = paths.map(field).collect::<Result<Vec<_>>>()?;
    let samples = Arc::new(random_samples(&volume));
    let gaps = vec![0.0; samples.len()];
    let pool = pool(threads)?;
    let mut times: Vec<Vec<Duration>> = vec![Vec::new(); fields.len()];
    // One round more than counted: the first warms up.
    for round in 0..=rounds {
        for ((_, field), times) in fields.iter().zip(&mut times) {
            let start = Instant::now();
            pool.install(|| -> Result<()> {
                let out = field.render(Arc::clone(&samples), gaps.clone())?;
                out.sqr()?.mean_all()?.backward()?;
                Ok(())
            })?;
            if round > 0 {
                times.push(start.elapsed());
            }
        }
    }
    let speed = |((name, _), mut times): ((String, RadianceField), Vec<Duration>)| {
        times.sort_unstable();
        let median = times
            .get(times.len() / 2)
            .map_or(f64::INFINITY, Duration::as_secs_f64);
        PathSpeed {
            name,
            table_log2,
            samples_per_s: samples.len() as f64 / median,
        }
    };
    Ok(fields.into_iter().zip(times).map(speed).collect())
}

/// What a path is called in the results.
fn name(path: &Backend) -> String {
    match path {
        Backend::Fused(dispatch) => format!("fused-{dispatch}"),
        Backend::Plain(_) => "candle".to_owned(),
    }
}

/// What is trained in a run: its name for people, how much the field may model, and what it is trained by.
pub type Variant = (&'static str, Preset, Recipe);

/// How good a field was after so much training.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RunPoint {
    /// The scene.
    pub scene: String,
    /// Name of what was trained.
    pub preset: String,
    /// Whether the field was given measured depth.
    pub depth: bool,
    /// Seed of the run.
    pub seed: u64,
    /// Seconds of training.
    pub seconds: f64,
    /// Steps done.
    pub steps: u64,
    /// Rays trained on a second, over all training so far.
    pub rays_per_s: f64,
    /// Steps a second, over all training so far.
    pub steps_per_s: f64,
    /// Samples a training ray needed of late; of the reference, its network evaluations.
    pub samples_per_ray: f32,
    /// Median error of the ray length on held-out frames, in metres.
    pub depth_error_m: Option<f32>,
    /// The same as a share of the ray length.
    pub depth_error_rel: Option<f32>,
    /// Share of the held-out pixels within a tenth of the ray length, 0..=1.
    pub within_tenth: Option<f32>,
    /// Peak signal-to-noise ratio on held-out frames, in dB.
    pub psnr_db: f32,
    /// Trainable parameters.
    pub parameters: usize,
    /// How often the field came back to an earlier state, because it had collapsed or was not finite.
    pub undone: u64,
}

/// Trains a field on `scene` and measures it on its held-out frames against `truth`, another reading of
/// the same capture, after each of `marks` seconds of training (measuring not counted); in between it is
/// looked at often enough to tell when it reached the [`TARGETS`](super::TARGETS) within a tenth.
///
/// # Errors
/// None on the CPU short of a lack of memory.
pub fn training_run(
    scene: &Arc<Scene>,
    truth: &Scene,
    (name, preset, recipe): Variant,
    seed: u64,
    marks: &[f64],
) -> Result<(Vec<RunPoint>, Vec<Reached>)> {
    if preset == Preset::Reference {
        return reference_run(scene, truth, seed, marks);
    }
    let mut reached = Progress::default();
    let (path, own) = (Backend::best()?, Arc::clone(scene));
    let mut trainer = Trainer::on(&path, own, (preset, 1.0), recipe, seed)?;
    let mut seconds = 0.0;
    let mut points = Vec::new();
    for &mark in marks {
        while seconds < mark {
            let start = Instant::now();
            trainer.step()?;
            seconds += start.elapsed().as_secs_f64();
            if reached.is_due(seconds)
                && let Some(held_out) = trainer.evaluate_against(truth)?
            {
                reached.note(seconds, &held_out);
            }
        }
        if let Some(held_out) = trainer.evaluate_against(truth)? {
            reached.note(seconds, &held_out);
            let work = trainer.work();
            points.push(RunPoint {
                scene: scene.name(),
                preset: name.to_owned(),
                depth: scene.has_depth(),
                seed,
                seconds,
                steps: trainer.steps(),
                rays_per_s: work.rays as f64 / seconds,
                steps_per_s: work.steps as f64 / seconds,
                samples_per_ray: trainer.samples_per_ray(),
                depth_error_m: held_out.depth_error,
                depth_error_rel: held_out.relative_depth_error,
                within_tenth: held_out.within_tenth,
                psnr_db: held_out.psnr,
                parameters: trainer.field().parameters(),
                undone: trainer.undone(),
            });
        }
    }
    let reached = reached.finish(&scene.name(), name, scene.has_depth(), seed);
    Ok((points, reached))
}

/// The same for the paper's networks, which have no labels here and learn colours alone. A step takes
/// longer than some marks are apart: what is measured is the state after the last whole step. They are looked
/// at at the marks alone, since a look takes seconds.
fn reference_run(
    scene: &Arc<Scene>,
    truth: &Scene,
    seed: u64,
    marks: &[f64],
) -> Result<(Vec<RunPoint>, Vec<Reached>)> {
    let device = best_device()?;
    let (settings, labels) = (ReferenceSettings::published(&device), PixelLabels::default());
    let mut reached = Progress::default();
    let mut trainer = ReferenceTrainer::new(Arc::clone(scene), labels, settings, &device, seed)?;
    let rays = trainer.held_out().rays(scene);
    // Depth does no more than bound the volume.
    let (preset, depth) = (Preset::Reference.name(), false);
    let mut seconds = 0.0;
    let mut points = Vec::new();
    for &mark in marks {
        while seconds < mark {
            let start = Instant::now();
            trainer.advance()?;
            seconds += start.elapsed().as_secs_f64();
        }
        let rendered = trainer.field().render(&rays)?;
        let seen: Vec<RenderedRay> = rendered.iter().map(|ray| ray.seen).collect();
        if let Some(held_out) = trainer.held_out().error(&seen, truth) {
            reached.note(seconds, &held_out);
            points.push(RunPoint {
                scene: scene.name(),
                preset: preset.to_owned(),
                depth,
                seed,
                seconds,
                steps: trainer.steps(),
                rays_per_s: trainer.work().rays as f64 / seconds,
                steps_per_s: trainer.work().rays as f64 / settings.rays as f64 / seconds,
                samples_per_ray: settings.evaluations_per_ray() as f32,
                depth_error_m: held_out.depth_error,
                depth_error_rel: held_out.relative_depth_error,
                within_tenth: held_out.within_tenth,
                psnr_db: held_out.psnr,
                parameters: trainer.field().parameters(),
                undone: 0,
            });
        }
    }
    Ok((points, reached.finish(&scene.name(), preset, depth, seed)))
}

/// Rays of sixteen samples each from the middle of the volume to all sides.
fn random_samples(volume: &Volume) -> Samples {
    let mut rng = SmallRng::seed_from_u64(1);
    let ray = |_| {
        let mut random = || rng.random_range(-1.0_f32..1.0);
        Ray {
            origin: volume.to_world(Vec3::splat(0.5)) + 0.3 * Vec3::new(random(), random(), random()),
            direction: Vec3::new(random(), random(), random()).normalize_or(Vec3::X),
            length: Some(2.0 + random()),
        }
    };
    let rays: Vec<Ray> = (0..SAMPLES / 16).map(ray).collect();
    let sampling = Sampling {
        step: 0.02,
        held_back: 0.0,
        free: 6,
        near_surface: 10,
        jitter: Some(1),
    };
    Samples::along(&rays, volume, &OccupancyGrid::unknown(0.02), sampling)
}
