//! `inplace simulate`: maps measured as a simulated annotator clicks.

use std::time::Duration;

use inplace_core::eval::chart::{Axis, Chart, Figure, Panel, Point, Scale, Series};
use inplace_core::eval::simulate::{Experiment, SimulatedPoint, simulate, table};
use inplace_core::field::Preset;
use inplace_core::scene::SceneSource;

use super::bench::engine::grouped;
use super::progress::Progress;
use super::{Failure, cores, session_options};
use crate::arguments::SimulateArguments;

/// Simulates, writes `results.csv` and `results.svg`, and prints.
pub fn run(arguments: &SimulateArguments) -> Result<(), Failure> {
    if arguments.training.preset == Preset::Reference {
        return Err("the published network learns a scene for each set of labels; measure it with `inplace label --preset reference`".into());
    }
    let out = &arguments.out;
    std::fs::create_dir_all(out).map_err(|error| format!("{}: cannot be made: {error}", out.display()))?;
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
        baselines: arguments.baselines,
    };
    let mut progress = Progress::new();
    let points = simulate(&experiment, &mut |line| progress.show(line))?;
    drop(progress);
    table(&points).write(&out.join("results.csv"))?;
    figure(arguments, threads, &points).write(&out.join("results.svg"))?;
    if arguments.json {
        println!("{}", serde_json::to_string_pretty(&points)?);
    } else {
        print(&points);
    }
    Ok(())
}

/// Mean and standard deviation.
fn summary(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
    (mean, variance.sqrt())
}

fn print(points: &[SimulatedPoint]) {
    println!("policy               clicks a class  strokes  mIoU (sd)        average   total   seconds");
    for ((policy, clicks), runs) in grouped(points, |point| (point.policy.clone(), point.clicks_per_class)) {
        let of = |value: &dyn Fn(&SimulatedPoint) -> f64| {
            summary(&runs.iter().map(|run| value(run)).collect::<Vec<_>>())
        };
        let (miou, deviation) = of(&|run| run.scores.miou);
        println!(
            "{policy:20} {clicks:>14} {:>8.0}  {miou:.3} ({deviation:.3}) {:>13.3} {:>7.3} {:>9.1}",
            of(&|run| run.strokes as f64).0,
            of(&|run| run.scores.average_accuracy).0,
            of(&|run| run.scores.total_accuracy).0,
            of(&|run| run.wall_s).0,
        );
    }
}

/// mIoU against clicks and against wall time, a line for each policy: the mean over the seeds, with a band
/// from the lowest to the highest.
fn figure(arguments: &SimulateArguments, threads: usize, points: &[SimulatedPoint]) -> Figure {
    let lines = |across: &dyn Fn(&SimulatedPoint) -> f64| -> Vec<Series> {
        grouped(points, |point| point.policy.clone())
            .into_iter()
            .map(|(policy, own)| {
                let own: Vec<SimulatedPoint> = own.into_iter().cloned().collect();
                let of_batch = grouped(&own, |point| point.clicks_per_class).into_iter();
                Series {
                    name: policy,
                    points: of_batch.map(|(_, runs)| mean(&runs, across)).collect(),
                }
            })
            .collect()
    };
    let panel = |title: &str, x: Axis, series: Vec<Series>| Panel {
        title: title.to_owned(),
        chart: Chart::Lines {
            x,
            y: Axis::new("mIoU on the test frames", Scale::Linear),
            series,
        },
    };
    let clicks = Axis::new("clicks a class in the whole scene", Scale::Linear);
    let seconds = Axis::new("seconds since the scene was opened", Scale::Linear);
    Figure {
        title: "How labels spread from a few clicks".to_owned(),
        subtitle: format!(
            "{}{}; {} preset, {threads} threads; mean and range over {} seed{} from {}; maps measured at most {} s after a batch of clicks",
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
            arguments.settle,
        ),
        rows: vec![vec![
            panel("by clicks", clicks, lines(&|point| point.clicks_per_class as f64)),
            panel("by time", seconds, lines(&|point| point.wall_s)),
        ]],
    }
}

fn mean(runs: &[&SimulatedPoint], across: &dyn Fn(&SimulatedPoint) -> f64) -> Point {
    let x: Vec<f64> = runs.iter().map(|run| across(run)).collect();
    let y: Vec<f64> = runs.iter().map(|run| run.scores.miou).collect();
    let low = y.iter().copied().fold(f64::INFINITY, f64::min);
    let high = y.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    Point {
        x: summary(&x).0,
        y: summary(&y).0,
        range: (low, high),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_deviation_is_that_of_a_sample() {
        assert_eq!(summary(&[0.5]), (0.5, 0.0));
        let (mean, deviation) = summary(&[1.0, 2.0, 3.0]);
        assert!((mean - 2.0).abs() < 1e-12 && (deviation - 1.0).abs() < 1e-12);
    }
}
