//! `inplace bench`: measurements, as commands.

mod all;
pub(super) mod engine;
mod field;
mod figure;
mod latency;
mod machine;
mod paper;
mod pareto;
mod scale;
mod stability;

use std::path::PathBuf;
use std::process::Command;

use inplace_core::scene::SceneSource;
use serde::de::DeserializeOwned;

use super::Failure;
use crate::arguments::Bench;

/// Refuses captures whose folders have the same name: results are told apart by it.
fn refuse_same_names(scenes: &[PathBuf]) -> Result<(), Failure> {
    let names = || {
        scenes
            .iter()
            .map(|scene| SceneSource::from_argument(scene).name())
    };
    match names().enumerate().find(|(at, name)| names().take(*at).any(|other| other == *name)) {
        Some((_, name)) => Err(format!(
            "{name}: two captures have this name, by which results are told apart; rename one, or measure one at a time"
        )
        .into()),
        None => Ok(()),
    }
}

/// Runs this program again with these arguments, so that the peak of its memory is that of one measurement, and reads the
/// JSON that it prints; `what` is named where it fails.
fn in_own_process<T: DeserializeOwned>(command: &mut Command, what: &str) -> Result<T, Failure> {
    let output = command.output()?;
    if !output.status.success() {
        let reason = String::from_utf8_lossy(&output.stderr);
        return Err(format!("{what} was not measured: {}", reason.trim()).into());
    }
    Ok(serde_json::from_slice(&output.stdout)?)
}

/// Measures what is asked for.
pub fn run(what: Bench) -> Result<(), Failure> {
    match what {
        Bench::All(arguments) => all::run(&arguments),
        Bench::Engine(arguments) => engine::run(&arguments),
        Bench::Field(arguments) => field::run(&arguments),
        Bench::Paper(arguments) => paper::run(&arguments),
        Bench::Latency(arguments) => latency::run(&arguments),
        Bench::Stability(arguments) => stability::run(&arguments),
        Bench::Scale(arguments) => scale::run(&arguments),
        Bench::Pareto(arguments) => pareto::run(&arguments),
        Bench::ParetoOf(arguments) => pareto::of_one(&arguments),
        Bench::CostOf {
            scene,
            strokes,
            seconds,
            training,
        } => scale::of_one(&scene, &strokes, seconds, &training),
    }
}
