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

use super::Failure;
use crate::arguments::Bench;

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
