//! The charts of `inplace-lab bench engine`.

use crate::chart::{Axis, BarSeries, Chart, Figure, Panel, Point, Scale, Series};
use crate::{PathSpeed, RunPoint};

use crate::arguments::EngineArguments;
use crate::commands::grouped;
use crate::commands::machine::processor;

/// `engine.svg`: panels for whatever was measured.
pub(super) fn engine(
    arguments: &EngineArguments,
    threads: usize,
    paths: &[PathSpeed],
    runs: &[RunPoint],
) -> Figure {
    let mut rows = Vec::new();
    if !paths.is_empty() {
        rows.push(vec![speeds(paths)]);
    }
    if !runs.is_empty() {
        rows.push(progress(runs));
    }
    let seeds = match (runs.is_empty(), arguments.seeds) {
        (true, _) => String::new(),
        (false, 1) => format!("; seed {}", arguments.seed),
        (false, count) => format!(
            "; median and range over seeds {} to {}",
            arguments.seed,
            arguments.seed.wrapping_add(count - 1)
        ),
    };
    let plural = if threads == 1 { "" } else { "s" };
    Figure {
        title: "How fast the engine is".to_owned(),
        subtitle: format!("{}, {threads} thread{plural}{seeds}", processor()),
        rows,
    }
}

fn speeds(paths: &[PathSpeed]) -> Panel {
    let names = grouped(paths, |path| path.name.clone());
    let series = grouped(paths, |path| path.table_log2)
        .into_iter()
        .map(|(table, own)| {
            let of = |name: &String| own.iter().find(|path| path.name == *name);
            BarSeries {
                name: format!("2^{table} rows a level"),
                values: names
                    .iter()
                    .map(|(name, _)| of(name).map_or(f64::NAN, |path| path.samples_per_s))
                    .collect(),
            }
        });
    Panel {
        title: "Speed of each way to compute the field".to_owned(),
        chart: Chart::Bars {
            label: "samples/s, forward and backward".to_owned(),
            series: series.collect(),
            groups: names.iter().map(|(name, _)| name.clone()).collect(),
        },
    }
}

/// Depth error and PSNR over the seconds of training.
fn progress(runs: &[RunPoint]) -> Vec<Panel> {
    let lines = |value: &dyn Fn(&RunPoint) -> f64| -> Vec<Series> {
        grouped(runs, |run| (run.scene.clone(), run.preset.clone(), run.depth))
            .into_iter()
            .map(|((scene, preset, depth), own)| {
                let marks = own.iter().filter(|run| run.seed == own[0].seed).count();
                let points = (0..marks).filter_map(|mark| {
                    let at = || own.iter().skip(mark).step_by(marks);
                    let middle = Point::of_values(0.0, at().map(|run| run.seconds))?.y;
                    Point::of_values(middle, at().map(|run| value(run)))
                });
                Series {
                    name: match (preset.as_str(), depth) {
                        ("auto", true) => scene,
                        ("auto", false) => format!("{scene}, no depth"),
                        (_, true) => format!("{scene}, {preset}"),
                        (_, false) => format!("{scene}, {preset}, no depth"),
                    },
                    points: points.collect(),
                }
            })
            .collect()
    };
    let seconds = Axis::new("seconds of training", Scale::Logarithmic);
    let centimetres = |run: &RunPoint| {
        run.depth_error_m
            .map_or(f64::NAN, |error| 100.0 * f64::from(error))
    };
    vec![
        Panel::of_lines(
            "Depth on held-out frames",
            seconds.clone(),
            Axis::new("median error, cm", Scale::Logarithmic),
            lines(&centimetres),
        ),
        Panel::of_lines(
            "Colour on held-out frames",
            seconds,
            Axis::new("PSNR, dB", Scale::Linear),
            lines(&|run| f64::from(run.psnr_db)),
        ),
    ]
}
