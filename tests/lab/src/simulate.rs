//! `inplace-lab simulate`, the interactive experiment: an annotator who knows the truth labels single pixels of the training frames,
//! and the maps of the test frames are measured as the clicks grow.

mod annotator;
pub(super) mod baseline;
mod experiment;
mod objects;

use serde::Serialize;

pub use annotator::{Annotator, Click, Policy, name_objects};
pub use baseline::Baseline;
use experiment::simulate;
use objects::{OBJECT_COLUMNS, click_rows, object_rows, simulate_objects};

use super::arguments::SimulateArguments;
use super::chart::{Axis, Figure, Panel, Point, Scale, Series};
use super::commands::{counted, grouped};
use super::page::{Page, known};
use super::table::csv;
use super::{Calibration, Failure, Scores, mean};
use inplace_core::arguments::TrainingArguments;
use inplace_core::export;
use inplace_core::field::Preset;
use inplace_core::scene::SceneSource;
use inplace_core::session::Progress;

/// Share of a line's pixels below which a bin of confidence is not drawn: it would show little but chance.
const LEAST_SHARE: f64 = 1e-3;

/// How good the maps of the test frames were after so many clicks.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SimulatedPoint {
    /// Name of the scene.
    pub scene: String,
    /// Where the annotator clicked.
    pub policy: String,
    /// Seed of the clicks and of the session.
    pub seed: u64,
    /// Clicks there were for each class of the training frames.
    pub clicks_per_class: usize,
    /// Strokes in all.
    pub strokes: usize,
    /// The scores of the test frames.
    #[serde(flatten)]
    pub scores: Scores,
    /// How right the probabilities of the test frames are, of maps that have any.
    #[serde(rename = "ece")]
    pub calibration: Option<Calibration>,
    /// Wall seconds: opening and learning the scene, which the policies of a seed share, and labelling; without
    /// measuring.
    pub wall_s: f64,
}

impl SimulatedPoint {
    /// The expected calibration error; `None` of maps without probabilities.
    pub fn calibration_error(&self) -> Option<f64> {
        self.calibration.as_ref()?.error()
    }
}

/// The columns of `results.csv`, one row for each point.
pub const COLUMNS: &str = "scene policy seed clicks_per_class strokes miou:4 average_accuracy:4 total_accuracy:4 wall_s:2 \
                           boundary_miou:4";

/// The expected calibration errors of the points that have one, `calibration.csv`.
pub fn calibration_table(points: &[SimulatedPoint]) -> serde_json::Result<String> {
    let known = points.iter().filter(|point| point.calibration_error().is_some());
    let known: Vec<&SimulatedPoint> = known.collect();
    csv(&known, "scene policy seed clicks_per_class ece:4")
}

/// Simulates, writes `results.csv`, `calibration.csv` and their charts, or `objects.csv`, and prints.
pub fn run(arguments: &SimulateArguments) -> Result<(), Failure> {
    if arguments.training.preset == Preset::Reference {
        return Err("the published network learns a scene for each set of labels; measure it with `inplace label --preset reference`".into());
    }
    let out = &arguments.output.out;
    export::prepare(out, &[])?;
    let source = SceneSource::from_argument(&arguments.scene);
    let session = arguments.training.session_options(source);
    let threads = session.threads;
    let progress = Progress::default();
    if arguments.objects {
        let points = simulate_objects(arguments, &session, &mut |line| progress.show(line))?;
        drop(progress);
        export::write(&out.join("objects.csv"), csv(&points, OBJECT_COLUMNS)?.as_bytes())?;
        let mut page = Page::default();
        page.paragraph(&format!(
            "Objects on the test frames after so many clicks on each in the whole scene; at \"classes\", after one on each \
             class that names no object. {}: means over {} from {}.",
            points.first().map_or("", |point| point.scene.as_str()),
            counted(arguments.seeds, "seed"),
            arguments.training.reading.seed,
        ));
        page.table(
            "policy | clicks an object | clicks | IoU | of things | of stuff | PQ of things | SQ | RQ | PQ of stuff | \
             objects | seconds",
            &object_rows(&points),
        );
        page.paragraph(
            "Clicks on an object until its IoU is at least 0.80, 0.85 and 0.90; one that never gets there counts as the most \
             clicks.",
        );
        page.table("policy | to 0.80 | to 0.85 | to 0.90", &click_rows(&points));
        return page.publish(&arguments.output, "objects", &points);
    }
    let points = simulate(arguments, &session, &mut |line| progress.show(line))?;
    drop(progress);
    export::write(&out.join("results.csv"), csv(&points, COLUMNS)?.as_bytes())?;
    figure(arguments, threads, &points).write(&out.join("results.svg"))?;
    let rows = calibration_table(&points)?;
    export::write(&out.join("calibration.csv"), rows.as_bytes())?;
    reliability(arguments, threads, &points).write(&out.join("calibration.svg"))?;
    page(arguments, threads, &points).publish(&arguments.output, "results", &points)
}

/// A row for each policy and number of clicks: means over the seeds, and ranges.
fn page(arguments: &SimulateArguments, threads: usize, points: &[SimulatedPoint]) -> Page {
    let mut page = Page::default();
    page.paragraph(&format!(
        "mIoU on the test frames after so many clicks a class in the whole scene. {}.",
        conditions(arguments, threads, points, "mean and range")
    ));
    let mut rows = Vec::new();
    for ((policy, clicks), runs) in grouped(points, |point| (point.policy.clone(), point.clicks_per_class)) {
        let of = |value: &dyn Fn(&SimulatedPoint) -> f64| mean(runs.iter().map(|run| value(run)));
        let errors: Option<Vec<f64>> = runs.iter().map(|run| run.calibration_error()).collect();
        let (low, high) = miou(&runs, &|_| 0.0).map_or((f64::NAN, f64::NAN), |point| point.range);
        rows.push(vec![
            policy,
            clicks.to_string(),
            format!("{:.0}", of(&|run| run.strokes as f64)),
            format!("{:.3} ({low:.2} to {high:.2})", of(&|run| run.scores.miou)),
            format!("{:.3}", of(&|run| run.scores.average_accuracy)),
            format!("{:.3}", of(&|run| run.scores.total_accuracy)),
            known(of(&|run| run.scores.boundary_miou.unwrap_or(f64::NAN)), 3),
            known(errors.map(mean), 3),
            format!("{:.1}", of(&|run| run.wall_s)),
        ]);
    }
    page.table(
        "policy | clicks a class | strokes | mIoU | average accuracy | total accuracy | \
         boundary mIoU | calibration error | seconds",
        &rows,
    );
    page.chart("mIoU against clicks and time", "results.svg");
    page.chart("How right the probabilities are", "calibration.svg");
    page
}

/// mIoU against clicks and against wall time, a line for each policy: the mean over the seeds, with a band
/// from the lowest to the highest.
fn figure(arguments: &SimulateArguments, threads: usize, points: &[SimulatedPoint]) -> Figure {
    let lines = |across: &dyn Fn(&SimulatedPoint) -> f64| -> Vec<Series> {
        grouped(points, |point| point.policy.clone())
            .into_iter()
            .map(|(policy, own)| {
                let of_batch = grouped(own, |point| point.clicks_per_class).into_iter();
                let points = of_batch.filter_map(|(_, runs)| miou(&runs, across));
                Series::new(policy, points)
            })
            .collect()
    };
    let panel = |title: &str, x: &str, series: Vec<Series>| {
        let y = Axis::new("mIoU on the test frames", Scale::Linear);
        Panel::new(title, Axis::new(x, Scale::Linear), y, series)
    };
    let (clicks, seconds) = (
        "clicks a class in the whole scene",
        "seconds since the scene was opened",
    );
    Figure {
        title: "How labels spread from a few clicks".to_owned(),
        subtitle: conditions(arguments, threads, points, "mean and range"),
        rows: vec![vec![
            panel("by clicks", clicks, lines(&|point| point.clicks_per_class as f64)),
            panel("by time", seconds, lines(&|point| point.wall_s)),
        ]],
    }
}

/// Accuracy against confidence, a panel for each policy and a line for each number of clicks.
fn reliability(arguments: &SimulateArguments, threads: usize, points: &[SimulatedPoint]) -> Figure {
    let known = points.iter().filter(|point| point.calibration.is_some());
    let panels = grouped(known, |point| point.policy.clone());
    let panels = panels.into_iter().map(|(policy, own)| {
        let diagonal = [0.0, 1.0].map(|at| Point::new(at, at));
        let mut series = vec![Series::new("as likely as said", diagonal)];
        for (clicks, runs) in grouped(own, |point| point.clicks_per_class) {
            let mut all = Calibration::default();
            let of_runs = runs.iter().filter_map(|run| run.calibration.as_ref());
            of_runs.for_each(|calibration| all.merge(calibration));
            let bins = all.reliability(LEAST_SHARE).into_iter();
            let points = bins.map(|(confidence, accuracy)| Point::new(confidence, accuracy));
            series.push(Series::new(
                format!("{} a class", counted(clicks as u64, "click")),
                points,
            ));
        }
        Panel::new(
            policy,
            Axis::new("probability of the most likely class", Scale::FromZero),
            Axis::new("share that is right", Scale::FromZero),
            series,
        )
    });
    Figure {
        title: "How right the probabilities of the maps are".to_owned(),
        subtitle: conditions(arguments, threads, points, "all pixels of the test frames"),
        rows: vec![panels.collect()],
    }
}

/// What was measured, in a line; `what` is taken over the seeds.
fn conditions(
    arguments: &SimulateArguments,
    threads: usize,
    points: &[SimulatedPoint],
    what: &str,
) -> String {
    let TrainingArguments { preset, reading } = &arguments.training;
    let depth = if reading.no_depth { " without depth" } else { "" };
    let answer = match arguments.settle {
        0.0 => "the surface graph alone".to_owned(),
        settle => format!("maps measured at most {settle} s after a batch of clicks"),
    };
    format!(
        "{}{depth}; {} preset, {threads} threads; {what} over {} from {}; {answer}",
        points.first().map_or("", |point| point.scene.as_str()),
        preset.name(),
        counted(arguments.seeds, "seed"),
        reading.seed,
    )
}

/// The mean mIoU of runs with their range, at the mean of what is across.
fn miou(runs: &[&SimulatedPoint], across: &dyn Fn(&SimulatedPoint) -> f64) -> Option<Point> {
    Point::of_means(runs.iter().map(|run| (across(run), run.scores.miou)))
}
