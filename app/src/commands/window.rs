//! `inplace`: the window, or the demo's maps where there is no display.

use std::path::PathBuf;
use std::time::Instant;

use inplace_core::scene::SceneSource;
use inplace_ui::{Start, Target, UiError, UiOptions};

use super::{Failure, label};
use crate::arguments::{LabelArguments, WindowArguments};

/// Where the demo's maps go when there is no display.
const DEMO_OUT: &str = "inplace-demo";

/// Opens the window, with the demo where it was asked for; without a display and with nothing given to open, labels the demo instead.
pub fn run(arguments: WindowArguments, demo: bool, started: Instant) -> Result<(), Failure> {
    let options = UiOptions {
        open: if demo {
            Some(Target::Scene(SceneSource::Demo))
        } else {
            arguments.open.clone().map(Target::Path)
        },
        start: Start {
            read: arguments.training.reading.open_options(),
            preset: arguments.training.preset,
            threads: arguments.training.reading.threads.map(usize::from),
            features: arguments.training.features.clone(),
            seed: arguments.training.reading.seed,
        },
        stats: arguments.stats.then_some(started),
        trace: arguments.trace,
    };
    match inplace_ui::run(options) {
        Ok(()) => Ok(()),
        Err(UiError::NoDisplay(_)) if arguments.open.is_none() => {
            eprintln!(
                "inplace: there is no display for the window, so the demo scene is labelled into ./{DEMO_OUT} instead"
            );
            label::run(&LabelArguments {
                scene: PathBuf::from("demo"),
                out: PathBuf::from(DEMO_OUT),
                training: arguments.training,
                ..LabelArguments::default()
            })
        }
        Err(error) => Err(error.into()),
    }
}
