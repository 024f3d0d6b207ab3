//! `inplace bench scale`: how time and memory grow with frames, pixels, rooms, classes and strokes.

mod captures;
mod figure;

use std::collections::BTreeSet;

use inplace_core::eval::scale::{Exponent, Measured, QUANTITIES, Setting, Values, exponents, table};
use inplace_core::export;
use serde_json::json;

pub(super) use captures::of_one;

use super::machine::processor;
use crate::arguments::ScaleArguments;
use crate::commands::{Failure, cores};

/// An exponent above which growth is worth a look, and what its line is marked with.
const STEEP: f64 = 1.2;
const MARK: &str = "  <-";

/// Measures, writes `scale.json`, `scale.csv` and `scale.svg`, and prints.
pub fn run(arguments: &ScaleArguments) -> Result<(), Failure> {
    let out = &arguments.out;
    std::fs::create_dir_all(out).map_err(|error| format!("{}: cannot be made: {error}", out.display()))?;
    let threads = arguments.threads.map_or(cores(), usize::from);
    let (width, height) = arguments.at_size;
    let base = Setting {
        rooms: 1,
        width,
        height,
        frames: 100,
        classes: 20,
        strokes: 60,
    };
    let counts = |given: &[u16]| given.iter().copied().map(usize::from).collect();
    let values = Values {
        frames: counts(&arguments.frames),
        sizes: arguments.sizes.clone(),
        rooms: counts(&arguments.rooms),
        classes: counts(&arguments.classes),
        strokes: counts(&arguments.strokes),
    };
    let sweeps: Vec<_> = arguments
        .sweeps
        .iter()
        .map(|&sweep| (sweep, sweep.settings(base, &values)))
        .collect();
    let settings: BTreeSet<Setting> = sweeps
        .iter()
        .flat_map(|(_, settings)| settings)
        .copied()
        .collect();
    let costs = captures::measure(&settings, arguments, threads)?;
    let measured: Vec<Measured> = sweeps
        .iter()
        .flat_map(|(sweep, settings)| settings.iter().map(|setting| (*sweep, setting)))
        .map(|(sweep, setting)| Measured {
            sweep,
            rooms: setting.rooms,
            cost: costs[setting],
        })
        .collect();
    let exponents = exponents(&measured);
    let result = json!({
        "version": env!("CARGO_PKG_VERSION"),
        "machine": processor(),
        "threads": threads,
        "training_s": arguments.seconds,
        "seed": arguments.seed,
        "base": base,
        "measured": measured,
        "exponents": exponents,
    });
    export::write_json(&out.join("scale.json"), &result)?;
    table(&measured).write(&out.join("scale.csv"))?;
    figure::scale(base, threads, &measured, &exponents).write(&out.join("scale.svg"))?;
    if arguments.json {
        println!("{result:#}");
    } else {
        print_measured(&measured);
        print_exponents(&exponents);
    }
    Ok(())
}

fn print_measured(measured: &[Measured]) {
    println!(
        "sweep    frames  size       rooms  classes  strokes  opening s  surface s  in view s  all maps s  update s  steps/s  peak GB   voxels  parameters"
    );
    let gigabytes =
        |bytes: Option<u64>| bytes.map_or("-".to_owned(), |bytes| format!("{:.2}", bytes as f64 / 1e9));
    for Measured { sweep, rooms, cost } in measured {
        println!(
            "{:8} {:6}  {:10} {rooms:5} {:8} {:8} {:10.2} {:10.2} {:10.3} {:11.3} {:9.3} {:8.1} {:>8} {:8} {:11}",
            sweep.name(),
            cost.frames,
            format!("{}x{}", cost.width, cost.height),
            cost.classes,
            cost.strokes,
            cost.opening_s,
            cost.surface_s,
            cost.map_in_view_s,
            cost.all_maps_s,
            cost.update_s,
            cost.steps_per_s,
            gigabytes(cost.peak_memory_bytes),
            cost.surface_nodes,
            cost.parameters,
        );
    }
}

/// A line for each quantity of each sweep; steep ones are marked.
fn print_exponents(exponents: &[Exponent]) {
    println!("grows with the power");
    let widest = QUANTITIES
        .iter()
        .map(|quantity| quantity.name.len())
        .max()
        .unwrap_or(0);
    for one in exponents {
        println!(
            "{:8} {:widest$}  {:5.2}  from {} to {} ({} points){}",
            one.sweep.name(),
            one.quantity,
            one.exponent,
            one.from,
            one.to,
            one.points,
            if one.exponent > STEEP { MARK } else { "" }
        );
    }
}
