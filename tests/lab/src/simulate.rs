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
use objects::{OBJECT_COLUMNS, click_rows, simulate_objects};

use super::arguments::SimulateArguments;
use super::chart::{Axis, Figure, Panel, Scale, Series};
use super::commands::{counted, grouped};
use super::page::Page;
use super::table::csv;
use super::{Calibration, Failure, Scores};
use inplace_core::arguments::TrainingArguments;
use inplace_core::export;
use inplace_core::scene::SceneSource;
use inplace_core::session::Progress;

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
    #[serde(flatten)]
    pub calibration: Option<Calibration>,
    /// Wall seconds: opening and learning the scene, which the policies of a seed share, and labelling; without
    /// measuring.
    pub wall_s: f64,
}

/// The columns of `results.csv`, one row for each point.
pub const COLUMNS: &str = "scene policy seed clicks_per_class strokes miou:4 average_accuracy:4 total_accuracy:4 wall_s:2 \
                           boundary_miou:4 ece:4 right_if_sure:4";

/// Simulates, writes `results.csv` with its chart, or `objects.csv`, and prints.
pub fn run(arguments: &SimulateArguments) -> Result<(), Failure> {
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
             class that names no object; at \"suggested\", after as many in all, of which only one on each class is not \
             suggested. {}: means over {} from {}.",
            points.first().map_or("", |point| point.scene.as_str()),
            counted(arguments.seeds, "seed"),
            arguments.training.reading.seed,
        ));
        page.means(
            &points,
            "policy | clicks an object=clicks_per_object | clicks:0 | IoU=iou:3 | of things=iou_things:3 | \
             of stuff=iou_stuff:3 | PQ of things=pq_things:3 | SQ=sq_things:3 | RQ=rq_things:3 | PQ of stuff=pq_stuff:3 | \
             objects:0 | seconds=wall_s:1",
        )?;
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
    page(arguments, threads, &points)?.publish(&arguments.output, "results", &points)
}

/// A row for each policy and number of clicks: means over the seeds, and ranges.
fn page(arguments: &SimulateArguments, threads: usize, points: &[SimulatedPoint]) -> Result<Page, Failure> {
    let mut page = Page::default();
    page.paragraph(&format!(
        "mIoU on the test frames after so many clicks a class in the whole scene. {}.",
        conditions(arguments, threads, points)
    ));
    page.means(
        points,
        "policy | clicks a class=clicks_per_class | strokes:0 | mIoU=miou:3~ | average accuracy=average_accuracy:3 | \
         total accuracy=total_accuracy:3 | boundary mIoU=boundary_miou:3 | calibration error=ece:3 | seconds=wall_s:1",
    )?;
    page.chart("mIoU against clicks and time", "results.svg");
    Ok(page)
}

/// mIoU against clicks and against wall time, a line for each policy: the mean over the seeds, with a band
/// from the lowest to the highest.
fn figure(arguments: &SimulateArguments, threads: usize, points: &[SimulatedPoint]) -> Figure {
    let lines = |across: &dyn Fn(&SimulatedPoint) -> f64| -> Vec<Series> {
        let policies = grouped(points, |point| point.policy.clone()).into_iter();
        let line = policies.map(|(policy, own)| {
            let told = |point: &SimulatedPoint| (point.clicks_per_class, across(point), point.scores.miou);
            Series::of_means(policy, own.into_iter().map(told))
        });
        line.collect()
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
        subtitle: conditions(arguments, threads, points),
        panels: vec![
            panel("by clicks", clicks, lines(&|point| point.clicks_per_class as f64)),
            panel("by time", seconds, lines(&|point| point.wall_s)),
        ],
    }
}

/// What was measured, in a line.
fn conditions(arguments: &SimulateArguments, threads: usize, points: &[SimulatedPoint]) -> String {
    let TrainingArguments {
        preset,
        reading,
        features,
    } = &arguments.training;
    let depth = if reading.no_depth { " without depth" } else { "" };
    let network = features.as_ref().map_or("", |_| " and a pretrained network");
    let answer = match arguments.settle {
        0.0 => "the surface graph alone".to_owned(),
        settle => format!("maps measured at most {settle} s after a batch of clicks"),
    };
    format!(
        "{}{depth}; {} preset{network}, {threads} threads; mean and range over {} from {}; {answer}",
        points.first().map_or("", |point| point.scene.as_str()),
        preset.name(),
        counted(arguments.seeds, "seed"),
        reading.seed,
    )
}
