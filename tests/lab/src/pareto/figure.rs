//! The charts of `inplace-lab bench pareto`.

use super::verdict::miou;
use super::{CapacityPoint, Curve, ParetoPoint, Part, Summary};
use crate::arguments::ParetoArguments;
use crate::chart::{Axis, Figure, Panel, Point, Scale, Series};
use crate::commands::{counted, grouped, processor};

/// Panels beside each other.
const COLUMNS: usize = 2;

/// `pareto.svg`: a panel for each scene with a line for each method.
pub(super) fn pareto(arguments: &ParetoArguments, threads: usize, points: &[ParetoPoint]) -> Figure {
    let scenes = grouped(points, |point| point.scene.clone());
    let panels: Vec<Panel> = scenes
        .into_iter()
        .map(|(scene, points)| {
            let series = grouped(points, |point| point.method.clone()).into_iter();
            let series = series.map(|(method, own)| line(method, &own));
            Panel::new(
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
fn line(method: String, own: &[&ParetoPoint]) -> Series {
    let curve = Curve::of(own.iter().copied(), miou);
    let point = |at: Summary| Point {
        range: (at.low, at.high),
        ..Point::new(at.wall_s, at.mean)
    };
    let mut points: Vec<Point> = curve.summaries().into_iter().map(point).collect();
    if own.iter().filter(|point| point.stop.is_some()).count() == curve.at(f64::INFINITY).len()
        && let Some(last) = points.last_mut()
    {
        *last = last.ringed();
    }
    Series::new(method, points)
}

/// `capacity.svg`: for each scene what the memory of each part is worth.
pub(super) fn capacity(arguments: &ParetoArguments, threads: usize, points: &[CapacityPoint]) -> Figure {
    let row = |(scene, own): (String, Vec<&CapacityPoint>)| {
        let panel = |what: &str, label: &str, parts: &[Part], value: fn(&ParetoPoint) -> f64| {
            Panel::new(
                format!("{}: {what}", titled(arguments, &scene)),
                Axis::new("MB of the model", Scale::Logarithmic),
                Axis::new(label, Scale::Linear),
                parts.iter().map(|&part| sizes(&own, part, value)).collect(),
            )
        };
        let psnr = |point: &ParetoPoint| point.psnr_db.unwrap_or(f64::NAN);
        vec![
            panel("labels", "mIoU on the test frames", &Part::ALL, |point| point.miou),
            panel("colours", "held-out PSNR, dB", &[Part::Field], psnr),
        ]
    };
    let scenes = grouped(points, |point| point.end.scene.clone()).into_iter();
    Figure {
        title: "Accuracy against the size of the model".to_owned(),
        subtitle: format!(
            "{}; a quarter, half, twice and four times what \"auto\" chooses, which has the ring",
            conditions(arguments, threads)
        ),
        rows: scenes.map(row).collect(),
    }
}

/// The mean over the seeds for each size of a part, with their range.
fn sizes(points: &[&CapacityPoint], part: Part, value: fn(&ParetoPoint) -> f64) -> Series {
    let own = points.iter().copied().filter(|point| point.part == part);
    let mut groups = grouped(own, |point| point.factor);
    groups.sort_by(|a, b| a.0.total_cmp(&b.0));
    let point = |(factor, runs): (f32, Vec<&CapacityPoint>)| {
        let megabytes = |run: &CapacityPoint| run.end.bytes as f64 / 1e6;
        let point = Point::of_means(runs.iter().map(|run| (megabytes(run), value(&run.end))))?;
        Some(if factor == 1.0 { point.ringed() } else { point })
    };
    Series::new(part.to_string(), groups.into_iter().filter_map(point))
}

fn titled(arguments: &ParetoArguments, scene: &str) -> String {
    let colours_alone = arguments.reading.no_depth;
    format!("{scene}{}", if colours_alone { ", no depth" } else { "" })
}

fn conditions(arguments: &ParetoArguments, threads: usize) -> String {
    format!(
        "{}, {}; {} a class; mean and range over {} from {}",
        processor(),
        counted(threads as u64, "thread"),
        counted(arguments.clicks, "random click"),
        counted(arguments.seeds, "seed"),
        arguments.reading.seed
    )
}
