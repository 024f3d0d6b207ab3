//! `inplace-lab simulate`: maps measured as a simulated annotator clicks.

use std::time::Duration;

use crate::chart::{Axis, Figure, Panel, Point, Scale, Series};
use crate::simulate::{Experiment, SimulatedPoint, calibration_table, simulate, table};
use crate::{Calibration, mean_and_deviation};
use inplace_core::export;
use inplace_core::field::Preset;
use inplace_core::scene::SceneSource;

use super::grouped;
use super::{Failure, cores, session_options};
use crate::arguments::SimulateArguments;
use crate::page::Page;
use crate::progress::Progress;

/// Share of a line's pixels below which a bin of confidence is not drawn: it would show little but chance.
const LEAST_SHARE: f64 = 1e-3;

/// Simulates, writes `results.csv`, `calibration.csv` and their charts, and prints.
pub fn run(arguments: &SimulateArguments) -> Result<(), Failure> {
    if arguments.training.preset == Preset::Reference {
        return Err("the published network learns a scene for each set of labels; measure it with `inplace label --preset reference`".into());
    }
    let out = &arguments.out;
    export::prepare(out, &[])?;
    let source = SceneSource::from_argument(&arguments.scene);
    let session = session_options(&arguments.training, source, cores());
    let threads = session.threads;
    let experiment = Experiment {
        session,
        policies: arguments.policies.clone(),
        clicks: arguments
            .clicks
            .iter()
            .map(|&clicks| usize::from(clicks))
            .collect(),
        seeds: arguments.seeds,
        geometry: arguments.geometry.map(Duration::from_secs_f64),
        settle: Duration::from_secs_f64(arguments.settle),
        baselines: arguments.baselines.clone(),
    };
    let mut progress = Progress::new();
    let points = simulate(&experiment, &mut |line| progress.show(line))?;
    drop(progress);
    export::write(&out.join("results.csv"), table(&points)?.as_bytes())?;
    figure(arguments, threads, &points).write(&out.join("results.svg"))?;
    export::write(
        &out.join("calibration.csv"),
        calibration_table(&points)?.as_bytes(),
    )?;
    reliability(arguments, threads, &points).write(&out.join("calibration.svg"))?;
    page(arguments, threads, &points).publish(out, "results", arguments.json, &points)
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
        let of = |value: &dyn Fn(&SimulatedPoint) -> f64| {
            mean_and_deviation(&runs.iter().map(|run| value(run)).collect::<Vec<_>>()).0
        };
        let errors: Option<Vec<f64>> = runs.iter().map(|run| run.calibration_error()).collect();
        let error = errors.map(|errors| mean_and_deviation(&errors).0);
        let miou = mean(&runs, &|_| 0.0);
        rows.push(vec![
            policy,
            clicks.to_string(),
            format!("{:.0}", of(&|run| run.strokes as f64)),
            format!("{:.3} ({:.2} to {:.2})", miou.y, miou.range.0, miou.range.1),
            format!("{:.3}", of(&|run| run.scores.average_accuracy)),
            format!("{:.3}", of(&|run| run.scores.total_accuracy)),
            error.map_or("-".to_owned(), |error| format!("{error:.3}")),
            format!("{:.1}", of(&|run| run.wall_s)),
        ]);
    }
    page.table(
        "policy | clicks a class | strokes | mIoU | average accuracy | total accuracy | \
         calibration error | seconds",
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
                Series {
                    name: policy,
                    points: of_batch.map(|(_, runs)| mean(&runs, across)).collect(),
                }
            })
            .collect()
    };
    let panel = |title: &str, x: Axis, series: Vec<Series>| {
        Panel::of_lines(
            title,
            x,
            Axis::new("mIoU on the test frames", Scale::Linear),
            series,
        )
    };
    let clicks = Axis::new("clicks a class in the whole scene", Scale::Linear);
    let seconds = Axis::new("seconds since the scene was opened", Scale::Linear);
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
        let mut series = vec![Series {
            name: "as likely as said".to_owned(),
            points: vec![Point::new(0.0, 0.0), Point::new(1.0, 1.0)],
        }];
        series.extend(
            grouped(own, |point| point.clicks_per_class)
                .into_iter()
                .map(|(clicks, runs)| {
                    let mut all = Calibration::default();
                    let of_runs = runs.iter().filter_map(|run| run.calibration.as_ref());
                    of_runs.for_each(|calibration| all.merge(calibration));
                    let bins = all.reliability(LEAST_SHARE).into_iter();
                    Series {
                        name: format!("{clicks} click{} a class", if clicks == 1 { "" } else { "s" }),
                        points: bins
                            .map(|(confidence, accuracy)| Point::new(confidence, accuracy))
                            .collect(),
                    }
                }),
        );
        Panel::of_lines(
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
    let answer = if arguments.settle == 0.0 {
        "the surface graph alone".to_owned()
    } else {
        format!(
            "maps measured at most {} s after a batch of clicks",
            arguments.settle
        )
    };
    format!(
        "{}{}; {} preset, {threads} threads; {what} over {} seed{} from {}; {answer}",
        points.first().map_or("", |point| point.scene.as_str()),
        if arguments.training.no_depth {
            " without depth"
        } else {
            ""
        },
        arguments.training.preset.name(),
        arguments.seeds,
        if arguments.seeds == 1 { "" } else { "s" },
        arguments.training.seed,
    )
}

fn mean(runs: &[&SimulatedPoint], across: &dyn Fn(&SimulatedPoint) -> f64) -> Point {
    let x: Vec<f64> = runs.iter().map(|run| across(run)).collect();
    let y: Vec<f64> = runs.iter().map(|run| run.scores.miou).collect();
    let low = y.iter().copied().fold(f64::INFINITY, f64::min);
    let high = y.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    Point {
        range: (low, high),
        ..Point::new(mean_and_deviation(&x).0, mean_and_deviation(&y).0)
    }
}
