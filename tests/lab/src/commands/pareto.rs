//! `inplace-lab bench pareto`: accuracy against wall time, and against the size of the model.

mod figure;
mod verdict;

use std::path::Path;
use std::process::Command;

use crate::pareto::{
    CAPACITY_COLUMNS, COLUMNS, CapacityPoint, Method, MethodRun, ParetoPoint, ParetoRun, Part, Size, Stop,
};
use crate::simulate::Baseline;
use crate::table::csv;
use inplace_core::export;
use inplace_core::field::Preset;
use inplace_core::scene::SceneSource;
use serde::Serialize;
use serde_json::json;

use super::{Failure, begin, cores, in_own_process, session_options};
use crate::arguments::{ParetoArguments, ParetoOfArguments};
use inplace_core::session::Progress;

/// Sizes beside the chosen one.
const FACTORS: [f32; 4] = [0.25, 0.5, 2.0, 4.0];

/// Where a method stopped by itself with one seed.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Stopped {
    scene: String,
    method: String,
    seed: u64,
    #[serde(flatten)]
    stop: Stop,
}

/// All that was measured.
#[derive(Default)]
struct Results {
    points: Vec<ParetoPoint>,
    stops: Vec<Stopped>,
    capacity: Vec<CapacityPoint>,
}

/// Measures, writes `pareto.csv` and `pareto.svg` (and those of the capacity), and prints.
pub fn run(arguments: &ParetoArguments) -> Result<(), Failure> {
    let out = &arguments.out;
    begin(out, &arguments.scenes)?;
    let threads = arguments.threads.map_or(cores(), usize::from);
    let mut results = Results::default();
    let mut progress = Progress::default();
    for scene in &arguments.scenes {
        for run in 0..arguments.seeds {
            let seed = arguments.seed.wrapping_add(run);
            let name = scene.display();
            for method in methods(arguments) {
                progress.show(&format!("{name}, seed {seed}: {}", method.name()));
                results.take(measured(scene, method, seed, None, arguments, threads)?);
                // What has been measured stays if a later run fails.
                export::write(&out.join("pareto.csv"), csv(&results.points, COLUMNS)?.as_bytes())?;
            }
            if arguments.capacity {
                let mut sizes = vec![(1.0, Part::ALL.to_vec())];
                let scaled = Part::ALL.map(|part| FACTORS.map(|factor| (factor, vec![part])));
                sizes.extend(scaled.into_iter().flatten());
                for (factor, parts) in sizes {
                    progress.show(&format!("{name}, seed {seed}: {factor} of {}", parts[0]));
                    let (auto, size) = (Method::Preset(Preset::Auto), parts[0].of_size(factor));
                    let run = measured(scene, auto, seed, Some(size), arguments, threads)?;
                    let of_part = |part| CapacityPoint::of(&run, part, factor);
                    results.capacity.extend(parts.into_iter().filter_map(of_part));
                    let rows = csv(&results.capacity, CAPACITY_COLUMNS)?;
                    export::write(&out.join("capacity.csv"), rows.as_bytes())?;
                }
            }
        }
    }
    drop(progress);
    figure::pareto(arguments, threads, &results).write(&out.join("pareto.svg"))?;
    if arguments.capacity {
        figure::capacity(arguments, threads, &results.capacity).write(&out.join("capacity.svg"))?;
    }
    let verdicts = verdict::verdicts(&results);
    let result = json!({
        "version": env!("CARGO_PKG_VERSION"),
        "threads": threads,
        "points": results.points,
        "stops": results.stops,
        "verdicts": verdicts,
        "capacity": results.capacity,
        "capacity_verdicts": verdict::capacity_verdicts(&results.capacity),
    });
    verdict::page(&results, &verdicts).publish(out, "pareto", arguments.json, &result)
}

impl Results {
    fn take(&mut self, run: MethodRun) {
        if let (Some(stop), Some(last)) = (run.stop, run.points.last()) {
            self.stops.push(Stopped {
                scene: last.scene.clone(),
                method: last.method.clone(),
                seed: last.seed,
                stop,
            });
        }
        self.points.extend(run.points);
    }
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

/// Runs this program again for one method with one seed, so that the peak of its memory is its own.
fn measured(
    scene: &Path,
    method: Method,
    seed: u64,
    size: Option<Size>,
    arguments: &ParetoArguments,
    threads: usize,
) -> Result<MethodRun, Failure> {
    let marks: Vec<String> = arguments.marks.iter().map(f64::to_string).collect();
    let mut command = Command::new(std::env::current_exe()?);
    command
        .args(["bench", "pareto-of"])
        .arg(scene)
        .args(["--method", method.name()])
        .args(["--clicks", &arguments.clicks.to_string()])
        .args(["--marks", &marks.join(",")])
        .args(["--threads", &threads.to_string()])
        .args(["--seed", &seed.to_string()]);
    if let Some(Size { field, surface }) = size {
        let factors = [field, surface].map(|factor| factor.to_string());
        command.args(["--field", &factors[0], "--surface", &factors[1]]);
    }
    if arguments.no_depth {
        command.arg("--no-depth");
    }
    if arguments.outside_files {
        command.arg("--outside-files");
    }
    in_own_process(&mut command, &format!("{}: {}", scene.display(), method.name()))
}

/// `inplace-lab bench pareto-of`: measures one method with one seed in this process and prints JSON.
pub fn of_one(arguments: &ParetoOfArguments) -> Result<(), Failure> {
    let source = SceneSource::from_argument(&arguments.scene);
    let mut marks = arguments.marks.clone();
    marks.sort_by(f64::total_cmp);
    marks.dedup();
    let factors = arguments.field.zip(arguments.surface);
    let run = ParetoRun {
        session: session_options(&arguments.training, source, cores()),
        method: arguments.method,
        clicks: arguments.clicks,
        marks,
        size: factors.map(|(field, surface)| Size { field, surface }),
    };
    println!("{}", serde_json::to_string(&run.measure()?)?);
    Ok(())
}
