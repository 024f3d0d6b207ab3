//! What each command does.

mod budget;
mod compare;
mod demo;
mod export;
mod info;
mod label;
mod manual;
mod run;
mod window;

use std::error::Error;
use std::fmt;
use std::io::{self, ErrorKind, Write};
use std::time::Instant;

use inplace_core::scene::demo::Shot;

use crate::arguments::{Arguments, Command};

/// Any failure: one sentence that names the file and what to do.
pub type Failure = Box<dyn Error + Send + Sync>;

/// Prints a line. That somebody has stopped reading, as `head` does, is no failure; all else is.
pub fn print(line: fmt::Arguments<'_>) -> Result<(), Failure> {
    writeln!(io::stdout(), "{line}").or_else(|error| match error.kind() {
        ErrorKind::BrokenPipe => Ok(()),
        _ => Err(format!("the results cannot be printed: {error}").into()),
    })
}

/// Does what the command line asks for, in a program that started then.
pub fn run(arguments: Arguments, started: Instant) -> Result<(), Failure> {
    match arguments.command {
        Some(Command::Demo {
            out: Some(out),
            rooms,
            frames,
            size: (width, height),
        }) => {
            let shot = Shot {
                rooms: rooms.into(),
                frames: frames.into(),
                width,
                height,
            };
            demo::run(&out, shot)
        }
        Some(Command::Demo { out: None, .. }) => window::run(arguments.window, true, started),
        Some(Command::Info {
            scene,
            outside_files,
            json,
        }) => info::run(&scene, outside_files, json),
        Some(Command::Label(label)) => label::run(&label),
        Some(Command::Compare(arguments)) => compare::run(&arguments),
        Some(Command::Export(arguments)) => export::run(&arguments),
        Some(Command::Manual { out }) => manual::run(&out),
        None => window::run(arguments.window, false, started),
    }
}
