//! The charts of `inplace-lab bench pareto`.

use crate::chart::{Axis, Figure, Panel, Point, Scale, Series};
use crate::mean_and_deviation;
use crate::pareto::{CapacityPoint, Curve, ParetoPoint, Part};

use super::Results;
use super::verdict::miou;
use crate::arguments::ParetoArguments;
use crate::commands::grouped;
use crate::commands::machine::processor;

/// Panels beside each other.
const COLUMNS: usize = 2;

/// `pareto.svg`: a panel for each scene with a line for each method.
pub(super) fn pareto(arguments: &ParetoArguments, threads: usize, results: &Results) -> Figure {
    let scenes = grouped(&results.points, |point| point.scene.clone());
    let panels: Vec<Panel> = scenes
        .into_iter()
        .map(|(scene, points)| {
            let series = grouped(points, |point| point.method.clone()).into_iter();
            let series = series.map(|(method, own)| line(results, &scene, method, &own));
            Panel::of_lines(
                titled(arguments, &scene),
                Axis::new("wall seconds since the start", Scale::Logarithmic),
                Axis::new("mIoU on the test frames", Scale::Linear),
                series.collect(),
            )
        })
        .collect();
    Figure {
        title: "Accuracy against wall time".to_owned(),
        subtitle: format!(
            "{}; a ring is where training stopped by itself",
            conditions(arguments, threads)
        ),
        rows: panels.chunks(COLUMNS).map(<[Panel]>::to_vec).collect(),
    }
}

/// The mean over the seeds, with a band from the lowest to the highest; a ring at the end where all of them stopped.
fn line(results: &Results, scene: &str, method: String, own: &[&ParetoPoint]) -> Series {
    let curve = Curve::of(own.iter().copied(), miou);
    let mut points: Vec<Point> = curve
        .summaries()
        .iter()
        .map(|at| Point {
            range: (at.low, at.high),
            ..Point::new(at.wall_s, at.mean)
        })
        .collect();
    let stops = results.stops.iter();
    let stopped = stops
        .filter(|stop| stop.scene == scene && stop.method == method)
        .count();
    if stopped == curve.at(f64::INFINITY).len()
        && let Some(last) = points.last_mut()
    {
        *last = last.ringed();
    }
    Series { name: method, points }
}

/// `capacity.svg`: for each scene what the size of each part does, and what its memory is worth.
pub(super) fn capacity(arguments: &ParetoArguments, threads: usize, points: &[CapacityPoint]) -> Figure {
    let parameters = |point: &CapacityPoint| point.parameters as f64;
    let voxels = |point: &CapacityPoint| point.voxels as f64;
    let megabytes = |point: &CapacityPoint| point.bytes as f64 / 1e6;
    let miou = |point: &CapacityPoint| point.miou;
    let psnr = |point: &CapacityPoint| point.psnr_db.unwrap_or(f64::NAN);
    let mut rows = Vec::new();
    for (scene, of_scene) in grouped(points, |point| point.scene.clone()) {
        let panel = |what: &str, x: &str, y: &str, parts: &[Part], values: [&Value; 2]| {
            Panel::of_lines(
                format!("{}: {what}", titled(arguments, &scene)),
                Axis::new(x, Scale::Logarithmic),
                Axis::new(y, Scale::Linear),
                parts.iter().map(|&part| sizes(&of_scene, part, values)).collect(),
            )
        };
        let accuracy = "mIoU on the test frames";
        rows.push(vec![
            panel(
                "size of the field",
                "parameters",
                accuracy,
                &[Part::Field],
                [&parameters, &miou],
            ),
            panel(
                "size of the surface",
                "voxels",
                accuracy,
                &[Part::Surface],
                [&voxels, &miou],
            ),
        ]);
        rows.push(vec![
            panel(
                "memory of the model",
                "MB",
                accuracy,
                &Part::ALL,
                [&megabytes, &miou],
            ),
            panel(
                "colours of the field",
                "parameters",
                "held-out PSNR, dB",
                &[Part::Field],
                [&parameters, &psnr],
            ),
        ]);
    }
    Figure {
        title: "Accuracy against the size of the model".to_owned(),
        subtitle: format!(
            "{}; a quarter, half, twice and four times what \"auto\" chooses, which has the ring",
            conditions(arguments, threads)
        ),
        rows,
    }
}

type Value<'a> = dyn Fn(&CapacityPoint) -> f64 + 'a;

/// The mean over the seeds for each size of a part, with their range.
fn sizes(points: &[&CapacityPoint], part: Part, [x, y]: [&Value; 2]) -> Series {
    let own = points.iter().copied().filter(|point| point.part == part);
    let mut groups = grouped(own, |point| point.factor);
    groups.sort_by(|a, b| a.0.total_cmp(&b.0));
    let point = |(factor, runs): (f32, Vec<&CapacityPoint>)| {
        let across: Vec<f64> = runs.iter().map(|run| x(run)).collect();
        let values = runs.iter().map(|run| y(run)).filter(|value| value.is_finite());
        let values: Vec<f64> = values.collect();
        let range = Point::of_values(0.0, values.iter().copied())?.range;
        let mean = |values: &[f64]| mean_and_deviation(values).0;
        let point = Point {
            range,
            ..Point::new(mean(&across), mean(&values))
        };
        Some(if factor == 1.0 { point.ringed() } else { point })
    };
    Series {
        name: part.to_string(),
        points: groups.into_iter().filter_map(point).collect(),
    }
}

fn titled(arguments: &ParetoArguments, scene: &str) -> String {
    let depth = if arguments.no_depth { ", no depth" } else { "" };
    format!("{scene}{depth}")
}

fn conditions(arguments: &ParetoArguments, threads: usize) -> String {
    let plural = |count: u64| if count == 1 { "" } else { "s" };
    format!(
        "{}, {threads} thread{}; {} random click{} a class; mean and range over {} seed{} from {}",
        processor(),
        plural(threads as u64),
        arguments.clicks,
        plural(arguments.clicks.into()),
        arguments.seeds,
        plural(arguments.seeds),
        arguments.seed
    )
}
