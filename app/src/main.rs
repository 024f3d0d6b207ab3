//! Inplace: labels a whole scene from a few clicks.
#![forbid(unsafe_code)]

/// In place of that of std, which panics where nobody reads any more; this one is a `Result`.
macro_rules! println {
    ($($line:tt)*) => {
        $crate::commands::print(format_args!($($line)*))
    };
}

/// The same for what is told beside the work, which goes on when nobody reads it.
macro_rules! eprintln {
    ($($line:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stderr(), $($line)*);
    }};
}

mod arguments;
mod commands;
mod logging;

use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use inplace_core::TOLD;

use arguments::Arguments;

/// With the system's allocator, training is two to three times slower.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    let started = Instant::now();
    let arguments = Arguments::parse();
    logging::start(arguments.log.as_deref(), arguments.opens_the_window());
    match commands::run(arguments, started) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            tracing::error!(target: TOLD, "{error}");
            eprintln!("inplace: {error}");
            ExitCode::FAILURE
        }
    }
}
