//! The laboratory of Inplace: what its maps are worth, and what they cost.
#![forbid(unsafe_code)]

use std::process::ExitCode;

use clap::Parser;
use inplace_lab::arguments::Arguments;
use inplace_lab::commands;

/// With the system's allocator, training is two to three times slower.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    match commands::run(Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("inplace-lab: {error}");
            ExitCode::FAILURE
        }
    }
}
