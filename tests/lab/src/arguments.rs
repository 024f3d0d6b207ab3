//! The command line of the laboratory.

use std::path::PathBuf;

use clap::builder::PossibleValuesParser;
use clap::{Args, Parser, Subcommand, ValueEnum};
use inplace_core::arguments::{ReadingArguments, TrainingArguments, Wanted, image_size, number, seconds};
use inplace_core::field::Preset;

use crate::paper::{EXPERIMENTS, FUSION};
use crate::scale::Sweep;
use crate::simulate::{Baseline, Policy};
use crate::stability::conditions;

/// Measures how good the maps of Inplace are, and what they cost.
#[derive(Debug, Parser)]
#[command(version)]
pub struct Arguments {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What the laboratory does.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Measure how good the maps of frames without clicks become as a simulated annotator, who knows the ground truth,
    /// clicks on the training frames.
    Simulate(SimulateArguments),
    /// Measure one thing, or all of them.
    Bench {
        /// What to measure.
        #[command(subcommand)]
        what: Bench,
    },
}

/// Where results go.
#[derive(Clone, Debug, Args)]
pub struct OutputArguments {
    /// Where the results go: a page, tables as CSV or JSON, and charts as SVG.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Print the results as JSON.
    #[arg(long)]
    pub json: bool,
}

/// What a measurement of several captures takes.
#[derive(Clone, Debug, Args)]
pub struct SceneArguments {
    /// Folders of captures with ground truth and split.json, or "demo".
    #[arg(required = true)]
    pub scenes: Vec<PathBuf>,
    /// Where its results go.
    #[command(flatten)]
    pub output: OutputArguments,
    /// How scenes are read and learnt.
    #[command(flatten)]
    pub training: TrainingArguments,
}

/// A simulated annotator.
#[derive(Debug, Args)]
pub struct SimulateArguments {
    /// Folder of a capture with ground truth and split.json, or "demo"; for the policy own, of one with clicks.json.
    pub scene: PathBuf,
    /// Where the annotator clicks: guided (one random pixel of every class, then the program's suggestions),
    /// random (equally many pixels of every class) or uniform (any pixels), or several of them in turn; or own, the clicks in
    /// clicks.json of a capture that has label images of test frames alone.
    #[arg(
        long = "policy",
        value_name = "NAME,...",
        value_delimiter = ',',
        default_value = "guided",
        hide_possible_values = true
    )]
    pub policies: Vec<Policy>,
    /// Clicks a class, in the whole scene, after which the maps are measured.
    #[arg(long, value_name = "N,...", value_delimiter = ',', default_value = "1,3,5,10", value_parser = clap::value_parser!(u16).range(1..))]
    pub clicks: Vec<u16>,
    /// Runs, with seeds that count up from --seed.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..))]
    pub seeds: u64,
    /// Where the results go.
    #[command(flatten)]
    pub output: OutputArguments,
    /// Most seconds of learning the geometry before the first click [default: until it is learnt].
    #[arg(long, value_name = "SECONDS", value_parser = seconds_or_none)]
    pub geometry: Option<f64>,
    /// Most seconds after the last click of each batch before the maps are measured; 0 trains nothing more and
    /// measures what the surface graph says.
    #[arg(long, value_name = "SECONDS", default_value = "60", value_parser = seconds_or_none)]
    pub settle: f64,
    /// Measure other methods on the clicks of "random" too: the click nearest in a straight line (nearest), a
    /// joint network of positions (joint-mlp) and a pixel classifier (pixels), or some of them.
    #[arg(
        long,
        value_name = "NAME,...",
        value_delimiter = ',',
        num_args = 0..=1,
        require_equals = true,
        default_missing_values = Baseline::value_variants().iter().map(|baseline| baseline.name()),
        hide_possible_values = true
    )]
    pub baselines: Vec<Baseline>,
    /// Click on objects in place of classes, as many times on each, and measure the objects of the maps: of the demo or a
    /// capture with semantic_instance and objects.json, on the surface graph alone. With "guided", also begin with one click
    /// on each class and follow suggestions. Writes objects.csv.
    #[arg(long, conflicts_with_all = ["baselines", "settle"])]
    pub objects: bool,
    /// How scenes are read and learnt.
    #[command(flatten)]
    pub training: TrainingArguments,
}

/// What can be measured.
#[derive(Debug, Subcommand)]
pub enum Bench {
    /// All of the below, one after the other, on one page that begins with ten lines and two charts; of each capture what it
    /// has the truth for. It takes about an hour, with --quick ten minutes.
    All(AllArguments),
    /// What finds wrong labels: sampled audits beside the true accuracy, and the list of contradicted strokes where wrong
    /// ones were planted.
    Audit(AuditArguments),
    /// Samples a second of each way to compute the field; how soon a field of each scene is good.
    Engine(EngineArguments),
    /// The experiments of the Semantic-NeRF paper: sparse, noisy, coarse and partial label images of the
    /// training frames, beside the paper's numbers.
    Paper(PaperArguments),
    /// How long a click waits for its maps while the field is being trained: for that of the frame in view and
    /// for those of all frames. As JSON an object for one scene, an array of them for several.
    Latency(LatencyArguments),
    /// The labels that the semantic field renders, as seconds pass since the last click, and from noisy label
    /// images, beside what the surface says.
    Field(FieldArguments),
    /// What such methods fail at: each condition disturbs a scene, its labels or the session, and has a line that its
    /// figure must reach. Fails where one is missed.
    Stability(StabilityArguments),
    /// Depth that is estimated from colours alone, beside the capture's measured depth.
    Stereo(StereoArguments),
    /// How time and memory grow with frames, image size, rooms, classes and strokes, and with which power: the demo room,
    /// each capture in a process of its own.
    Scale(ScaleArguments),
    /// Accuracy against wall time, for the presets; with --capacity, of models of other sizes too.
    Pareto(ParetoArguments),
}

/// Measuring everything.
#[derive(Debug, Args)]
pub struct AllArguments {
    /// Folders of captures with ground truth and split.json, "demo", or captures with label images of test frames and
    /// clicks.json.
    #[arg(default_value = "demo")]
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

/// Measuring what finds wrong labels.
#[derive(Debug, Args)]
pub struct AuditArguments {
    /// Random clicks a class on the training frames.
    #[arg(long, value_name = "N,...", value_delimiter = ',', default_value = "3,10", value_parser = clap::value_parser!(u16).range(1..))]
    pub clicks: Vec<u16>,
    /// Share of the frames that an audit draws places from, in per cent.
    #[arg(long, value_name = "PER CENT", default_value_t = 5.0, value_parser = per_cent)]
    pub share: f64,
    /// Audits of the maps of each run.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u16).range(1..))]
    pub audits: u16,
    /// Runs of each scene, with seeds that count up from --seed.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    pub seeds: u64,
    /// What is measured, and how.
    #[command(flatten)]
    pub on: SceneArguments,
}

/// Measuring the engine.
#[derive(Debug, Args)]
pub struct EngineArguments {
    /// Folders of captures, or "demo".
    pub scenes: Vec<PathBuf>,
    /// Seconds of training after which a field is measured.
    #[arg(long, value_name = "SECONDS,...", value_delimiter = ',', default_value = "5,10,15,30,60", value_parser = seconds)]
    pub marks: Vec<f64>,
    /// What to train: auto, fast or accurate, or several of them in turn.
    #[arg(
        long = "preset",
        value_enum,
        hide_possible_values = true,
        value_name = "NAME,...",
        value_delimiter = ',',
        default_value = "auto"
    )]
    pub presets: Vec<Preset>,
    /// Train the default with all that teaches it, and without one part each, instead of presets.
    #[arg(long, conflicts_with = "presets")]
    pub ablate: bool,
    /// Runs of each scene, with seeds that count up from --seed.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    pub seeds: u64,
    /// Where the results go.
    #[command(flatten)]
    pub output: OutputArguments,
    /// Runs of each way.
    #[arg(long, value_name = "N", default_value_t = 15)]
    pub rounds: usize,
    /// What is read of the scenes, and what they are computed with.
    #[command(flatten)]
    pub reading: ReadingArguments,
}

/// The paper's experiments.
#[derive(Debug, Args)]
pub struct PaperArguments {
    /// Runs of each scene, with seeds that count up from --seed.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    pub seeds: u64,
    /// Seconds of training the field where depth is missing; complete depth needs none.
    #[arg(long, value_name = "SECONDS", default_value_t = 120.0, value_parser = seconds)]
    pub seconds: f64,
    /// Only these experiments, by their names in the results [default: all].
    #[arg(long, value_name = "NAME,...", value_delimiter = ',', value_parser = experiments(), hide_possible_values = true)]
    pub experiments: Vec<String>,
    /// What is measured, and how.
    #[command(flatten)]
    pub on: SceneArguments,
}

/// Measuring how long clicks wait.
#[derive(Debug, Args)]
pub struct LatencyArguments {
    /// Clicks in each scene.
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u16).range(1..))]
    pub clicks: u16,
    /// Objects that strokes name before the first click; each click is on another one then.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub objects: u16,
    /// What is measured, and how.
    #[command(flatten)]
    pub on: SceneArguments,
}

/// Measuring the semantic field.
#[derive(Debug, Args)]
pub struct FieldArguments {
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
    /// What is measured, and how.
    #[command(flatten)]
    pub on: SceneArguments,
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
        default_value = "frames,size,rooms,classes,strokes",
        hide_possible_values = true
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
    /// Where the results go.
    #[command(flatten)]
    pub output: OutputArguments,
    /// What is read of the captures, and what they are computed with.
    #[command(flatten)]
    pub reading: ReadingArguments,
    /// Measure only this capture with its strokes, in this process, and print what it cost as JSON.
    #[arg(long, value_name = "DIR", hide = true)]
    pub cost_of: Option<PathBuf>,
}

/// Trying what such methods fail at.
#[derive(Clone, Debug, Args)]
pub struct StabilityArguments {
    /// Folders of captures with ground truth and split.json, or "demo".
    #[arg(default_value = "demo")]
    pub scenes: Vec<PathBuf>,
    /// Only these conditions, by their names in the results [default: all].
    #[arg(long, value_name = "NAME,...", value_delimiter = ',', value_parser = condition_names(), hide_possible_values = true)]
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
    /// Where the results go.
    #[command(flatten)]
    pub output: OutputArguments,
    /// How scenes are read and learnt.
    #[command(flatten)]
    pub training: TrainingArguments,
}

/// Estimating depth.
#[derive(Debug, Args)]
pub struct StereoArguments {
    /// Folders of captures, or "demo"; errors are those of captures with measured depth.
    #[arg(required = true)]
    pub scenes: Vec<PathBuf>,
    /// Where the results go.
    #[command(flatten)]
    pub output: OutputArguments,
    /// Read images that a file of the capture names outside its folder.
    #[arg(long)]
    pub outside_files: bool,
    /// Threads to compute with [default: all cores].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub threads: Option<u16>,
}

/// Accuracy against time and size.
#[derive(Debug, Args)]
pub struct ParetoArguments {
    /// Folders of captures with ground truth and split.json, "demo", or captures with label images of test frames and
    /// clicks.json.
    #[arg(required = true)]
    pub scenes: Vec<PathBuf>,
    /// What is measured in turn: fast, auto, accurate.
    #[arg(
        long = "preset",
        value_enum,
        hide_possible_values = true,
        value_name = "NAME,...",
        value_delimiter = ',',
        default_value = "fast,auto,accurate"
    )]
    pub presets: Vec<Preset>,
    /// Measure also what stereo makes of a scene without a field, and a field without stereo.
    #[arg(long, requires = "no_depth")]
    pub alone: bool,
    /// Measure the model of "auto" by itself, and with half and twice the field's table and the surface's voxels that are
    /// chosen for the scene.
    #[arg(long)]
    pub capacity: bool,
    /// Random clicks of every class on the training frames, given as soon as the scene is open; of a capture with label
    /// images of test frames alone, those in its clicks.json.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..))]
    pub clicks: u16,
    /// Wall seconds since the start at which the maps are measured; a run ends at the last, or when it has stopped by
    /// itself.
    #[arg(long, value_name = "SECONDS,...", value_delimiter = ',', default_value = "2,5,10,20,40,60,120", value_parser = seconds)]
    pub marks: Vec<f64>,
    /// Runs of each method, with seeds that count up from --seed.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..))]
    pub seeds: u64,
    /// Where the results go.
    #[command(flatten)]
    pub output: OutputArguments,
    /// What is read of the scenes, and what they are computed with.
    #[command(flatten)]
    pub reading: ReadingArguments,
    /// Measure only the run with this number, in this process, and print what it came to as JSON.
    #[arg(long, value_name = "N", hide = true)]
    pub run: Option<usize>,
}

fn seconds_or_none(text: &str) -> Result<f64, Wanted> {
    let fits = |seconds: &f64| (0.0..1e9).contains(seconds);
    number(text, fits, "give a number of seconds, zero or above")
}

fn experiments() -> PossibleValuesParser {
    EXPERIMENTS.iter().map(|(name, ..)| *name).chain([FUSION]).into()
}

fn condition_names() -> PossibleValuesParser {
    conditions().into_iter().map(|condition| condition.name).into()
}

fn per_cent(text: &str) -> Result<f64, Wanted> {
    let fits = |share: &f64| (0.0..=100.0).contains(share);
    number(text, fits, "give per cent, from 0 to 100")
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Arguments::command().debug_assert();
    }
}
