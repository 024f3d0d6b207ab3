//! Captures of the demo room in every setting, each measured in a process of its own.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsStr;
use std::fs;
use std::io;
use std::path::Path;

use crate::scale::{Setting, scattered};
use crate::{Cost, session_cost};
use inplace_core::export::write_strokes;
use inplace_core::field::Preset;
use inplace_core::scene::{OpenOptions, Scene, SceneSource, demo, write_replica};
use inplace_core::session::Progress;
use tempfile::TempDir;

use crate::Failure;
use crate::arguments::ScaleArguments;
use crate::commands::in_own_process;

/// The strokes of a capture, in its folder.
const STROKES: &str = "strokes.json";

/// Measures every setting with strokes of this seed; tells how it goes on stderr.
pub(super) fn measure(settings: &BTreeSet<Setting>, seed: u64) -> Result<BTreeMap<Setting, Cost>, Failure> {
    let scratch = folder_in(&std::env::temp_dir())?;
    let mut costs = BTreeMap::new();
    let mut rendered: Option<Rendered> = None;
    let progress = Progress::default();
    // The longest first: shorter captures are its first frames.
    for &setting in settings.iter().rev() {
        let whole = match rendered.take() {
            Some(rendered) if rendered.begins_with(setting) => rendered,
            previous => {
                drop(previous);
                Rendered::new(scratch.path(), setting, &progress)?
            }
        };
        let Setting {
            rooms,
            width,
            height,
            frames,
            classes,
            strokes,
        } = setting;
        progress.show(format!(
            "measuring rooms: {rooms}, frames: {frames} of {width}x{height}, classes: {classes}, strokes: {strokes}"
        ));
        costs.insert(setting, whole.cost(setting, seed)?);
        rendered = Some(whole);
    }
    Ok(costs)
}

/// A capture on disk, removed when it is dropped.
struct Rendered {
    shot: demo::Shot,
    folder: TempDir,
}

impl Rendered {
    fn new(parent: &Path, setting: Setting, progress: &Progress) -> Result<Self, Failure> {
        let shot = demo::Shot {
            rooms: setting.rooms,
            frames: setting.frames,
            width: setting.width,
            height: setting.height,
        };
        let folder = folder_in(parent)?;
        let (frames, width, height) = (shot.frames, shot.width, shot.height);
        progress.show(format!("rendering {frames} frames of {width}x{height}"));
        write_replica(&shot.unrendered(), folder.path(), None)?;
        Ok(Self { shot, folder })
    }

    /// Whether the first frames of this capture are those of the setting.
    fn begins_with(&self, setting: Setting) -> bool {
        let same_images = (self.shot.width, self.shot.height, self.shot.rooms)
            == (setting.width, setting.height, setting.rooms);
        // Several rooms share the frames: fewer are others.
        same_images && (self.shot.frames == setting.frames || setting.rooms == 1)
    }

    /// Measures the first frames of it with the setting's strokes.
    fn cost(&self, setting: Setting, seed: u64) -> Result<Cost, Failure> {
        let whole = self.folder.path();
        let part = folder_in(whole.parent().unwrap_or(whole))?;
        link_first(whole, part.path(), setting.frames).map_err(|error| unwritable(part.path(), &error))?;
        // The images are read one after the other when they are clicked on: this process is no part of the measurement.
        let options = OpenOptions {
            image_bytes: 0,
            ..OpenOptions::default()
        };
        let source = SceneSource::Folder(part.path().to_path_buf());
        let scene = Scene::open(&source, options, &|_, _| {})?;
        // One more for the click after all maps.
        let (classes, clicks) = (setting.classes, setting.strokes + 1);
        let labels = scattered(&scene, &self.shot.labels(), classes, clicks, seed)?;
        write_strokes(&part.path().join(STROKES), &labels, &scene.frames)?;
        let option = [OsStr::new("--cost-of"), part.path().as_os_str()];
        in_own_process(option, &format!("{}: its cost", part.path().display()))
    }
}

/// A folder inside this one that is removed in the end.
fn folder_in(parent: &Path) -> Result<TempDir, Failure> {
    let folder = tempfile::Builder::new()
        .prefix("inplace-scale-")
        .tempdir_in(parent);
    folder.map_err(|error| unwritable(parent, &error))
}

fn unwritable(path: &Path, error: &io::Error) -> Failure {
    let path = path.display();
    format!("{path}: cannot be written: {error}; free some space there").into()
}

/// Makes a capture of the first frames of another one.
fn link_first(whole: &Path, part: &Path, frames: usize) -> io::Result<()> {
    for kind in ["rgb", "depth"] {
        fs::create_dir_all(part.join(kind))?;
        for frame in 0..frames {
            let file = format!("{kind}/{kind}_{frame}.png");
            // Not every file system has links.
            fs::hard_link(whole.join(&file), part.join(&file))
                .or_else(|_| fs::copy(whole.join(&file), part.join(&file)).map(|_| ()))?;
        }
    }
    fs::copy(whole.join("intrinsics.txt"), part.join("intrinsics.txt"))?;
    let poses = fs::read_to_string(whole.join("traj_w_c.txt"))?;
    let first: Vec<&str> = poses.lines().take(frames).collect();
    fs::write(part.join("traj_w_c.txt"), first.join("\n") + "\n")
}

/// Measures one capture in this process, so that the peak of its memory is its own, and prints JSON.
pub(super) fn print_cost(arguments: &ScaleArguments, capture: &Path) -> Result<(), Failure> {
    let source = SceneSource::from_argument(capture);
    let options = arguments.reading.session_options(source, Preset::Auto);
    let cost = session_cost(options, arguments.seconds, &capture.join(STROKES))?;
    println!("{}", serde_json::to_string(&cost)?);
    Ok(())
}
