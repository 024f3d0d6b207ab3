//! `inplace-lab bench scale`, how time and memory grow with a capture: one thing is varied at a time, and the exponent of each curve is fitted.

mod cost;
mod strokes;
#[cfg(test)]
mod tests;

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};

use clap::ValueEnum;
use serde::Serialize;
use serde_json::{Value, json};

use super::Failure;
use super::chart::{Axis, Figure, Panel, Point, Scale, Series};
use super::commands::{counted, grouped, processor};
use super::page::Page;
use super::table::csv;
use crate::arguments::ScaleArguments;
use inplace_core::export;
use inplace_core::session::Progress;

pub use cost::Cost;
pub use strokes::scattered;

/// An exponent above which growth is worth a look: it is set in bold.
const STEEP: f64 = 1.2;

/// What is varied while everything else stays as it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum Sweep {
    /// Number of frames.
    Frames,
    /// Pixels of a frame.
    Size,
    /// Rooms, with the same number of frames in all.
    Rooms,
    /// Classes.
    Classes,
    /// Strokes.
    Strokes,
}

/// A capture and its labels, by what they hold of everything that is varied.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct Setting {
    /// Rooms of the demo.
    pub rooms: usize,
    /// Width of the frames, in pixels.
    pub width: u32,
    /// Height of the frames, in pixels.
    pub height: u32,
    /// Number of frames.
    pub frames: usize,
    /// Number of classes.
    pub classes: usize,
    /// Number of strokes.
    pub strokes: usize,
}

/// What there is of everything where nothing is varied.
pub const USUAL: Setting = Setting {
    rooms: 1,
    width: 320,
    height: 240,
    frames: 100,
    classes: 20,
    strokes: 60,
};

/// What one setting of a sweep cost.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Measured {
    /// The sweep.
    pub sweep: Sweep,
    /// The capture and its labels.
    #[serde(flatten)]
    pub setting: Setting,
    /// What it cost.
    #[serde(flatten)]
    pub cost: Cost,
}

/// Something that may grow: its name in the results, and its value; not a number where the system does not tell.
pub type Quantity = (&'static str, fn(&Cost) -> f64);

/// What is fitted: seconds, bytes, and the sizes of surface and model.
pub const QUANTITIES: [Quantity; 9] = [
    ("opening", |cost| cost.opening_s),
    ("surface", |cost| cost.surface_s),
    ("map in view", |cost| cost.map_in_view_s),
    ("all maps", |cost| cost.all_maps_s),
    ("one more click", |cost| cost.update_s),
    ("a step", |cost| cost.steps_per_s.recip()),
    ("peak memory", |cost| {
        cost.peak_memory_bytes.map_or(f64::NAN, |bytes| bytes as f64)
    }),
    ("voxels", |cost| cost.surface_nodes as f64),
    ("parameters", |cost| cost.parameters as f64),
];

/// How many of [`QUANTITIES`], from the first on, are seconds.
pub const SECONDS: usize = 6;

/// The power of what is varied that a quantity grows with, by a line through the logarithms.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Exponent {
    /// What is varied.
    pub sweep: Sweep,
    /// What grows, by its name in [`QUANTITIES`].
    pub quantity: &'static str,
    /// Slope of the logarithm of what grows over that of what is varied.
    pub exponent: f64,
    /// Least value of what is varied that it was fitted to.
    pub from: f64,
    /// The greatest one.
    pub to: f64,
    /// Number of measurements that it was fitted to.
    pub points: usize,
}

impl Exponent {
    /// The exponent to two decimals, and never -0.00.
    pub fn shown(&self) -> String {
        format!("{:.2}", (100.0 * self.exponent).round() / 100.0 + 0.0)
    }
}

impl Sweep {
    /// The settings that it goes through, ascending: `base` with one thing changed.
    ///
    /// Every class is to have a stroke, so that the sweep over classes has as many strokes as its most classes.
    pub fn settings(self, base: Setting, arguments: &ScaleArguments) -> BTreeSet<Setting> {
        let count = |&count: &u16| usize::from(count);
        let most = arguments.classes.iter().map(count).fold(base.strokes, usize::max);
        let each = |counts: &[u16], setting: &dyn Fn(usize) -> Setting| {
            counts.iter().map(count).map(setting).collect()
        };
        match self {
            Self::Frames => each(&arguments.frames, &|frames| Setting { frames, ..base }),
            Self::Size => {
                let setting = |&(width, height): &(u32, u32)| Setting {
                    width,
                    height,
                    ..base
                };
                arguments.sizes.iter().map(setting).collect()
            }
            Self::Rooms => each(&arguments.rooms, &|rooms| Setting { rooms, ..base }),
            Self::Classes => {
                let base = Setting {
                    strokes: most,
                    ..base
                };
                each(&arguments.classes, &|classes| Setting { classes, ..base })
            }
            Self::Strokes => each(&arguments.strokes, &|strokes| Setting { strokes, ..base }),
        }
    }
}

impl Measured {
    /// How much there is of what is varied in its sweep; pixels of a frame in millions.
    pub fn value(&self) -> f64 {
        let own = &self.setting;
        match self.sweep {
            Sweep::Frames => own.frames as f64,
            Sweep::Size => f64::from(own.width) * f64::from(own.height) / 1e6,
            Sweep::Rooms => own.rooms as f64,
            Sweep::Classes => own.classes as f64,
            Sweep::Strokes => own.strokes as f64,
        }
    }
}

/// The exponent of each quantity in each sweep, where two values or more were measured.
pub fn exponents(measured: &[Measured]) -> Vec<Exponent> {
    let of_sweep = |&sweep: &Sweep| {
        QUANTITIES.into_iter().filter_map(move |(quantity, of)| {
            let own = measured.iter().filter(|one| one.sweep == sweep);
            let fitted = fit(own.map(|one| (one.value(), of(&one.cost))).collect())?;
            let (exponent, [from, to], points) = fitted;
            Some(Exponent {
                sweep,
                quantity,
                exponent,
                from,
                to,
                points,
            })
        })
    };
    Sweep::value_variants().iter().flat_map(of_sweep).collect()
}

/// Least squares over the upper half of the values, at least three of them where there are as many: what is the same for
/// every size rules the lower half and would hide how the rest grows. Points that have no logarithm are left out. The slope, the
/// least and the greatest value, and how many there were.
fn fit(mut points: Vec<(f64, f64)>) -> Option<(f64, [f64; 2], usize)> {
    points.retain(|&(x, y)| x > 0.0 && y > 0.0 && x.is_finite() && y.is_finite());
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let kept = points.len().div_ceil(2).max(3).min(points.len());
    let upper = &points[points.len() - kept..];
    let (from, to) = (upper.first()?.0, upper.last()?.0);
    if from >= to {
        return None;
    }
    let logarithms = || upper.iter().map(|(x, y)| (x.ln(), y.ln()));
    let count = kept as f64;
    let (sum_x, sum_y) = logarithms().fold((0.0, 0.0), |(a, b), (x, y)| (a + x, b + y));
    let (middle_x, middle_y) = (sum_x / count, sum_y / count);
    let (covariance, variance) = logarithms().fold((0.0, 0.0), |(both, own), (x, y)| {
        let (dx, dy) = (x - middle_x, y - middle_y);
        (both + dx * dy, own + dx * dx)
    });
    Some((covariance / variance, [from, to], kept))
}

/// A row for each setting of each sweep, with memory in 10^6 bytes.
fn rows(measured: &[Measured]) -> serde_json::Result<Vec<Value>> {
    let row = |one: &Measured| {
        let mut row = serde_json::to_value(one)?;
        let megabytes = |bytes: Option<u64>| json!(bytes.map(|bytes| bytes as f64 / 1e6));
        row["peak_opening_mb"] = megabytes(one.cost.peak_opening_bytes);
        row["peak_mb"] = megabytes(one.cost.peak_memory_bytes);
        row["voxels"] = json!(one.cost.surface_nodes);
        Ok(row)
    };
    measured.iter().map(row).collect()
}

/// The columns of `scale.csv`.
const COLUMNS: &str = "sweep frames width height rooms classes strokes opening_s:3 surface_s:3 map_in_view_s:4 \
                       all_maps_s:4 update_s:4 steps_per_s:2 peak_opening_mb:1 peak_mb:1 voxels parameters";

/// Measures, writes `scale.json`, `scale.csv` and `scale.svg`, and prints.
pub fn run(arguments: &ScaleArguments) -> Result<(), Failure> {
    if let Some(capture) = &arguments.cost_of {
        return cost::print_cost(arguments, capture);
    }
    let out = &arguments.output.out;
    export::prepare(out, &[])?;
    let (threads, seed) = (arguments.reading.threads(), arguments.reading.seed);
    let (width, height) = arguments.at_size;
    let base = Setting {
        width,
        height,
        ..USUAL
    };
    let settings = |sweep: Sweep| sweep.settings(base, arguments);
    let sweeps = arguments.sweeps.iter().copied();
    let progress = Progress::default();
    let mut costs = BTreeMap::new();
    for setting in sweeps.clone().flat_map(settings) {
        if let Entry::Vacant(new) = costs.entry(setting) {
            new.insert(cost::cost(setting, seed, &progress)?);
        }
    }
    drop(progress);
    let mut measured = Vec::new();
    for sweep in sweeps {
        measured.extend(settings(sweep).into_iter().map(|setting| Measured {
            sweep,
            setting,
            cost: costs[&setting],
        }));
    }
    let exponents = exponents(&measured);
    let result = json!({
        "version": env!("CARGO_PKG_VERSION"),
        "machine": processor(),
        "threads": threads,
        "training_s": arguments.seconds,
        "seed": seed,
        "base": base,
        "measured": measured,
        "exponents": exponents,
    });
    export::write_json(&out.join("scale.json"), &result)?;
    export::write(
        &out.join("scale.csv"),
        csv(&rows(&measured)?, COLUMNS)?.as_bytes(),
    )?;
    figure(base, threads, &measured, &exponents).write(&out.join("scale.svg"))?;
    page(&measured, &exponents)?.publish(&arguments.output, "scale", &result)
}

fn page(measured: &[Measured], exponents: &[Exponent]) -> Result<Page, Failure> {
    let mut page = Page::default();
    page.paragraph(
        "Seconds until a capture of the demo room is open, until its surface is known, from the strokes to the map of \
         the frame in view and to those of all frames, and from one more click to all maps again.",
    );
    page.means(
        &rows(measured)?,
        "varied=sweep | frames | width | height | rooms | classes | strokes | opening=opening_s:2 | surface=surface_s:2 | \
         map in view=map_in_view_s:3 | all maps=all_maps_s:3 | one more click=update_s:3 | steps/s=steps_per_s:0 | \
         peak, MB=peak_mb:0 | voxels:0 | parameters:0",
    )?;
    add_exponents(&mut page, exponents);
    page.chart("How cost grows", "scale.svg");
    Ok(page)
}

/// A row for each quantity, a column for each sweep; steep growth is bold.
fn add_exponents(page: &mut Page, exponents: &[Exponent]) {
    let sweeps = grouped(exponents, |one| one.sweep);
    page.paragraph(&format!(
        "The power that each grows with, fitted to the upper half of the values; above {STEEP} in bold."
    ));
    let rows = QUANTITIES.iter().map(|(quantity, _)| {
        let mut row = vec![(*quantity).to_owned()];
        row.extend(sweeps.iter().map(|(_, own)| {
            let one = own.iter().find(|one| one.quantity == *quantity);
            match one.map(|one| (one.shown(), one.exponent > STEEP)) {
                None => "-".to_owned(),
                Some((text, true)) => format!("**{text}**"),
                Some((text, false)) => text,
            }
        }));
        row
    });
    let ranges = sweeps.iter().map(|(sweep, own)| {
        let ends = own.first().map_or((0.0, 0.0), |one| (one.from, one.to));
        format!(" | {sweep:?}, {} to {}", short(ends.0), short(ends.1)).to_lowercase()
    });
    page.table(&ranges.collect::<String>(), &rows.collect::<Vec<_>>());
}

/// A number as short as it can be told from others.
fn short(value: f64) -> String {
    let decimals = if value.fract() == 0.0 { 0 } else { 2 };
    format!("{value:.decimals$}")
}

/// A panel of seconds for each sweep.
fn figure(base: Setting, threads: usize, measured: &[Measured], exponents: &[Exponent]) -> Figure {
    let swept = |sweep: &&Sweep| measured.iter().any(|one| one.sweep == **sweep);
    let panel = |&sweep: &Sweep| seconds(sweep, measured, exponents);
    let panels = Sweep::value_variants().iter().filter(swept).map(panel).collect();
    Figure {
        title: "How cost grows".to_owned(),
        subtitle: format!(
            "{}, {}; where nothing else is said {} frames of {} \u{d7} {}, {} classes, {} strokes, \
             {} room; behind each name the exponent over the upper half of the values",
            processor(),
            counted(threads as u64, "thread"),
            base.frames,
            base.width,
            base.height,
            base.classes,
            base.strokes,
            base.rooms
        ),
        panels,
    }
}

fn seconds(sweep: Sweep, measured: &[Measured], exponents: &[Exponent]) -> Panel {
    let series = QUANTITIES[..SECONDS].iter().map(|(quantity, of)| {
        let own = measured.iter().filter(|one| one.sweep == sweep);
        let points = ascending(own.map(|one| Point::new(one.value(), of(&one.cost))));
        Series::new(named(quantity, sweep, exponents), points)
    });
    let first = measured.iter().find(|one| one.sweep == sweep);
    let strokes = first.map_or(0, |one| one.setting.strokes);
    let (title, label) = match sweep {
        Sweep::Frames => ("By frames", "frames".to_owned()),
        Sweep::Size => ("By image size", "megapixels a frame".to_owned()),
        Sweep::Rooms => ("By rooms", "rooms, with the same number of frames in all".into()),
        Sweep::Classes => ("By classes", format!("classes, with {strokes} strokes")),
        Sweep::Strokes => ("By strokes", "strokes".to_owned()),
    };
    Panel::new(
        title,
        Axis::new(label, Scale::Logarithmic),
        Axis::new("seconds", Scale::Logarithmic),
        series.collect(),
    )
}

/// A line's name with its exponent, where there is one.
fn named(quantity: &str, sweep: Sweep, exponents: &[Exponent]) -> String {
    let own = |one: &&Exponent| one.sweep == sweep && one.quantity == quantity;
    match exponents.iter().find(own) {
        Some(one) => format!("{quantity}, {}", one.shown()).replace('-', "\u{2212}"),
        None => quantity.to_owned(),
    }
}

fn ascending(points: impl Iterator<Item = Point>) -> Vec<Point> {
    let mut points: Vec<Point> = points.collect();
    points.sort_by(|a, b| a.x.total_cmp(&b.x));
    points
}
