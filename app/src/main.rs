//! Labels a whole scene from a few clicks.

use std::process::ExitCode;

use inplace_core::scene::SceneSource;
use inplace_ui::{Target, UiOptions};

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    let mut options = UiOptions::default();
    for argument in std::env::args_os().skip(1) {
        match argument.to_str() {
            Some("--stats") => options.stats = true,
            Some("demo") => options.open = Some(Target::Scene(SceneSource::Demo)),
            _ => options.open = Some(Target::Path(argument.into())),
        }
    }
    match inplace_ui::run(options) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("inplace: {error}");
            ExitCode::FAILURE
        }
    }
}
