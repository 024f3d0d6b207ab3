//! `inplace bench`: measurements, as commands.

use std::path::Path;

use inplace_core::eval::path_speeds;
use inplace_core::export;
use serde_json::json;

use super::{Failure, cores};
use crate::arguments::Bench;

/// Sizes of the hash table that the engine is measured with.
const TABLES: [u32; 2] = [17, 19];

/// Measures what is asked for.
pub fn run(what: Bench) -> Result<(), Failure> {
    match what {
        Bench::Engine {
            out,
            rounds,
            threads,
            json,
        } => engine(&out, rounds, threads.map_or(cores(), usize::from), json),
    }
}

fn engine(out: &Path, rounds: usize, threads: usize, as_json: bool) -> Result<(), Failure> {
    std::fs::create_dir_all(out).map_err(|error| format!("{}: cannot be made: {error}", out.display()))?;
    let mut paths = Vec::new();
    for table_log2 in TABLES {
        paths.extend(path_speeds(table_log2, rounds, threads)?);
    }
    let result = json!({ "threads": threads, "rounds": rounds, "paths": paths });
    export::write_json(&out.join("engine.json"), &result)?;
    if as_json {
        println!("{result:#}");
        return Ok(());
    }
    println!("path            table  million samples/s");
    for path in &paths {
        println!(
            "{:15} 2^{:<4} {:6.2}",
            path.name,
            path.table_log2,
            path.samples_per_s / 1e6
        );
    }
    Ok(())
}
