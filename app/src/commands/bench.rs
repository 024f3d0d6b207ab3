//! `inplace bench`: measurements, as commands.

use std::path::PathBuf;
use std::sync::Arc;

use inplace_core::eval::{RunPoint, path_speeds, training_run};
use inplace_core::export;
use inplace_core::field::Preset;
use inplace_core::scene::{OpenOptions, Scene, SceneSource};
use serde_json::json;

use super::{Failure, cores};
use crate::arguments::Bench;

/// Sizes of the hash table that the engine is measured with.
const TABLES: [u32; 2] = [17, 19];

/// Measures what is asked for.
pub fn run(what: Bench) -> Result<(), Failure> {
    let Bench::Engine {
        scenes,
        marks,
        no_depth,
        seed,
        out,
        rounds,
        threads,
        json: as_json,
    } = what;
    std::fs::create_dir_all(&out).map_err(|error| format!("{}: cannot be made: {error}", out.display()))?;
    let threads = threads.map_or(cores(), usize::from);
    let mut paths = Vec::new();
    for table_log2 in TABLES.into_iter().filter(|_| rounds > 0) {
        paths.extend(path_speeds(table_log2, rounds, threads)?);
    }
    let runs = runs(&scenes, !no_depth, seed, &marks, threads)?;
    let result = json!({ "threads": threads, "rounds": rounds, "paths": paths, "runs": runs });
    export::write_json(&out.join("engine.json"), &result)?;
    if as_json {
        println!("{result:#}");
        return Ok(());
    }
    if !paths.is_empty() {
        println!("path            table  million samples/s");
    }
    for path in &paths {
        println!(
            "{:15} 2^{:<4} {:6.2}",
            path.name,
            path.table_log2,
            path.samples_per_s / 1e6
        );
    }
    if !runs.is_empty() {
        println!("scene            depth  seconds   steps  samples/ray   error cm  error %  within 10%   dB");
    }
    let figure =
        |value: Option<f32>, scale: f32| value.map_or("-".to_owned(), |v| format!("{:.2}", scale * v));
    for run in &runs {
        println!(
            "{:16} {:5} {:8.1} {:7} {:12.1} {:>10} {:>8} {:>11} {:5.1}",
            run.scene,
            if run.depth { "yes" } else { "no" },
            run.seconds,
            run.steps,
            run.samples_per_ray,
            figure(run.depth_error_m, 100.0),
            figure(run.depth_error_rel, 100.0),
            figure(run.within_tenth, 100.0),
            run.psnr_db
        );
    }
    Ok(())
}

fn runs(
    scenes: &[PathBuf],
    depth: bool,
    seed: u64,
    marks: &[f64],
    threads: usize,
) -> Result<Vec<RunPoint>, Failure> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    let mut runs = Vec::new();
    for scene in scenes {
        let source = SceneSource::from_argument(scene);
        let open = |depth| Scene::open(&source, OpenOptions { depth }, &|_, _| {});
        let truth = open(true)?;
        let seen = Arc::new(open(depth)?);
        runs.extend(pool.install(|| training_run(&seen, &truth, Preset::Auto, seed, marks))?);
    }
    Ok(runs)
}
