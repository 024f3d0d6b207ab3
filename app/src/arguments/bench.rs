//! The command line of `inplace bench`.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use inplace_core::eval::paper::{EXPERIMENTS, FUSION};
use inplace_core::eval::pareto::Method;
use inplace_core::eval::scale::Sweep;
use inplace_core::eval::simulate::Baseline;
use inplace_core::eval::stability::conditions;
use inplace_core::field::Preset;

use super::{TrainingArguments, image_size, preset, seconds, seconds_or_none};

/// What can be measured.
#[derive(Debug, Subcommand)]
pub enum Bench {
    /// All of the below but the semantic field, one after the other, on one page with their tables and charts; with --quick
    /// in less than ten minutes.
    All(AllArguments),
    /// Samples a second of each way to compute the field; how soon a field of each scene is good.
    Engine(EngineArguments),
    /// The experiments of the Semantic-NeRF paper: sparse, noisy, coarse and partial label images of the
    /// training frames, beside the paper's numbers.
    Paper(PaperArguments),
    /// How long a click waits for its maps while the field is being taught: for that of the frame in view and
    /// for those of all frames.
    Latency(LatencyArguments),
    /// The labels that the semantic field renders, as seconds pass since the last click, and from noisy label
    /// images, beside what the surface says.
    Field(FieldArguments),
    /// What such methods fail at: each condition disturbs a scene, its labels or the session, and has a line that its
    /// figure must reach. Fails where one is missed.
    Stability(StabilityArguments),
    /// How time and memory grow with frames, image size, rooms, classes and strokes, and with which power: the demo room,
    /// each capture in a process of its own.
    Scale(ScaleArguments),
    /// Accuracy against wall time, for the presets and other methods on the same clicks; with --capacity, against the
    /// size of the model.
    Pareto(ParetoArguments),
    /// What one method comes to with one seed, as JSON: a process of its own for each, so that its peak memory is its
    /// own.
    #[command(hide = true)]
    ParetoOf(ParetoOfArguments),
    /// What one capture costs, as JSON: a process of its own for each, so that its peak memory is its own.
    #[command(hide = true)]
    CostOf {
        /// Folder of a capture.
        scene: PathBuf,
        /// The strokes (JSON), the last of which is the one more click.
        #[arg(long, value_name = "FILE")]
        strokes: PathBuf,
        /// Seconds of training.
        #[arg(long, value_name = "SECONDS", value_parser = seconds)]
        seconds: f64,
        #[command(flatten)]
        training: TrainingArguments,
    },
}

/// Measuring everything.
#[derive(Debug, Args)]
pub struct AllArguments {
    /// Folders of captures with ground truth and split.json, or "demo" [default: demo].
    pub scenes: Vec<PathBuf>,
    /// Fewer seeds, shorter courses and the short form of the stability suite.
    #[arg(long)]
    pub quick: bool,
    /// Measure anew what this build has measured into the folder before.
    #[arg(long)]
    pub force: bool,
    /// Where benchmarks.md goes, and the folder benchmarks with the files of each measurement.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}

/// Measuring the engine.
#[derive(Debug, Args)]
pub struct EngineArguments {
    /// Folders of captures, or "demo".
    pub scenes: Vec<PathBuf>,
    /// Seconds of training after which a field is measured.
    #[arg(long, value_name = "SECONDS,...", value_delimiter = ',', default_value = "5,10,15,30,60", value_parser = seconds)]
    pub marks: Vec<f64>,
    /// What to train: auto, fast, accurate or reference, or several of them in turn.
    #[arg(long = "preset", value_name = "NAME,...", value_delimiter = ',', default_value = "auto", value_parser = preset)]
    pub presets: Vec<Preset>,
    /// Train the default with all that teaches it, and without one part each, instead of presets.
    #[arg(long, conflicts_with = "presets")]
    pub ablate: bool,
    /// Leave measured depth aside in training.
    #[arg(long)]
    pub no_depth: bool,
    /// Seed of everything random; of the first run of each scene.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Runs of each scene, with seeds that count up from --seed.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    pub seeds: u64,
    /// Where engine.json and engine.svg go.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Runs of each way.
    #[arg(long, value_name = "N", default_value_t = 15)]
    pub rounds: usize,
    /// Threads to compute with [default: all cores].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub threads: Option<u16>,
    /// Print the results as JSON.
    #[arg(long)]
    pub json: bool,
}

/// The paper's experiments.
#[derive(Debug, Args)]
pub struct PaperArguments {
    /// Folders of captures with ground truth and split.json, or "demo".
    #[arg(required = true)]
    pub scenes: Vec<PathBuf>,
    /// Runs of each scene, with seeds that count up from --seed.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    pub seeds: u64,
    /// Seconds of training the field where depth is missing; complete depth needs none.
    #[arg(long, value_name = "SECONDS", default_value_t = 120.0, value_parser = seconds)]
    pub seconds: f64,
    /// Only these experiments, by their names in the results [default: all].
    #[arg(long, value_name = "NAME,...", value_delimiter = ',', value_parser = experiment)]
    pub experiments: Vec<String>,
    /// Captures with ground truth and classes.json, or "demo", whose label images teach the pixel classifier of the
    /// experiment "fusion", which is left out without them. Classes are matched by name; those that a scene does not
    /// share with these are predicted as others and not measured.
    #[arg(long, value_name = "SCENE", num_args = 1..)]
    pub train_on: Vec<PathBuf>,
    /// Where paper.csv goes.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Print the results as JSON.
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub training: TrainingArguments,
}

/// Measuring how long clicks wait.
#[derive(Debug, Args)]
pub struct LatencyArguments {
    /// Folders of captures with ground truth and split.json, or "demo".
    #[arg(required = true)]
    pub scenes: Vec<PathBuf>,
    /// Clicks in each scene.
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u16).range(1..))]
    pub clicks: u16,
    /// Where latency.json and latency.svg go.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Print the results as JSON: an object for one scene, an array of them for several.
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub training: TrainingArguments,
}

/// Measuring the semantic field.
#[derive(Debug, Args)]
pub struct FieldArguments {
    /// Folders of captures with ground truth and split.json, or "demo".
    #[arg(required = true)]
    pub scenes: Vec<PathBuf>,
    /// Random clicks a class, given all at once.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..))]
    pub clicks: u16,
    /// Shares of the training frames' pixels that get a random class, in per cent.
    #[arg(long, value_name = "PER CENT,...", value_delimiter = ',', default_value = "50,90", value_parser = per_cent)]
    pub noise: Vec<f64>,
    /// Seconds after the labels at which the answers are measured.
    #[arg(long, value_name = "SECONDS,...", value_delimiter = ',', default_value = "0.5,1,2,5,10,30", value_parser = seconds)]
    pub marks: Vec<f64>,
    /// Every so many pixels along each axis are measured.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u16).range(1..))]
    pub stride: u16,
    /// Most seconds of learning the geometry before there are labels [default: until it is learnt].
    #[arg(long, value_name = "SECONDS", value_parser = seconds_or_none)]
    pub geometry: Option<f64>,
    /// Runs of each scene, with seeds that count up from --seed.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    pub seeds: u64,
    /// Where field.csv and field.svg go.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Print the results as JSON.
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub training: TrainingArguments,
}

/// Measuring how cost grows.
#[derive(Debug, Args)]
pub struct ScaleArguments {
    /// What to vary, one at a time, while there are 100 frames, 20 classes, 60 strokes and one room of everything else:
    /// frames, size, rooms, classes, strokes.
    #[arg(
        long = "sweep",
        value_name = "NAME,...",
        value_delimiter = ',',
        default_value = "frames,size,rooms,classes,strokes"
    )]
    pub sweeps: Vec<Sweep>,
    /// Numbers of frames.
    #[arg(long, value_name = "N,...", value_delimiter = ',', default_value = "20,50,100,200,500,1000,2000", value_parser = clap::value_parser!(u16).range(8..))]
    pub frames: Vec<u16>,
    /// Image sizes.
    #[arg(long, value_name = "WxH,...", value_delimiter = ',', default_value = "160x120,320x240,640x480,1280x960", value_parser = image_size)]
    pub sizes: Vec<(u32, u32)>,
    /// Numbers of rooms, which share the frames.
    #[arg(long, value_name = "N,...", value_delimiter = ',', default_value = "1,2,4,10", value_parser = clap::value_parser!(u16).range(1..=50))]
    pub rooms: Vec<u16>,
    /// Numbers of classes, all with as many strokes as the most of them, so that each class has one.
    #[arg(long, value_name = "N,...", value_delimiter = ',', default_value = "2,5,20,50,200", value_parser = clap::value_parser!(u16).range(1..))]
    pub classes: Vec<u16>,
    /// Numbers of strokes.
    #[arg(long, value_name = "N,...", value_delimiter = ',', default_value = "1,10,100,1000,10000", value_parser = clap::value_parser!(u16).range(1..))]
    pub strokes: Vec<u16>,
    /// Image size where that is not varied.
    #[arg(long, value_name = "WxH", default_value = "320x240", value_parser = image_size)]
    pub at_size: (u32, u32),
    /// Seconds of training of each capture.
    #[arg(long, value_name = "SECONDS", default_value_t = 5.0, value_parser = seconds)]
    pub seconds: f64,
    /// Leave measured depth aside.
    #[arg(long)]
    pub no_depth: bool,
    /// Threads to compute with [default: all cores].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub threads: Option<u16>,
    /// Seed of everything random, the places of the strokes among it.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Where scale.json, scale.csv and scale.svg go.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Print the results as JSON.
    #[arg(long)]
    pub json: bool,
}

/// Trying what such methods fail at.
#[derive(Debug, Args)]
pub struct StabilityArguments {
    /// Folders of captures with ground truth and split.json, or "demo" [default: demo].
    pub scenes: Vec<PathBuf>,
    /// Only these conditions, by their names in the results [default: all].
    #[arg(long, value_name = "NAME,...", value_delimiter = ',', value_parser = condition)]
    pub conditions: Vec<String>,
    /// Only the conditions of the short form, which takes minutes.
    #[arg(long, conflicts_with = "conditions")]
    pub quick: bool,
    /// Runs of each condition, with seeds that count up from --seed.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..))]
    pub seeds: u64,
    /// Most seconds of training before the maps of a scene with depth are measured.
    #[arg(long, value_name = "SECONDS", default_value_t = 2.0, value_parser = seconds)]
    pub seconds: f64,
    /// The same of a scene without depth.
    #[arg(long, value_name = "SECONDS", default_value_t = 20.0, value_parser = seconds)]
    pub seconds_without_depth: f64,
    /// Seconds of the long training.
    #[arg(long, value_name = "SECONDS", default_value_t = 30.0, value_parser = seconds)]
    pub long_seconds: f64,
    /// Where stability.csv and stability.md go.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Print the results as JSON.
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub training: TrainingArguments,
}

/// Accuracy against time and size.
#[derive(Debug, Args)]
pub struct ParetoArguments {
    /// Folders of captures with ground truth and split.json, or "demo".
    #[arg(required = true)]
    pub scenes: Vec<PathBuf>,
    /// What is measured in turn: fast, auto, accurate; and reference, the published network, which has maps at the
    /// last mark alone.
    #[arg(long = "preset", value_name = "NAME,...", value_delimiter = ',', default_value = "fast,auto,accurate", value_parser = preset)]
    pub presets: Vec<Preset>,
    /// Measure other methods on the same clicks too: the click nearest in a straight line (nearest), a joint network of
    /// positions (joint-mlp) and a pixel classifier (pixels), or some of them. They answer once.
    #[arg(
        long,
        value_name = "NAME,...",
        value_delimiter = ',',
        num_args = 0..=1,
        require_equals = true,
        default_missing_values = Baseline::QUICK.map(Baseline::name)
    )]
    pub baselines: Vec<Baseline>,
    /// Measure "auto" also with a quarter, half, twice and four times the field's table and the surface's voxels that it
    /// chooses, each by itself.
    #[arg(long)]
    pub capacity: bool,
    /// Random clicks of every class on the training frames, given as soon as the scene is open.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..))]
    pub clicks: u16,
    /// Wall seconds since the start at which the maps are measured; a run ends at the last, or when it has stopped by
    /// itself.
    #[arg(long, value_name = "SECONDS,...", value_delimiter = ',', default_value = "2,5,10,20,40,60,120", value_parser = seconds)]
    pub marks: Vec<f64>,
    /// Runs of each method, with seeds that count up from --seed.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..))]
    pub seeds: u64,
    /// Where pareto.csv and pareto.svg go, and capacity.csv and capacity.svg.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Leave measured depth and sparse points aside.
    #[arg(long)]
    pub no_depth: bool,
    /// Read images that the capture names outside its folder, or that links lead to there.
    #[arg(long)]
    pub outside_files: bool,
    /// Threads of each method [default: all cores].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub threads: Option<u16>,
    /// Seed of everything random; of the first run of each method.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Print the results as JSON.
    #[arg(long)]
    pub json: bool,
}

/// One method with one seed.
#[derive(Debug, Args)]
pub struct ParetoOfArguments {
    /// Folder of a capture with ground truth and split.json, or "demo".
    pub scene: PathBuf,
    /// A preset, or a baseline.
    #[arg(long, value_name = "NAME")]
    pub method: Method,
    /// Random clicks of every class.
    #[arg(long, value_name = "N")]
    pub clicks: usize,
    /// Wall seconds at which the maps are measured.
    #[arg(long, value_name = "SECONDS,...", value_delimiter = ',', value_parser = seconds)]
    pub marks: Vec<f64>,
    /// Factor on the rows of the field's table.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = factor)]
    pub field: f32,
    /// Factor on the number of the surface's voxels.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = factor)]
    pub surface: f32,
    #[command(flatten)]
    pub training: TrainingArguments,
}

fn factor(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(factor) if (0.01..=100.0).contains(&factor) => Ok(factor),
        _ => Err("give a factor from 0.01 to 100".to_owned()),
    }
}

fn experiment(name: &str) -> Result<String, String> {
    let names: Vec<&str> = EXPERIMENTS
        .iter()
        .map(|experiment| experiment.name)
        .chain([FUSION])
        .collect();
    if names.contains(&name) {
        return Ok(name.to_owned());
    }
    Err(format!("use some of {}", names.join(", ")))
}

fn condition(name: &str) -> Result<String, String> {
    let known = conditions();
    let names: Vec<&str> = known.iter().map(|condition| condition.name).collect();
    if names.contains(&name) {
        return Ok(name.to_owned());
    }
    Err(format!("use some of {}", names.join(", ")))
}

fn per_cent(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(share) if (0.0..=100.0).contains(&share) => Ok(share),
        _ => Err("give per cent, from 0 to 100".to_owned()),
    }
}
