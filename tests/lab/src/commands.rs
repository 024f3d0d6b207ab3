//! Which measurement each command is, and what they share. Each measures, writes tables, charts and a page, and prints.

mod all;

use std::collections::HashSet;
use std::env;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process;

use inplace_core::cores;
use inplace_core::export::{self, total_memory};
use inplace_core::scene::SceneSource;
use serde::de::DeserializeOwned;

use crate::arguments::{Arguments, Bench, Command};
use crate::{Failure, audit, engine, field, latency, paper, pareto, scale, simulate, stability, stereo};

/// Does what the command line asks for.
///
/// # Errors
/// Whatever cannot be measured or written, and lines that were missed.
pub fn run(arguments: Arguments) -> Result<(), Failure> {
    let what = match arguments.command {
        Command::Simulate(arguments) => return simulate::run(&arguments),
        Command::Bench { what } => what,
    };
    match what {
        Bench::All(arguments) => all::run(&arguments),
        Bench::Audit(arguments) => audit::run(&arguments),
        Bench::Engine(arguments) => engine::run(&arguments),
        Bench::Field(arguments) => field::run(&arguments),
        Bench::Paper(arguments) => paper::run(&arguments),
        Bench::Latency(arguments) => latency::run(&arguments),
        Bench::Stability(arguments) => stability::run(&arguments),
        Bench::Stereo(arguments) => stereo::run(&arguments),
        Bench::Scale(arguments) => scale::run(&arguments),
        Bench::Pareto(arguments) => pareto::run(&arguments),
    }
}

/// Prepares the folder of the results, and refuses captures whose folders have the same name: results are told apart by it.
pub(crate) fn begin(out: &Path, scenes: &[PathBuf]) -> Result<(), Failure> {
    export::prepare(out, &[])?;
    let mut names = HashSet::new();
    let of = |scene: &PathBuf| SceneSource::from_argument(scene).name();
    match scenes.iter().map(of).find(|name| !names.insert(name.clone())) {
        Some(name) => Err(format!(
            "{name}: two captures have this name, by which results are told apart; rename one, or measure one at a time"
        )
        .into()),
        None => Ok(()),
    }
}

/// A number of things, such as `1 seed` and `2 seeds`.
pub(crate) fn counted(count: impl Into<u64>, thing: &str) -> String {
    let count = count.into();
    format!("{count} {thing}{}", if count == 1 { "" } else { "s" })
}

/// Items of `all` that belong together, in the order in which the first of each comes.
pub(crate) fn grouped<'a, T, K: PartialEq>(
    all: impl IntoIterator<Item = &'a T>,
    key: impl Fn(&'a T) -> K,
) -> Vec<(K, Vec<&'a T>)> {
    let mut groups: Vec<(K, Vec<&T>)> = Vec::new();
    for item in all {
        let own = key(item);
        match groups.iter_mut().find(|(other, _)| *other == own) {
            Some((_, members)) => members.push(item),
            None => groups.push((own, vec![item])),
        }
    }
    groups
}

/// Runs this very command again with one more option, so that the peak of its memory is that of one measurement, and reads
/// the JSON that it prints; `what` is named where it fails.
pub(crate) fn in_own_process<T: DeserializeOwned>(option: [&OsStr; 2], what: &str) -> Result<T, Failure> {
    // The option goes right behind the names of the command, `bench` and what it measures.
    let mut given = env::args_os().skip(1);
    let mut command = process::Command::new(env::current_exe()?);
    command.args(given.by_ref().take(2)).args(option).args(given);
    let output = command.output()?;
    if !output.status.success() {
        let told = String::from_utf8_lossy(&output.stderr);
        let reason = told.lines().last().unwrap_or("it ended without a reason");
        return Err(format!("{what} was not measured: {reason}").into());
    }
    Ok(serde_json::from_slice(&output.stdout)?)
}

/// Name of the processor, where the system tells.
pub(crate) fn processor() -> String {
    let text = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix("model name"));
    line.and_then(|line| line.split_once(':')).map_or_else(
        || env::consts::ARCH.to_owned(),
        |(_, name)| name.trim().to_owned(),
    )
}

/// Program, machine and date, in a sentence.
fn machine() -> String {
    let memory = total_memory().map_or_else(String::new, |bytes| {
        format!(", {:.0} GB of memory", bytes as f64 / 1e9)
    });
    format!(
        "Version {}, commit {}; {}, {} cores{memory}, {}; {}.",
        env!("CARGO_PKG_VERSION"),
        env!("INPLACE_COMMIT"),
        processor(),
        cores(),
        env::consts::OS,
        jiff::Timestamp::now().strftime("%F")
    )
}
