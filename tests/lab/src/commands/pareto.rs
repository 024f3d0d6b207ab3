//! `inplace-lab bench pareto`: accuracy against wall time, and against the size of the model.

mod figure;
mod verdict;

use std::ffi::OsStr;
use std::path::Path;

use crate::pareto::{CAPACITY_COLUMNS, COLUMNS, CapacityPoint, Method, ParetoPoint, ParetoRun, Part};
use crate::simulate::Baseline;
use crate::table::csv;
use inplace_core::arguments::ReadingArguments;
use inplace_core::export;
use inplace_core::field::Preset;
use inplace_core::scene::SceneSource;
use serde_json::json;

use super::{Failure, begin, in_own_process};
use crate::arguments::ParetoArguments;
use inplace_core::session::Progress;

/// Sizes beside the chosen one.
const FACTORS: [f32; 4] = [0.25, 0.5, 2.0, 4.0];

/// One method on one scene with one seed.
struct Run<'a> {
    scene: &'a Path,
    seed: u64,
    method: Method,
    /// What is scaled, each by itself, of a model that is measured by itself; nothing of a session.
    parts: Vec<Part>,
    /// By how much.
    factor: f32,
}

/// Measures, writes `pareto.csv` and `pareto.svg` (and those of the capacity), and prints.
pub fn run(arguments: &ParetoArguments) -> Result<(), Failure> {
    let runs = runs(arguments);
    if let Some(run) = arguments.run {
        let run = runs.get(run).ok_or("there are not so many runs")?;
        return measure(arguments, run);
    }
    let out = &arguments.output.out;
    begin(out, &arguments.scenes)?;
    let threads = arguments.reading.threads();
    let (mut points, mut capacity): (Vec<ParetoPoint>, Vec<CapacityPoint>) = Default::default();
    let progress = Progress::default();
    for (number, run) in runs.iter().enumerate() {
        let (scene, method) = (run.scene.display(), run.method.name());
        let what = match run.parts.first() {
            Some(part) => format!("{} of {part}", run.factor),
            None => method.to_owned(),
        };
        progress.show(format!("{scene}, seed {}: {what}", run.seed));
        let number = number.to_string();
        let option = [OsStr::new("--run"), OsStr::new(&number)];
        let measured: Vec<ParetoPoint> = in_own_process(option, &format!("{scene}: {method}"))?;
        // What has been measured stays if a later run fails.
        if run.parts.is_empty() {
            points.extend(measured);
            export::write(&out.join("pareto.csv"), csv(&points, COLUMNS)?.as_bytes())?;
        } else if let Some(end) = measured.last() {
            capacity.extend(run.parts.iter().map(|&part| CapacityPoint {
                part,
                factor: run.factor,
                end: end.clone(),
            }));
            let rows = csv(&capacity, CAPACITY_COLUMNS)?;
            export::write(&out.join("capacity.csv"), rows.as_bytes())?;
        }
    }
    drop(progress);
    figure::pareto(arguments, threads, &points).write(&out.join("pareto.svg"))?;
    if arguments.capacity {
        figure::capacity(arguments, threads, &capacity).write(&out.join("capacity.svg"))?;
    }
    let verdicts = verdict::verdicts(&points);
    let of_capacity = verdict::capacity_verdicts(&capacity);
    let result = json!({
        "version": env!("CARGO_PKG_VERSION"),
        "threads": threads,
        "points": points,
        "verdicts": verdicts,
        "capacity": capacity,
        "capacity_verdicts": of_capacity,
    });
    let mut page = verdict::page(&points, &verdicts);
    verdict::add_capacity(&mut page, &capacity, &of_capacity);
    page.publish(&arguments.output, "pareto", &result)
}

/// The presets and then the baselines, each once.
fn methods(arguments: &ParetoArguments) -> Vec<Method> {
    let presets = arguments.presets.iter().copied().map(Method::Preset);
    let baselines = arguments.baselines.iter().map(|&baseline| match baseline {
        Baseline::Reference => Method::Preset(Preset::Reference),
        other => Method::Baseline(other),
    });
    let all: Vec<Method> = presets.chain(baselines).collect();
    let each = super::grouped(&all, |method| *method).into_iter();
    each.map(|(method, _)| method).collect()
}

/// All runs, scene by scene and seed by seed.
fn runs(arguments: &ParetoArguments) -> Vec<Run<'_>> {
    let mut runs = Vec::new();
    for scene in &arguments.scenes {
        for number in 0..arguments.seeds {
            let run = |method, parts, factor| Run {
                scene,
                seed: arguments.reading.seed.wrapping_add(number),
                method,
                parts,
                factor,
            };
            let sessions = methods(arguments).into_iter();
            runs.extend(sessions.map(|method| run(method, Vec::new(), 1.0)));
            if arguments.capacity {
                let auto = Method::Preset(Preset::Auto);
                runs.push(run(auto, Part::ALL.to_vec(), 1.0));
                for part in Part::ALL {
                    runs.extend(FACTORS.map(|factor| run(auto, vec![part], factor)));
                }
            }
        }
    }
    runs
}

/// Measures a run in this process, so that the peak of its memory is its own, and prints JSON.
fn measure(arguments: &ParetoArguments, run: &Run<'_>) -> Result<(), Failure> {
    let mut marks = arguments.marks.clone();
    marks.sort_by(f64::total_cmp);
    marks.dedup();
    let reading = ReadingArguments {
        seed: run.seed,
        ..arguments.reading
    };
    let run = ParetoRun {
        session: reading.session_options(SceneSource::from_argument(run.scene), Preset::Auto),
        method: run.method,
        clicks: arguments.clicks.into(),
        marks,
        scaled: run.parts.first().map(|&part| (part, run.factor)),
    };
    println!("{}", serde_json::to_string(&run.measure()?)?);
    Ok(())
}
