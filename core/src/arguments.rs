//! Arguments that several programs take on their command lines, for clap.

use std::path::PathBuf;
use std::str::FromStr;

use crate::cores;
use crate::features::{FeatureError, Network};
use crate::field::Preset;
use crate::scene::{OpenOptions, SceneSource};
use crate::session::SessionOptions;

/// How a scene is read and learnt.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct TrainingArguments {
    /// How much the field may model: auto, fast or accurate.
    #[arg(
        long,
        value_name = "NAME",
        value_enum,
        default_value = "auto",
        hide_possible_values = true
    )]
    pub preset: Preset,
    /// A pretrained network that recognises what looks alike: MobileNetV2, in a file as torchvision saves it.
    #[arg(long, value_name = "FILE", value_parser = network_file)]
    pub features: Option<PathBuf>,
    /// What is read of the scene, and what it is computed with.
    #[command(flatten)]
    pub reading: ReadingArguments,
}

/// What is read of a scene, and what it is computed with.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub struct ReadingArguments {
    /// Leave measured depth and sparse points aside.
    #[arg(long)]
    pub no_depth: bool,
    /// Read images that a file of the capture names outside its folder.
    #[arg(long)]
    pub outside_files: bool,
    /// Threads to train with [default: all cores].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub threads: Option<u16>,
    /// Seed of everything random.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
}

impl ReadingArguments {
    /// Threads to train with, without a window: as given, or all cores.
    pub fn threads(&self) -> usize {
        self.threads.map_or_else(cores, usize::from)
    }

    /// What to read of a scene.
    pub fn open_options(&self) -> OpenOptions {
        OpenOptions {
            depth: !self.no_depth,
            outside_files: self.outside_files,
            ..OpenOptions::default()
        }
    }

    /// The options of a session without a window.
    pub fn session_options(&self, source: SceneSource, preset: Preset) -> SessionOptions {
        SessionOptions {
            source,
            open: self.open_options(),
            preset,
            threads: self.threads(),
            seed: self.seed,
            views: false,
            first_look: false,
            features: None,
            state: None,
        }
    }
}

impl TrainingArguments {
    /// The options of a session without a window.
    pub fn session_options(&self, source: SceneSource) -> SessionOptions {
        SessionOptions {
            features: self.features.clone(),
            ..self.reading.session_options(source, self.preset)
        }
    }
}

/// What is wanted in place of a value that cannot be used: a sentence.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct Wanted(&'static str);

/// A number that fits.
///
/// # Errors
/// What is `wanted` instead.
pub fn number<T: FromStr>(
    text: &str,
    fits: impl FnOnce(&T) -> bool,
    wanted: &'static str,
) -> Result<T, Wanted> {
    text.parse().ok().filter(fits).ok_or(Wanted(wanted))
}

/// Seconds, more than none.
///
/// # Errors
/// Anything else.
pub fn seconds(text: &str) -> Result<f64, Wanted> {
    let fits = |seconds: &f64| *seconds > 0.0 && *seconds < 1e9;
    number(text, fits, "give a number of seconds above zero and below 1e9")
}

fn network_file(path: &str) -> Result<PathBuf, FeatureError> {
    let path = PathBuf::from(path);
    Network::read(&path).map(|_| path)
}

/// The width and height of an image in pixels.
///
/// # Errors
/// Anything else, or a side that no image should have.
pub fn image_size(text: &str) -> Result<(u32, u32), Wanted> {
    let parsed = |(width, height): (&str, &str)| Some((width.parse().ok()?, height.parse().ok()?));
    match text.split_once('x').and_then(parsed) {
        Some((width @ 16..=8192, height @ 16..=8192)) => Ok((width, height)),
        _ => Err(Wanted(
            "give width and height in pixels, such as 640x480, each from 16 to 8192",
        )),
    }
}
