//! The command line.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use inplace_core::arguments::{TrainingArguments, Wanted, image_size, number, seconds};
use inplace_core::export::Format;
use inplace_core::labels::Trust;
use inplace_core::scene::demo::MOST_ROOMS;

use crate::commands::Failure;

/// Labels a whole scene from a few clicks.
#[derive(Debug, Parser)]
#[command(version, args_conflicts_with_subcommands = true)]
pub struct Arguments {
    /// What to do; without a command, the window opens.
    #[command(subcommand)]
    pub command: Option<Command>,
    #[command(flatten)]
    pub window: WindowArguments,
    /// Write a log to this file; give it after the command, if there is one. Without it the last events are kept for bug
    /// reports, in inplace/inplace.log in $XDG_DATA_HOME or ~/.local/share (macOS: ~/Library/Application Support, Windows:
    /// %LOCALAPPDATA%). RUST_LOG says what is logged.
    #[arg(long, value_name = "FILE", global = true)]
    pub log: Option<PathBuf>,
}

impl Arguments {
    /// Whether the window opens; all else runs without one.
    pub fn opens_the_window(&self) -> bool {
        matches!(self.command, None | Some(Command::Demo { out: None, .. }))
    }
}

/// The window.
#[derive(Debug, Args)]
pub struct WindowArguments {
    /// Folder of a capture or a project file (NAME.inplace) [default: the start page, or the demo scene until another has been opened].
    #[arg(value_name = "SCENE | PROJECT.inplace")]
    pub open: Option<PathBuf>,
    /// Print at the end, as JSON on stderr, how long the window's frames, the maps after a click and the outline of what a
    /// click would win take; first_frame_ms and first_map_ms are how long after the start the first image and the first
    /// labels over it were there.
    #[arg(long)]
    pub stats: bool,
    /// Write a record of what happens in the window to this file, a line of JSON for each event.
    #[arg(long, value_name = "FILE")]
    pub trace: Option<PathBuf>,
    #[command(flatten)]
    pub training: TrainingArguments,
}

/// What can be done without the window.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Write the demo scene as a folder, with its ground truth; without --out, open the window with it.
    Demo {
        /// The folder to make.
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        /// Rooms of the written scene, in a row; the frames go through them one after the other.
        #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=i64::from(MOST_ROOMS)), requires = "out")]
        rooms: u16,
        /// Number of frames of the written scene, of all rooms together.
        #[arg(long, value_name = "N", default_value_t = 60, value_parser = clap::value_parser!(u16).range(2..), requires = "out")]
        frames: u16,
        /// Image size of the written scene.
        #[arg(long, value_name = "WxH", default_value = "320x240", value_parser = image_size, requires = "out")]
        size: (u32, u32),
    },
    /// Tell what was found in a capture: format, frames, intrinsics, depth, labels, bounds, problems.
    Info {
        /// Folder of a capture, or "demo".
        scene: PathBuf,
        /// Read images that a file of the capture names outside its folder.
        #[arg(long)]
        outside_files: bool,
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
    /// Label every frame of a scene from a few strokes.
    Label(LabelArguments),
    /// Write a project's labels as a data set in one of several formats.
    Export(ExportArguments),
    /// Compare two projects of one scene: how far their labels agree, and where they differ.
    Compare(CompareArguments),
    /// Write the manual pages, and completions for bash, fish and zsh.
    Manual {
        /// The folder to write into, such as ~/.local/share; below it the files lie as below /usr/local/share.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
    },
}

/// Labelling without the window.
#[derive(Debug, Default, Args)]
pub struct LabelArguments {
    /// Folder of a capture, a project file (NAME.inplace), or "demo".
    #[arg(value_name = "SCENE | PROJECT.inplace")]
    pub scene: PathBuf,
    /// The strokes (JSON); a project brings its own, and the demo has some built in.
    #[arg(long, value_name = "FILE")]
    pub strokes: Option<PathBuf>,
    /// Labels of frames from elsewhere, such as a network's predictions or an earlier labelling: a folder of files
    /// named by frame stem, PNGs with class ids or class colours, or NPYs or NPZs with class probabilities, at the
    /// frame's size or a part of it. classes.json beside them names the classes, and objects.json the objects in a
    /// folder objects/; without that, each frame has numbers of its own. A folder that `label` wrote will do.
    #[arg(long, value_name = "DIR", alias = "labels")]
    pub import: Option<PathBuf>,
    /// How far the pixels of --import can be believed beside strokes, from 0 to 1. Below 1 they are votes: where many
    /// disagree they are outvoted, and a stroke corrects what it is connected with, the farther the less they are
    /// trusted. 0: they fill in what no stroke leads to; 1: they are right, as strokes are [default: 0.5].
    #[arg(long, value_name = "T", requires = "import", value_parser = trust)]
    pub trust: Option<Trust>,
    /// Where the maps and the report go.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Wall time from the start to the last file written, in seconds [default: until the maps have settled].
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    pub budget: Option<f64>,
    /// Label anew what the folder has labels of already. Without it, a folder whose report.json was made from the same
    /// scene, strokes and options by this version is left as it is.
    #[arg(long)]
    pub force: bool,
    /// Memory that decoded images may take, in GB; of a capture that takes more, only as many keyframes as fit stay there
    /// [default: 1.6].
    #[arg(long, value_name = "GB", value_parser = gigabytes)]
    pub image_memory: Option<f64>,
    /// Print the report as JSON; of a run that fails, an object with the sentence as "error".
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub training: TrainingArguments,
}

/// Exporting a project.
#[derive(Debug, Args)]
pub struct ExportArguments {
    /// A project file.
    #[arg(value_name = "PROJECT.inplace")]
    pub project: PathBuf,
    /// The folder to write into; files there that are right already are left alone.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// What to write: png, overlay, voc, cityscapes, coco-panoptic, coco-instances, labelme, yolo, hugging-face; the
    /// surface as PLY: point-cloud or mesh; or a 3D box around each object: boxes.
    #[arg(long, value_name = "FORMAT", default_value = "png", value_parser = format)]
    pub format: Format,
    /// Render views of the scene along a camera path instead, with their labels, as a capture: lines of 16 numbers
    /// (camera-to-world, row by row, as in traj_w_c.txt), a transforms.json or a camera path of nerfstudio, in the
    /// coordinates of the capture.
    #[arg(long, value_name = "FILE", conflicts_with = "format")]
    pub trajectory: Option<PathBuf>,
    /// The camera of --trajectory: a file with fx fy cx cy width height [default: that of the path or else of the first
    /// frame].
    #[arg(long, value_name = "FILE", requires = "trajectory")]
    pub intrinsics: Option<PathBuf>,
    /// Pixels whose class is less probable than this become void.
    #[arg(long, value_name = "P", value_parser = share)]
    pub least_probability: Option<f32>,
    /// Numbers, names and colours that the classes take by name: NYU-13, ScanNet-20, Cityscapes, NYU-40, COCO-Stuff, or
    /// a JSON file [{"id", "name", "color"}]. Classes that are not in it become void.
    #[arg(long, value_name = "LIST")]
    pub ids: Option<String>,
    /// Wall time for a project that holds no model, from the start to the last file written, in seconds [default: 20
    /// where depth was measured, otherwise until the maps have settled].
    #[arg(long, value_name = "SECONDS", value_parser = seconds, conflicts_with = "trajectory")]
    pub budget: Option<f64>,
    #[command(flatten)]
    pub training: TrainingArguments,
}

/// Comparing two projects.
#[derive(Debug, Args)]
pub struct CompareArguments {
    /// A project file.
    #[arg(value_name = "A.inplace")]
    pub first: PathBuf,
    /// Another one, whose scene has frames of the same names; classes are matched by name.
    #[arg(value_name = "B.inplace")]
    pub second: PathBuf,
    /// Write comparison.json here, and differences/STEM.png for every frame: 0 where both say the same or nothing, 96
    /// where one alone gives a class, 255 where they differ.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub training: TrainingArguments,
}

fn format(name: &str) -> Result<Format, Failure> {
    let known = Format::ALL.map(Format::name);
    Format::named(name).ok_or_else(|| format!("use {}", known.join(", ")).into())
}

fn share(text: &str) -> Result<f32, Wanted> {
    let fits = |share: &f32| (0.0..=1.0).contains(share);
    number(text, fits, "give a probability, from 0 to 1")
}

fn trust(text: &str) -> Result<Trust, Failure> {
    let trust = text.parse().ok().and_then(Trust::new);
    trust.ok_or_else(|| "give a number from 0 to 1".into())
}

fn gigabytes(text: &str) -> Result<f64, Wanted> {
    let fits = |&size: &f64| size > 0.0 && size < 1e6;
    number(text, fits, "give a number of gigabytes above zero")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_earlier_name_of_import_still_holds() {
        let given = "inplace label demo --out x --labels images --trust 0.25";
        let parsed = Arguments::try_parse_from(given.split(' ')).unwrap();
        let Some(Command::Label(label)) = parsed.command else {
            panic!("{given}");
        };
        assert_eq!(label.import, Some(PathBuf::from("images")));
        assert_eq!(label.trust, Trust::new(0.25));
    }

    #[test]
    fn wrong_arguments_exit_with_2() {
        for wrong in [
            "label demo --no-such-option",
            "label demo --budget=-5",
            "label demo --budget=never",
            "label demo --preset=best",
            "label demo --features=src/main.rs",
            "label demo --threads=0",
            "label demo --trust=1",
            "label demo --import=images --trust=1.5",
            "label demo --import=images --trust=-0.5",
            "label demo --import=images --trust=much",
            "label demo --import=images --trust=nan",
            "demo --rooms=0",
            "demo --rooms=1001",
        ] {
            let given = format!("inplace {wrong} --out x");
            let error = Arguments::try_parse_from(given.split(' ')).unwrap_err();
            assert_eq!(error.exit_code(), 2, "{wrong}: {error}");
            assert!(error.to_string().contains("--help"), "{wrong}: {error}");
        }
    }
}
