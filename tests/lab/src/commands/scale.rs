//! `inplace-lab bench scale`: how time and memory grow with frames, pixels, rooms, classes and strokes.

mod captures;

use crate::scale::{Exponent, Measured, QUANTITIES, SECONDS, Setting, Sweep, USUAL, exponents, table};
use inplace_core::export;
use serde_json::json;

use super::{Failure, counted, grouped, processor};
use crate::arguments::ScaleArguments;
use crate::chart::{Axis, Figure, Panel, Point, Scale, Series};
use crate::page::{Page, known};

/// An exponent above which growth is worth a look: it is set in bold.
const STEEP: f64 = 1.2;

/// The name of the peak memory among [`QUANTITIES`].
const MEMORY: &str = "peak memory";

/// Measures, writes `scale.json`, `scale.csv` and `scale.svg`, and prints.
pub fn run(arguments: &ScaleArguments) -> Result<(), Failure> {
    if let Some(capture) = &arguments.cost_of {
        return captures::print_cost(arguments, capture);
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
    let costs = captures::measure(&sweeps.clone().flat_map(settings).collect(), seed)?;
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
    export::write(&out.join("scale.csv"), table(&measured)?.as_bytes())?;
    figure(base, threads, &measured, &exponents).write(&out.join("scale.svg"))?;
    page(&measured, &exponents).publish(&arguments.output, "scale", &result)
}

fn page(measured: &[Measured], exponents: &[Exponent]) -> Page {
    let mut page = Page::default();
    page.paragraph(
        "Seconds until a capture of the demo room is open, until its surface is known, from the strokes to the map of \
         the frame in view and to those of all frames, and from one more click to all maps again.",
    );
    let rows = measured.iter().map(|Measured { sweep, setting, cost }| {
        vec![
            sweep.name().to_owned(),
            setting.frames.to_string(),
            format!("{} x {}", setting.width, setting.height),
            setting.rooms.to_string(),
            setting.classes.to_string(),
            setting.strokes.to_string(),
            format!("{:.2}", cost.opening_s),
            format!("{:.2}", cost.surface_s),
            format!("{:.3}", cost.map_in_view_s),
            format!("{:.3}", cost.all_maps_s),
            format!("{:.3}", cost.update_s),
            // Nothing was left to train when the maps had been read.
            known(Some(cost.steps_per_s).filter(|&steps| steps > 0.0), 0),
            known(cost.peak_memory_bytes.map(|bytes| bytes as f64 / 1e9), 2),
            cost.surface_nodes.to_string(),
            cost.parameters.to_string(),
        ]
    });
    page.table(
        "varied | frames | size | rooms | classes | strokes | opening | surface | map in \
         view | all maps | one more click | steps/s | peak, GB | voxels | parameters",
        &rows.collect::<Vec<_>>(),
    );
    add_exponents(&mut page, exponents);
    page.chart("How cost grows", "scale.svg");
    page
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
        format!(" | {}, {} to {}", sweep.name(), short(ends.0), short(ends.1))
    });
    page.table(&ranges.collect::<String>(), &rows.collect::<Vec<_>>());
}

/// A number as short as it can be told from others.
fn short(value: f64) -> String {
    let decimals = if value.fract() == 0.0 { 0 } else { 2 };
    format!("{value:.decimals$}")
}

/// A panel of seconds for each sweep, and one of the peak memory of all.
fn figure(base: Setting, threads: usize, measured: &[Measured], exponents: &[Exponent]) -> Figure {
    let swept = |sweep: &Sweep| measured.iter().any(|one| one.sweep == *sweep);
    let sweeps: Vec<Sweep> = Sweep::ALL.into_iter().filter(swept).collect();
    let panels = sweeps.iter().map(|&sweep| seconds(sweep, measured, exponents));
    let mut panels: Vec<Panel> = panels.collect();
    panels.push(memory(&sweeps, base, measured, exponents));
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
        rows: panels.chunks(2).map(<[Panel]>::to_vec).collect(),
    }
}

fn seconds(sweep: Sweep, measured: &[Measured], exponents: &[Exponent]) -> Panel {
    let series = QUANTITIES[..SECONDS].iter().map(|(quantity, of)| {
        let own = measured.iter().filter(|one| one.sweep == sweep);
        let points = ascending(own.map(|one| Point::new(one.value(), of(&one.cost))));
        Series::new(named(quantity, sweep, quantity, exponents), points)
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

/// Peak memory over multiples of what there is of everything where nothing is varied.
fn memory(sweeps: &[Sweep], base: Setting, measured: &[Measured], exponents: &[Exponent]) -> Panel {
    let gigabytes = |one: &Measured| {
        let bytes = one.cost.peak_memory_bytes;
        bytes.map_or(f64::NAN, |bytes| bytes as f64 / 1e9)
    };
    let series = sweeps.iter().map(|&sweep| {
        let own = measured.iter().filter(|one| one.sweep == sweep);
        let points = ascending(own.map(|one| Point::new(one.value() / base.of(sweep), gigabytes(one))));
        Series::new(named(sweep.name(), sweep, MEMORY, exponents), points)
    });
    Panel::new(
        "Peak memory",
        Axis::new("times the usual number", Scale::Logarithmic),
        Axis::new("GB", Scale::Logarithmic),
        series.collect(),
    )
}

/// A line's name with its exponent, where there is one.
fn named(name: &str, sweep: Sweep, quantity: &str, exponents: &[Exponent]) -> String {
    let own = |one: &&Exponent| one.sweep == sweep && one.quantity == quantity;
    match exponents.iter().find(own) {
        Some(one) => format!("{name}, {}", one.shown()).replace('-', "\u{2212}"),
        None => name.to_owned(),
    }
}

fn ascending(points: impl Iterator<Item = Point>) -> Vec<Point> {
    let mut points: Vec<Point> = points.collect();
    points.sort_by(|a, b| a.x.total_cmp(&b.x));
    points
}
