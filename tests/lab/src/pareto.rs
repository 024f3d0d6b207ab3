//! `inplace-lab bench pareto`: accuracy against wall time, method by method and size by size: whether what is chosen for a
//! scene is worth it.

mod course;
mod curve;
mod figure;
#[cfg(test)]
mod tests;
mod verdict;

use std::ffi::OsStr;

use serde::{Deserialize, Serialize};
use serde_json::json;

pub use course::ParetoRun;
pub use curve::{Curve, Summary};
pub use figure::line;

use super::Failure;
use super::arguments::ParetoArguments;
use super::commands::{begin, grouped, in_own_process};
use super::table::csv;
use inplace_core::arguments::ReadingArguments;
use inplace_core::export;
use inplace_core::field::Preset;
use inplace_core::scene::SceneSource;
use inplace_core::session::{Progress, TrainingEnd};

/// Models by themselves: name, and how many times as many rows of the field's table
/// ([`Capacity::scaled`](inplace_core::field::Capacity::scaled)) and voxels of the surface
/// ([`Surface::build_scaled`](inplace_core::semantics::Surface::build_scaled)) as are chosen for a scene.
const SIZES: [(&str, [f32; 2]); 5] = [
    ("field alone", [1.0, 1.0]),
    ("half the field", [0.5, 1.0]),
    ("twice the field", [2.0, 1.0]),
    ("half the voxels", [1.0, 0.5]),
    ("twice the voxels", [1.0, 2.0]),
];

/// A way to label a scene from clicks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// A session of the program.
    Preset(Preset),
    /// Stereo, without a field.
    Stereo,
    /// A field on what was measured and its surface, in one of [`SIZES`].
    Sized(usize),
}

impl Method {
    /// Its name in the results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Preset(preset) => preset.name(),
            Self::Stereo => "stereo alone",
            Self::Sized(size) => SIZES[size].0,
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
    /// Why a session trained no more, all its maps being final; `None` where it went on.
    pub stop: Option<TrainingEnd>,
}

/// The columns of `pareto.csv`, one row for each point.
pub const COLUMNS: &str = "scene method seed wall_s:2 miou:4 depth_error_m:5 psnr_db:2 parameters peak_mb:0";

/// Measures, writes `pareto.csv` and `pareto.svg`, and prints.
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
    let mut points: Vec<ParetoPoint> = Vec::new();
    let progress = Progress::default();
    for (number, run) in runs.iter().enumerate() {
        let (scene, method) = (&run.session.source, run.method.name());
        progress.show(format!("{scene}, seed {}: {method}", run.session.seed));
        let number = number.to_string();
        let option = [OsStr::new("--run"), OsStr::new(&number)];
        let measured: Vec<ParetoPoint> = in_own_process(option, &format!("{scene}: {method}"))?;
        points.extend(measured);
        // What has been measured stays if a later run fails.
        export::write(&out.join("pareto.csv"), csv(&points, COLUMNS)?.as_bytes())?;
    }
    drop(progress);
    figure::pareto(arguments, threads, &points).write(&out.join("pareto.svg"))?;
    let verdicts = verdict::verdicts(&points);
    let result = json!({
        "version": env!("CARGO_PKG_VERSION"),
        "threads": threads,
        "points": points,
        "verdicts": verdicts,
    });
    verdict::page(&points, &verdicts).publish(&arguments.output, "pareto", &result)
}

/// The presets and what is in them, each once.
fn methods(arguments: &ParetoArguments) -> Vec<Method> {
    let presets = arguments.presets.iter().copied().map(Method::Preset);
    let stereo = arguments.alone.then_some(Method::Stereo);
    let sizes = (0..SIZES.len()).map(Method::Sized);
    let sizes = sizes.filter(|size| arguments.capacity || arguments.alone && *size == Method::Sized(0));
    let all: Vec<Method> = presets.chain(stereo).chain(sizes).collect();
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
            runs.extend(methods(arguments).into_iter().map(|method| ParetoRun {
                session: reading.session_options(SceneSource::from_argument(scene), Preset::Auto),
                method,
                clicks: arguments.clicks.into(),
                marks: marks.clone(),
            }));
        }
    }
    runs
}
