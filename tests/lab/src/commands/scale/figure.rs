//! `scale.svg`.

use crate::chart::{Axis, Figure, Panel, Point, Scale, Series};
use crate::scale::{Exponent, Measured, QUANTITIES, SECONDS, Setting, Sweep};

use crate::commands::counted;
use crate::commands::machine::processor;

/// The name of the peak memory among [`QUANTITIES`].
const MEMORY: &str = "peak memory";

/// A panel of seconds for each sweep, and one of the peak memory of all.
pub(super) fn scale(base: Setting, threads: usize, measured: &[Measured], exponents: &[Exponent]) -> Figure {
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
        Series {
            name: named(quantity, sweep, quantity, exponents),
            points: ascending(own.map(|one| Point::new(one.value(), of(&one.cost)))),
        }
    });
    let first = measured.iter().find(|one| one.sweep == sweep);
    let strokes = first.map_or(0, |one| one.cost.strokes);
    let (title, label) = match sweep {
        Sweep::Frames => ("By frames", "frames".to_owned()),
        Sweep::Size => ("By image size", "megapixels a frame".to_owned()),
        Sweep::Rooms => (
            "By rooms",
            "rooms, with the same number of frames in all".to_owned(),
        ),
        Sweep::Classes => ("By classes", format!("classes, with {strokes} strokes")),
        Sweep::Strokes => ("By strokes", "strokes".to_owned()),
    };
    Panel::of_lines(
        title,
        Axis::new(label, Scale::Logarithmic),
        Axis::new("seconds", Scale::Logarithmic),
        series.collect(),
    )
}

/// Peak memory over multiples of what there is of everything where nothing is varied.
fn memory(sweeps: &[Sweep], base: Setting, measured: &[Measured], exponents: &[Exponent]) -> Panel {
    let usual = |sweep: Sweep| match sweep {
        Sweep::Frames => base.frames as f64,
        Sweep::Size => f64::from(base.width) * f64::from(base.height) / 1e6,
        Sweep::Rooms => base.rooms as f64,
        Sweep::Classes => base.classes as f64,
        Sweep::Strokes => base.strokes as f64,
    };
    let gigabytes = |one: &Measured| {
        let bytes = one.cost.peak_memory_bytes;
        bytes.map_or(f64::NAN, |bytes| bytes as f64 / 1e9)
    };
    let series = sweeps.iter().map(|&sweep| {
        let own = measured.iter().filter(|one| one.sweep == sweep);
        Series {
            name: named(sweep.name(), sweep, MEMORY, exponents),
            points: ascending(own.map(|one| Point::new(one.value() / usual(sweep), gigabytes(one)))),
        }
    });
    Panel::of_lines(
        "Peak memory",
        Axis::new("times the usual number", Scale::Logarithmic),
        Axis::new("GB", Scale::Logarithmic),
        series.collect(),
    )
}

/// A line's name with its exponent, where there is one.
fn named(name: &str, sweep: Sweep, quantity: &str, exponents: &[Exponent]) -> String {
    let own = |one: &&Exponent| one.sweep == sweep && one.quantity == quantity;
    exponents.iter().find(own).map_or_else(
        || name.to_owned(),
        |one| format!("{name}, {}", one.shown()).replace('-', "\u{2212}"),
    )
}

fn ascending(points: impl Iterator<Item = Point>) -> Vec<Point> {
    let mut points: Vec<Point> = points.collect();
    points.sort_by(|a, b| a.x.total_cmp(&b.x));
    points
}
