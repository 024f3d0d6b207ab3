//! The charts of `inplace-lab bench engine`.

use crate::chart::{Axis, Chart, Figure, Panel, Point, Scale, Series};
use crate::{PathSpeed, RunPoint};

use super::by_mark;
use crate::arguments::EngineArguments;
use crate::commands::machine::processor;
use crate::commands::{counted, grouped};

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
    let first = arguments.seed;
    let seeds = match (runs.is_empty(), arguments.seeds) {
        (true, _) => String::new(),
        (false, 1) => format!("; seed {first}"),
        (false, count) => {
            let last = first.wrapping_add(count - 1);
            format!("; median and range over seeds {first} to {last}")
        }
    };
    Figure {
        title: "How fast the engine is".to_owned(),
        subtitle: format!("{}, {}{seeds}", processor(), counted(threads as u64, "thread")),
        rows,
    }
}

fn speeds(paths: &[PathSpeed]) -> Panel {
    let names = grouped(paths, |path| path.name.clone());
    let series = grouped(paths, |path| path.table_log2).into_iter();
    let series = series.map(|(table, own)| {
        let of = |name: &String| own.iter().find(|path| path.name == *name);
        let values = names
            .iter()
            .map(|(name, _)| of(name).map_or(f64::NAN, |path| path.samples_per_s));
        (format!("2^{table} rows a level"), values.collect())
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
                let points = by_mark(&own).into_iter().filter_map(|at| {
                    let middle = Point::of_values(0.0, at.iter().map(|run| run.seconds))?.y;
                    Point::of_values(middle, at.iter().map(|run| value(run)))
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
    let depth = Axis::new("median error, cm", Scale::Logarithmic);
    let centimetres = |run: &RunPoint| {
        run.depth_error_m
            .map_or(f64::NAN, |error| 100.0 * f64::from(error))
    };
    let colour = Axis::new("PSNR, dB", Scale::Linear);
    let psnr = |run: &RunPoint| f64::from(run.psnr_db);
    vec![
        Panel::of_lines(
            "Depth on held-out frames",
            seconds.clone(),
            depth,
            lines(&centimetres),
        ),
        Panel::of_lines("Colour on held-out frames", seconds, colour, lines(&psnr)),
    ]
}
