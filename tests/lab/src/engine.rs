//! `inplace-lab bench engine`: how fast the field's kernels are, path by path, and how soon a field is good.

use std::sync::Arc;
use std::time::{Duration, Instant};

use candle_core::Result as Computed;
use glam::Vec3;
use rand::{Rng, SeedableRng, rngs::SmallRng};
use serde::Serialize;
use serde_json::json;

use super::Failure;
use super::arguments::EngineArguments;
use super::commands::{begin, grouped, processor};
use super::learnt::pool;
use super::page::Page;
use inplace_core::export::{self, peak_memory};
use inplace_core::field::kernels::Dispatch;
use inplace_core::field::{
    Backend, Capacity, OccupancyGrid, Preset, RadianceField, Ray, Recipe, Samples, Sampling, Trainer, Volume,
};
use inplace_core::scene::{OpenOptions, Scene, SceneSource};
use inplace_core::session::Progress;

/// Samples of one measured step.
const SAMPLES: usize = 48 * 1024;

/// Sizes of the hash table that the engine is measured with.
const TABLES: [u32; 2] = [17, 19];
/// The name of the way that the others are compared with.
pub const PLAIN: &str = "candle";

/// The speed of one way to compute the field.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct PathSpeed {
    /// `fused-<vector unit>`, or `candle` for plain ops.
    name: String,
    /// Logarithm (base 2) of the rows of a hashed level.
    table_log2: u32,
    /// Samples a second, forward and backward; the median over the runs.
    samples_per_s: f64,
}

/// Measures every path that this processor has, in turn, `rounds` times, on random rays through a room
/// of 6 m: forward and backward of the rendered colours.
///
/// # Errors
/// Candle's.
fn path_speeds(table_log2: u32, rounds: usize, threads: usize) -> Result<Vec<PathSpeed>, Failure> {
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
    let paths = paths.chain([Backend::Plain]);
    let field = |path: Backend| Ok((name(path), RadianceField::new(volume, &capacity, 1, path)?));
    let fields = paths.map(field).collect::<Computed<Vec<_>>>()?;
    let samples = Arc::new(random_samples(&fields[0].1)?);
    let gaps = vec![0.0; samples.len()];
    let pool = pool(threads)?;
    let mut times: Vec<Vec<Duration>> = vec![Vec::new(); fields.len()];
    // One round more than counted: the first warms up.
    for round in 0..=rounds {
        for ((_, field), times) in fields.iter().zip(&mut times) {
            let start = Instant::now();
            pool.install(|| -> Computed<()> {
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
fn name(path: Backend) -> String {
    match path {
        Backend::Fused(dispatch) => format!("fused-{dispatch}"),
        Backend::Plain => PLAIN.to_owned(),
    }
}

/// What is trained in a run: its name for people, how much the field may model, and what it is trained by.
type Variant = (&'static str, Preset, Recipe);

/// How good a field was after so much training.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct RunPoint {
    /// The scene.
    scene: String,
    /// Name of what was trained.
    preset: String,
    /// Whether the field was given measured depth.
    depth: bool,
    /// Seed of the run.
    seed: u64,
    /// Seconds of training.
    seconds: f64,
    /// Steps done.
    steps: u64,
    /// Rays trained on a second, over all training so far.
    rays_per_s: f64,
    /// Steps a second, over all training so far.
    steps_per_s: f64,
    /// Samples a training ray needed of late.
    samples_per_ray: f32,
    /// Median error of the ray length on held-out frames, in metres.
    depth_error_m: Option<f32>,
    /// The same as a share of the ray length.
    depth_error_rel: Option<f32>,
    /// Share of the held-out pixels within a tenth of the ray length, 0..=1.
    within_tenth: Option<f32>,
    /// Peak signal-to-noise ratio on held-out frames, in dB.
    psnr_db: f32,
    /// How often the field came back to an earlier state, because it had collapsed or was not finite.
    undone: u64,
    /// The time that was asked for.
    mark: f64,
}

/// Trains a field on `scene` and measures it on its held-out frames against `truth`, another reading of
/// the same capture, after each of `marks` seconds of training (measuring not counted).
///
/// # Errors
/// Candle's.
fn training_run(
    scene: &Arc<Scene>,
    truth: &Scene,
    (name, preset, recipe): Variant,
    seed: u64,
    marks: &[f64],
) -> Computed<Vec<RunPoint>> {
    let mut trainer = Trainer::on(Backend::default(), Arc::clone(scene), (preset, 1.0), recipe, seed)?;
    let mut seconds = 0.0;
    let mut points = Vec::new();
    for &mark in marks {
        while seconds < mark {
            let start = Instant::now();
            trainer.step()?;
            seconds += start.elapsed().as_secs_f64();
        }
        let Some(held_out) = trainer.evaluate_against(truth)? else {
            continue;
        };
        points.push(RunPoint {
            scene: scene.name(),
            preset: name.to_owned(),
            depth: scene.has_depth(),
            seed,
            seconds,
            steps: trainer.steps(),
            rays_per_s: trainer.rays() as f64 / seconds,
            steps_per_s: trainer.steps() as f64 / seconds,
            samples_per_ray: trainer.samples_per_ray(),
            depth_error_m: held_out.depth_error,
            depth_error_rel: held_out.relative_depth_error,
            within_tenth: held_out.within_tenth,
            psnr_db: held_out.psnr,
            undone: trainer.undone(),
            mark,
        });
    }
    Ok(points)
}

/// Rays of sixteen samples each from the middle of the volume to all sides.
fn random_samples(field: &RadianceField) -> Computed<Samples> {
    let volume = field.volume();
    let mut rng = SmallRng::seed_from_u64(1);
    let ray = |_| {
        let mut random = || rng.random_range(-1.0_f32..1.0);
        Ray {
            origin: volume.min + 0.5 * volume.side + 0.3 * Vec3::new(random(), random(), random()),
            direction: Vec3::new(random(), random(), random()).normalize_or(Vec3::X),
            length: Some(2.0 + random()),
        }
    };
    let rays: Vec<Ray> = (0..SAMPLES / 16).map(ray).collect();
    let sampling = Sampling::new(0.02, [6, 10], Some(1));
    let occupancy = OccupancyGrid::unknown(sampling.step);
    Samples::along(field, &occupancy, &rays, sampling)
}

/// Measures, writes `engine.json`, and prints.
pub fn run(arguments: &EngineArguments) -> Result<(), Failure> {
    let out = &arguments.output.out;
    begin(out, &arguments.scenes)?;
    let threads = arguments.reading.threads();
    let progress = Progress::default();
    let mut paths = Vec::new();
    for table_log2 in TABLES.into_iter().filter(|_| arguments.rounds > 0) {
        progress.show(format!("speed of each way, tables of 2^{table_log2} rows"));
        paths.extend(path_speeds(table_log2, arguments.rounds, threads)?);
    }
    let runs = runs(arguments, threads, &progress)?;
    drop(progress);
    let peak = peak_memory();
    let result = json!({
        "version": env!("CARGO_PKG_VERSION"),
        "machine": processor(),
        "threads": threads,
        "rounds": arguments.rounds,
        "peak_memory_bytes": peak,
        "paths": paths,
        "runs": runs,
    });
    export::write_json(&out.join("engine.json"), &result)?;
    let mut page = Page::default();
    add_paths(&mut page, &paths);
    add_runs(&mut page, &runs)?;
    if let Some(peak) = peak {
        page.paragraph(&format!("Peak memory: {:.2} GB.", peak as f64 / 1e9));
    }
    page.publish(&arguments.output, "engine", &result)
}

/// Every field at every mark.
fn runs(arguments: &EngineArguments, threads: usize, progress: &Progress) -> Result<Vec<RunPoint>, Failure> {
    let pool = pool(threads)?;
    let mut runs = Vec::new();
    let variants: Vec<Variant> = if arguments.ablate {
        let parts = Recipe::ablations().into_iter();
        parts.map(|(name, recipe)| (name, Preset::Auto, recipe)).collect()
    } else {
        let presets = arguments.presets.iter();
        presets
            .map(|&preset| (preset.name(), preset, Recipe::default()))
            .collect()
    };
    for scene in &arguments.scenes {
        let source = SceneSource::from_argument(scene);
        let open = |options| Scene::open(&source, options, &|_, _| {});
        let options = arguments.reading.open_options();
        let truth = open(OpenOptions {
            depth: true,
            ..options
        })?;
        let seen = Arc::new(open(options)?);
        let mut marks = arguments.marks.clone();
        marks.sort_by(f64::total_cmp);
        for run in 0..arguments.seeds {
            let seed = arguments.reading.seed.wrapping_add(run);
            for &variant in &variants {
                progress.show(format!("{}, seed {seed}: {}", scene.display(), variant.0));
                let measured = pool.install(|| training_run(&seen, &truth, variant, seed, &marks))?;
                runs.extend(measured);
            }
        }
    }
    Ok(runs)
}

/// A row for each way, a column for each size of the table.
fn add_paths(page: &mut Page, paths: &[PathSpeed]) {
    if paths.is_empty() {
        return;
    }
    page.paragraph(
        "Million samples a second of each way to compute the field, forward and backward: medians, and how many times \
         as fast as plain candle ops.",
    );
    let of = |name: &str, table: u32| {
        let is = |path: &&PathSpeed| path.name == name && path.table_log2 == table;
        paths.iter().find(is)
    };
    let mut rows = Vec::new();
    for (name, own) in grouped(paths, |path| path.name.clone()) {
        let mut row = vec![name];
        for path in own {
            let plain = of(PLAIN, path.table_log2).map_or(f64::NAN, |plain| plain.samples_per_s);
            row.push(format!("{:.2}", path.samples_per_s / 1e6));
            row.push(format!("{:.1}", path.samples_per_s / plain));
        }
        rows.push(row);
    }
    let tables = TABLES.map(|table| format!(" | 2^{table} rows a level | times candle"));
    page.table(&format!("way{}", tables.concat()), &rows);
}

/// A row for each scene and mark: means over the seeds.
fn add_runs(page: &mut Page, runs: &[RunPoint]) -> Result<(), Failure> {
    if runs.is_empty() {
        return Ok(());
    }
    page.paragraph(
        "How good the field is on frames that it was not trained on, after so many seconds of training: the median \
         error of the ray length, the share of pixels within a tenth of it, and the PSNR of the colours; means over \
         the seeds, and ranges.",
    );
    page.means(
        runs,
        "scene | preset | depth | seconds=mark | steps/s=steps_per_s:0 | rays/s=rays_per_s:0 | \
         samples a ray=samples_per_ray:1 | error, cm=depth_error_m:2%~ | error, %=depth_error_rel:2%~ | \
         within 10%, %=within_tenth:1%~ | PSNR, dB=psnr_db:1~",
    )
}
