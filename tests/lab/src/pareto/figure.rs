//! The charts of `inplace-lab bench pareto`.

use super::verdict::miou;
use super::{Curve, ParetoPoint, Summary};
use crate::arguments::ParetoArguments;
use crate::chart::{Axis, Figure, Panel, Point, Scale, Series};
use crate::commands::{counted, grouped, processor};

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
        panels,
    }
}

/// The mean over the seeds, with a band from the lowest to the highest; a ring at the end where all of them stopped.
pub fn line(method: String, own: &[&ParetoPoint]) -> Series {
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
