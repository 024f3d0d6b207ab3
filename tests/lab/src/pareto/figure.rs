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

/// `capacity.svg`: for each scene what the size of each part does, and what its memory is worth.
pub(super) fn capacity(arguments: &ParetoArguments, threads: usize, points: &[CapacityPoint]) -> Figure {
    let size: Quantity = ("parameters", &|point| {
        point.parameters.map_or(f64::NAN, |count| count as f64)
    });
    let voxels: Quantity = ("voxels", &|point| point.voxels as f64);
    let memory: Quantity = ("MB", &|point| point.bytes as f64 / 1e6);
    let accuracy: Quantity = ("mIoU on the test frames", &|point| point.miou);
    let psnr: Quantity = ("held-out PSNR, dB", &|point| point.psnr_db.unwrap_or(f64::NAN));
    let mut rows = Vec::new();
    for (scene, of_scene) in grouped(points, |point| point.end.scene.clone()) {
        let panel = |what: &str, parts: &[Part], x: Quantity<'_>, y: Quantity<'_>| {
            let series = parts.iter().map(|&part| sizes(&of_scene, part, [x.1, y.1]));
            Panel::new(
                format!("{}: {what}", titled(arguments, &scene)),
                Axis::new(x.0, Scale::Logarithmic),
                Axis::new(y.0, Scale::Linear),
                series.collect(),
            )
        };
        let [field, surface] = [[Part::Field], [Part::Surface]];
        rows.push(vec![
            panel("size of the field", &field, size, accuracy),
            panel("size of the surface", &surface, voxels, accuracy),
        ]);
        rows.push(vec![
            panel("memory of the model", &Part::ALL, memory, accuracy),
            panel("colours of the field", &field, size, psnr),
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

type Value<'a> = dyn Fn(&ParetoPoint) -> f64 + 'a;
/// What an axis shows.
type Quantity<'a> = (&'static str, &'a Value<'a>);

/// The mean over the seeds for each size of a part, with their range.
fn sizes(points: &[&CapacityPoint], part: Part, [x, y]: [&Value; 2]) -> Series {
    let own = points.iter().copied().filter(|point| point.part == part);
    let mut groups = grouped(own, |point| point.factor);
    groups.sort_by(|a, b| a.0.total_cmp(&b.0));
    let point = |(factor, runs): (f32, Vec<&CapacityPoint>)| {
        let point = Point::of_means(runs.iter().map(|run| (x(&run.end), y(&run.end))))?;
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
