//! `inplace-lab bench pareto`: accuracy against wall time, method by method, and against capacity: whether what is chosen for a scene is worth its
//! time and its size.

mod course;
mod curve;
mod figure;
#[cfg(test)]
mod tests;
mod verdict;

use std::ffi::OsStr;
use std::fmt;

use serde::{Deserialize, Serialize};
use serde_json::json;

pub use course::ParetoRun;
pub use curve::{Curve, Summary};

use super::Failure;
use super::arguments::ParetoArguments;
use super::commands::{begin, grouped, in_own_process};
use super::simulate::Baseline;
use super::table::csv;
use inplace_core::arguments::ReadingArguments;
use inplace_core::export;
use inplace_core::field::Preset;
use inplace_core::scene::SceneSource;
use inplace_core::session::{Progress, TrainingEnd};

/// Sizes beside the chosen one.
const FACTORS: [f32; 4] = [0.25, 0.5, 2.0, 4.0];

/// A way to label a scene from clicks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// A session of the program; with [`Preset::Reference`], of the published network.
    Preset(Preset),
    /// Half of a session without measured depth.
    Alone(Half),
    /// Something simpler, or older.
    Baseline(Baseline),
}

/// What tells the depth of a scene where it is not measured; a session has both.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Half {
    /// Stereo, at half and then at full size.
    Stereo,
    /// The field that "auto" trains.
    Field,
}

impl Method {
    /// Its name in the results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Preset(preset) => preset.name(),
            Self::Alone(Half::Stereo) => "stereo alone",
            Self::Alone(Half::Field) => "field alone",
            Self::Baseline(baseline) => baseline.name(),
        }
    }
}

/// How good the maps of the test frames were after so much wall time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ParetoPoint {
    /// Name of the scene.
    pub scene: String,
    /// Name of the method.
    pub method: String,
    /// Seed of the clicks and of the session.
    pub seed: u64,
    /// Wall seconds since the start, opening the scene included and measuring not.
    pub wall_s: f64,
    /// Mean intersection over union on the test frames; a frame without a map is wrong all over.
    pub miou: f64,
    /// Median error of the field's ray length on its held-out frames, in metres, as of its newest look at them; `None`
    /// before that, without depth, and of methods without a field.
    pub depth_error_m: Option<f64>,
    /// Peak signal-to-noise ratio there, in dB; `None` as above, but for the depth.
    pub psnr_db: Option<f64>,
    /// Trainable parameters, of methods that tell.
    pub parameters: Option<usize>,
    /// The most memory that the process had held until then, in MB (10^6 bytes), where the system tells.
    pub peak_mb: Option<f64>,
    /// Voxels of the surface; 0 without one.
    pub voxels: usize,
    /// Memory of the model, in bytes: four for each parameter, and the surface's graph.
    pub bytes: usize,
    /// Why a session trained no more, all its maps being final; `None` where it went on, and of baselines.
    pub stop: Option<TrainingEnd>,
}

/// The columns of `pareto.csv`, one row for each point.
pub const COLUMNS: &str = "scene method seed wall_s:2 miou:4 depth_error_m:5 psnr_db:2 parameters peak_mb:0";

/// What is made larger or smaller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Part {
    /// The rows of the field's table ([`Capacity::scaled`](inplace_core::field::Capacity::scaled)), and its finest cells with
    /// them.
    Field,
    /// The number of the surface's voxels
    /// ([`Surface::build_scaled`](inplace_core::semantics::Surface::build_scaled)).
    Surface,
}

impl Part {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Field, Self::Surface];
}

impl fmt::Display for Part {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Field => "field",
            Self::Surface => "surface",
        })
    }
}

/// What a model of another size came to, when training had stopped or the last mark came.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CapacityPoint {
    /// What was scaled.
    pub part: Part,
    /// By how much; 1 is what is chosen.
    pub factor: f32,
    /// What came of it.
    #[serde(flatten)]
    pub end: ParetoPoint,
}

/// The columns of `capacity.csv`, one row for each point.
pub const CAPACITY_COLUMNS: &str =
    "scene part factor seed parameters bytes voxels miou:4 depth_error_m:5 psnr_db:2 wall_s:2";

/// Measures, writes `pareto.csv` and `pareto.svg` (and those of the capacity), and prints.
pub fn run(arguments: &ParetoArguments) -> Result<(), Failure> {
    let runs = runs(arguments);
    if let Some(run) = arguments.run {
        // In a process of its own, so that the peak of its memory is its own.
        let run = runs.get(run).ok_or("there are not so many runs")?;
        println!("{}", serde_json::to_string(&run.measure()?)?);
        return Ok(());
    }
    let out = &arguments.output.out;
    begin(out, &arguments.scenes)?;
    let threads = arguments.reading.threads();
    let (mut points, mut capacity): (Vec<ParetoPoint>, Vec<CapacityPoint>) = Default::default();
    let progress = Progress::default();
    for (number, run) in runs.iter().enumerate() {
        let (scene, method) = (&run.session.source, run.method.name());
        let what = match run.scaled {
            Some((part, factor)) => format!("{factor} of {part}"),
            None => method.to_owned(),
        };
        progress.show(format!("{scene}, seed {}: {what}", run.session.seed));
        let number = number.to_string();
        let option = [OsStr::new("--run"), OsStr::new(&number)];
        let measured: Vec<ParetoPoint> = in_own_process(option, &format!("{scene}: {method}"))?;
        // What has been measured stays if a later run fails.
        if let Some((part, factor)) = run.scaled {
            // What is chosen is the middle of both.
            let is_own = |&own: &Part| own == part || factor == 1.0;
            let of_part = |part| {
                let end = measured.last()?.clone();
                Some(CapacityPoint { part, factor, end })
            };
            capacity.extend(Part::ALL.into_iter().filter(is_own).filter_map(of_part));
            let rows = csv(&capacity, CAPACITY_COLUMNS)?;
            export::write(&out.join("capacity.csv"), rows.as_bytes())?;
        } else {
            points.extend(measured);
            export::write(&out.join("pareto.csv"), csv(&points, COLUMNS)?.as_bytes())?;
        }
    }
    drop(progress);
    figure::pareto(arguments, threads, &points).write(&out.join("pareto.svg"))?;
    if arguments.capacity {
        figure::capacity(arguments, threads, &capacity).write(&out.join("capacity.svg"))?;
    }
    let verdicts = verdict::verdicts(&points);
    let result = json!({
        "version": env!("CARGO_PKG_VERSION"),
        "threads": threads,
        "points": points,
        "verdicts": verdicts,
        "capacity": capacity,
    });
    let mut page = verdict::page(&points, &verdicts);
    verdict::add_capacity(&mut page, &capacity);
    page.publish(&arguments.output, "pareto", &result)
}

/// The presets, what is in them and then the baselines, each once.
fn methods(arguments: &ParetoArguments) -> Vec<Method> {
    let presets = arguments.presets.iter().copied().map(Method::Preset);
    let halves = [Half::Stereo, Half::Field].map(Method::Alone);
    let halves = halves.into_iter().filter(|_| arguments.alone);
    let baselines = arguments.baselines.iter().map(|&baseline| match baseline {
        Baseline::Reference => Method::Preset(Preset::Reference),
        other => Method::Baseline(other),
    });
    let all: Vec<Method> = presets.chain(halves).chain(baselines).collect();
    let each = grouped(&all, |method| *method).into_iter();
    each.map(|(method, _)| method).collect()
}

/// All runs, scene by scene and seed by seed.
fn runs(arguments: &ParetoArguments) -> Vec<ParetoRun> {
    let mut marks = arguments.marks.clone();
    marks.sort_by(f64::total_cmp);
    marks.dedup();
    let mut runs = Vec::new();
    for scene in &arguments.scenes {
        for number in 0..arguments.seeds {
            let reading = ReadingArguments {
                seed: arguments.reading.seed.wrapping_add(number),
                ..arguments.reading
            };
            let run = |method, scaled| ParetoRun {
                session: reading.session_options(SceneSource::from_argument(scene), Preset::Auto),
                method,
                clicks: arguments.clicks.into(),
                marks: marks.clone(),
                scaled,
            };
            let sessions = methods(arguments).into_iter();
            runs.extend(sessions.map(|method| run(method, None)));
            if arguments.capacity {
                let sized = |part, factor| run(Method::Preset(Preset::Auto), Some((part, factor)));
                runs.push(sized(Part::Field, 1.0));
                for part in Part::ALL {
                    runs.extend(FACTORS.map(|factor| sized(part, factor)));
                }
            }
        }
    }
    runs
}
