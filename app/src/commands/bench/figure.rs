//! The charts of `inplace bench engine`.

use inplace_core::eval::chart::{Axis, BarSeries, Chart, Figure, Panel, Point, Scale, Series};
use inplace_core::eval::{Cost, PathSpeed, RunPoint};

use super::cost;
use super::engine::grouped;
use crate::arguments::EngineArguments;

/// The most memory that a thousand frames of this size with depth may take, in GB.
const MEMORY_TARGET: f64 = 3.0;
const TARGET_SIZE: (u32, u32) = (640, 480);

/// `engine.svg`: panels for whatever was measured.
pub(super) fn engine(
    arguments: &EngineArguments,
    threads: usize,
    paths: &[PathSpeed],
    runs: &[RunPoint],
    costs: &[Cost],
) -> Figure {
    let mut rows = Vec::new();
    if !paths.is_empty() {
        rows.push(vec![speeds(paths)]);
    }
    if !runs.is_empty() {
        rows.push(progress(runs));
    }
    if !costs.is_empty() {
        rows.extend(cost_rows(arguments, costs));
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
        subtitle: format!("{}, {threads} thread{plural}{seeds}", cost::processor()),
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
            value: Axis::new("samples/s, forward and backward", Scale::FromZero),
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
    let panel = |title: &str, axis: Axis, series: Vec<Series>| Panel {
        title: title.to_owned(),
        chart: Chart::Lines {
            x: Axis::new("seconds of training", Scale::Logarithmic),
            y: axis,
            series,
        },
    };
    let centimetres = |run: &RunPoint| {
        run.depth_error_m
            .map_or(f64::NAN, |error| 100.0 * f64::from(error))
    };
    vec![
        panel(
            "Depth on held-out frames",
            Axis::new("median error, cm", Scale::Logarithmic),
            lines(&centimetres),
        ),
        panel(
            "Colour on held-out frames",
            Axis::new("PSNR, dB", Scale::Linear),
            lines(&|run| f64::from(run.psnr_db)),
        ),
    ]
}

/// Cost against the number of frames and the image size.
fn cost_rows(arguments: &EngineArguments, costs: &[Cost]) -> Vec<Vec<Panel>> {
    let size = cost::size_of_frames(arguments);
    let by_frames: Vec<&Cost> = costs
        .iter()
        .filter(|cost| (cost.width, cost.height) == size)
        .collect();
    let by_size: Vec<&Cost> = costs
        .iter()
        .filter(|cost| cost.frames == cost::FRAMES_OF_SIZES)
        .collect();
    let frames = |cost: &Cost| cost.frames as f64;
    let megapixels = |cost: &Cost| f64::from(cost.width) * f64::from(cost.height) / 1e6;
    let across_frames = || {
        Axis::new(
            format!("frames of {} \u{d7} {}", size.0, size.1),
            Scale::Logarithmic,
        )
    };
    let across_sizes = || {
        let label = format!("megapixels a frame, {} frames", cost::FRAMES_OF_SIZES);
        Axis::new(label, Scale::Logarithmic)
    };
    let seconds = || Axis::new("seconds", Scale::Logarithmic);
    let gigabytes = |bytes: Option<u64>| bytes.map_or(f64::NAN, |bytes| bytes as f64 / 1e9);
    let line = |name: &str, of: &[&Cost], x: &dyn Fn(&Cost) -> f64, y: &dyn Fn(&Cost) -> f64| {
        let mut points: Vec<Point> = of.iter().map(|cost| Point::new(x(cost), y(cost))).collect();
        points.sort_by(|a, b| a.x.total_cmp(&b.x));
        Series {
            name: name.to_owned(),
            points,
        }
    };
    let waits = |of: &[&Cost], x: &dyn Fn(&Cost) -> f64| {
        vec![
            line("opening", of, x, &|cost| cost.opening_s),
            line("surface", of, x, &|cost| cost.surface_s),
            line("all maps", of, x, &|cost| cost.all_maps_s),
            line("map in view", of, x, &|cost| cost.map_in_view_s),
        ]
    };
    let memory = |of: &[&Cost], x: &dyn Fn(&Cost) -> f64| {
        vec![
            line("peak", of, x, &|cost| gigabytes(cost.peak_memory_bytes)),
            line("when open", of, x, &|cost| gigabytes(cost.peak_opening_bytes)),
        ]
    };
    let training = |of: &[&Cost], x: &dyn Fn(&Cost) -> f64| {
        vec![line("training", of, x, &|cost| cost.samples_per_s / 1e6)]
    };
    let panel = |title: &str, x: Axis, y: Axis, series: Vec<Series>| Panel {
        title: title.to_owned(),
        chart: Chart::Lines { x, y, series },
    };
    let memory_by_frames = if size == TARGET_SIZE {
        Axis::new("GB", Scale::FromZero).with_mark(MEMORY_TARGET, "target for 1000 frames")
    } else {
        Axis::new("GB", Scale::FromZero)
    };
    let gigabyte_axis = || Axis::new("GB", Scale::FromZero);
    let million = || Axis::new("million samples/s, head and maps running", Scale::FromZero);
    vec![
        vec![
            panel(
                "Waiting, by frames",
                across_frames(),
                seconds(),
                waits(&by_frames, &frames),
            ),
            panel(
                "Waiting, by image size",
                across_sizes(),
                seconds(),
                waits(&by_size, &megapixels),
            ),
        ],
        vec![
            panel(
                "Memory, by frames",
                across_frames(),
                memory_by_frames,
                memory(&by_frames, &frames),
            ),
            panel(
                "Memory, by image size",
                across_sizes(),
                gigabyte_axis(),
                memory(&by_size, &megapixels),
            ),
        ],
        vec![
            panel(
                "Training, by frames",
                across_frames(),
                million(),
                training(&by_frames, &frames),
            ),
            panel(
                "Training, by image size",
                across_sizes(),
                million(),
                training(&by_size, &megapixels),
            ),
        ],
    ]
}
