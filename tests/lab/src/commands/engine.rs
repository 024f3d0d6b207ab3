//! `inplace-lab bench engine`: how fast the kernels are, how soon a field is good.

use std::sync::Arc;

use crate::{PathSpeed, Quantity, Reached, RunPoint, TARGETS, Variant, path_speeds, training_run};
use inplace_core::export::{self, peak_memory};
use inplace_core::field::{Preset, Recipe};
use inplace_core::scene::{OpenOptions, Scene, SceneSource};
use inplace_core::session::Progress;
use serde_json::json;

use super::{Failure, begin, counted, grouped, processor};
use crate::arguments::EngineArguments;
use crate::chart::{Axis, Figure, Panel, Point, Scale, Series};
use crate::page::Page;

/// Sizes of the hash table that the engine is measured with.
const TABLES: [u32; 2] = [17, 19];
/// The name of the way that the others are compared with.
const PLAIN: &str = "candle";

/// Measures, writes `engine.json` and, of what was trained, `engine.svg`, and prints.
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
    let (runs, reached) = runs(arguments, threads, &progress)?;
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
        "reached": reached,
    });
    export::write_json(&out.join("engine.json"), &result)?;
    let mut page = Page::default();
    add_paths(&mut page, &paths);
    add_runs(&mut page, &runs);
    add_reached(&mut page, &reached);
    if let Some(peak) = peak {
        page.paragraph(&format!("Peak memory: {:.2} GB.", peak as f64 / 1e9));
    }
    if !runs.is_empty() {
        figure(arguments, threads, &runs).write(&out.join("engine.svg"))?;
        page.chart("How fast the engine is", "engine.svg");
    }
    page.publish(&arguments.output, "engine", &result)
}

fn runs(
    arguments: &EngineArguments,
    threads: usize,
    progress: &Progress,
) -> Result<(Vec<RunPoint>, Vec<Reached>), Failure> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    let (mut runs, mut reached) = (Vec::new(), Vec::new());
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
        for run in 0..arguments.seeds {
            let seed = arguments.reading.seed.wrapping_add(run);
            for &variant in &variants {
                progress.show(format!("{}, seed {seed}: {}", scene.display(), variant.0));
                let measured =
                    pool.install(|| training_run(&seen, &truth, variant, seed, &arguments.marks))?;
                runs.extend(measured.0);
                reached.extend(measured.1);
            }
        }
    }
    Ok((runs, reached))
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

/// Median of the finite ones among some values, and the range around it where they differ, as text.
fn spread(values: impl IntoIterator<Item = f64>, decimals: usize) -> String {
    let Some(Point { y, range, .. }) = Point::of_values(0.0, values) else {
        return "-".to_owned();
    };
    match range {
        (low, high) if low < high => {
            format!("{y:.decimals$} ({low:.decimals$} to {high:.decimals$})")
        }
        _ => format!("{y:.decimals$}"),
    }
}

/// The runs of a scene at each mark: all seeds pass the same ones, one after the other.
fn by_mark<'a>(of_scene: &[&'a RunPoint]) -> Vec<Vec<&'a RunPoint>> {
    let first = of_scene.iter().take_while(|run| run.seed == of_scene[0].seed);
    let marks = first.count();
    let at = |mark| of_scene.iter().copied().skip(mark).step_by(marks).collect();
    (0..marks).map(at).collect()
}

/// A row for each scene and mark: medians over the seeds, with their range.
fn add_runs(page: &mut Page, runs: &[RunPoint]) {
    if runs.is_empty() {
        return;
    }
    page.paragraph(
        "How good the field is on frames that it was not trained on, after so many seconds of training: the median \
         error of the ray length, the share of pixels within a tenth of it, and the PSNR of the colours; medians over \
         the seeds, and ranges.",
    );
    let mut rows = Vec::new();
    for ((scene, preset, depth), of_scene) in
        grouped(runs, |run| (run.scene.clone(), run.preset.clone(), run.depth))
    {
        for at in by_mark(&of_scene) {
            let of = |value: &dyn Fn(&RunPoint) -> f64, decimals| {
                spread(at.iter().map(|run| value(run)), decimals)
            };
            let some = |value: Option<f32>| value.map_or(f64::NAN, |value| 100.0 * f64::from(value));
            rows.push(vec![
                scene.clone(),
                preset.clone(),
                if depth { "yes" } else { "no" }.to_owned(),
                format!("{:.0}", at[0].seconds),
                format!("{:.0}", at[0].steps_per_s),
                format!("{:.0}", at[0].rays_per_s),
                format!("{:.1}", at[0].samples_per_ray),
                of(&|run| some(run.depth_error_m), 2),
                of(&|run| some(run.depth_error_rel), 2),
                of(&|run| some(run.within_tenth), 1),
                of(&|run| f64::from(run.psnr_db), 1),
            ]);
        }
    }
    page.table(
        "scene | preset | depth | seconds | steps/s | rays/s | samples a ray | error, cm \
         | error, % | within 10%, % | PSNR, dB",
        &rows,
    );
}

/// A row for each scene and quantity: seconds until each target, medians over the seeds that met it.
fn add_reached(page: &mut Page, reached: &[Reached]) {
    if reached.is_empty() {
        return;
    }
    page.paragraph("Seconds of training until:");
    let mut items = Vec::new();
    for ((scene, preset, depth), of_scene) in
        grouped(reached, |one| (one.scene.clone(), one.preset.clone(), one.depth))
    {
        for quantity in [Quantity::DepthErrorM, Quantity::DepthErrorRel, Quantity::PsnrDb] {
            let mut texts = Vec::new();
            for (_, target) in TARGETS.into_iter().filter(|(own, _)| *own == quantity) {
                let own = |one: &&&Reached| one.quantity == quantity && one.target == target;
                let all: Vec<Option<f64>> = of_scene.iter().filter(own).map(|one| one.seconds).collect();
                let met: Vec<f64> = all.iter().copied().flatten().collect();
                let share = if met.is_empty() || met.len() == all.len() {
                    String::new()
                } else {
                    format!(" in {} of {} runs", met.len(), all.len())
                };
                let name = match quantity {
                    Quantity::DepthErrorM => format!("{:.0} cm", 100.0 * target),
                    Quantity::DepthErrorRel => format!("{:.1}%", 100.0 * target),
                    Quantity::PsnrDb => format!("{target:.0} dB"),
                };
                texts.push(format!("{name}: {}{share}", spread(met, 1)));
            }
            let with = if depth { "depth" } else { "no depth" };
            items.push(format!("{scene}, {preset}, {with}: {}", texts.join("; ")));
        }
    }
    page.list(&items);
}

/// `engine.svg`: how good each field is as it is trained.
fn figure(arguments: &EngineArguments, threads: usize, runs: &[RunPoint]) -> Figure {
    let first = arguments.reading.seed;
    let seeds = match arguments.seeds {
        1 => format!("seed {first}"),
        count => {
            let last = first.wrapping_add(count - 1);
            format!("median and range over seeds {first} to {last}")
        }
    };
    Figure {
        title: "How fast the engine is".to_owned(),
        subtitle: format!("{}, {}; {seeds}", processor(), counted(threads as u64, "thread")),
        rows: vec![progress(runs)],
    }
}

/// Depth error and PSNR over the seconds of training.
fn progress(runs: &[RunPoint]) -> Vec<Panel> {
    let lines = |value: &dyn Fn(&RunPoint) -> f64| -> Vec<Series> {
        grouped(runs, |run| (run.scene.clone(), run.preset.clone(), run.depth))
            .into_iter()
            .map(|((scene, preset, depth), own)| {
                let points = by_mark(&own).into_iter().filter_map(|at| {
                    let middle = Point::of_values(0.0, at.iter().map(|run| run.seconds))?.y;
                    Point::of_values(middle, at.iter().map(|run| value(run)))
                });
                let preset = match preset.as_str() {
                    "auto" => String::new(),
                    other => format!(", {other}"),
                };
                let depth = if depth { "" } else { ", no depth" };
                Series::new(format!("{scene}{preset}{depth}"), points)
            })
            .collect()
    };
    let seconds = Axis::new("seconds of training", Scale::Logarithmic);
    let depth = Axis::new("median error, cm", Scale::Logarithmic);
    let of_depth = lines(&|run| 100.0 * run.depth_error_m.map_or(f64::NAN, f64::from));
    let colour = Axis::new("PSNR, dB", Scale::Linear);
    let of_colour = lines(&|run| f64::from(run.psnr_db));
    vec![
        Panel::new("Depth on held-out frames", seconds.clone(), depth, of_depth),
        Panel::new("Colour on held-out frames", seconds, colour, of_colour),
    ]
}
