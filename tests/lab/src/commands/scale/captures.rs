//! Captures of the demo room in every setting, each measured in a process of its own.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsStr;
use std::path::Path;

use crate::scale::{Setting, scattered};
use crate::{Cost, session_cost};
use inplace_core::export::write_strokes;
use inplace_core::field::Preset;
use inplace_core::scene::{OpenOptions, Scene, SceneSource, demo, write_replica};
use inplace_core::session::Progress;

use crate::Failure;
use crate::arguments::ScaleArguments;
use crate::commands::in_own_process;

/// The strokes of a capture, in its folder.
const STROKES: &str = "strokes.json";

/// Measures every setting with strokes of this seed; tells how it goes on stderr.
pub(super) fn measure(settings: &BTreeSet<Setting>, seed: u64) -> Result<BTreeMap<Setting, Cost>, Failure> {
    let progress = Progress::default();
    let mut costs = BTreeMap::new();
    for &setting in settings {
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
        costs.insert(setting, cost(setting, seed)?);
    }
    Ok(costs)
}

/// Renders the capture of a setting to a folder that is removed in the end, and measures it with its strokes.
fn cost(setting: Setting, seed: u64) -> Result<Cost, Failure> {
    let shot = demo::Shot {
        rooms: setting.rooms,
        frames: setting.frames,
        width: setting.width,
        height: setting.height,
    };
    let folder = tempfile::Builder::new().prefix("inplace-scale-").tempdir();
    let folder = folder.map_err(|error| {
        let parent = std::env::temp_dir();
        format!(
            "{}: cannot be written: {error}; free some space there",
            parent.display()
        )
    })?;
    let path = folder.path();
    write_replica(&shot.unrendered(), path, None)?;
    // The images are read one after the other when they are clicked on: this process is no part of the measurement.
    let options = OpenOptions {
        image_bytes: 0,
        ..OpenOptions::default()
    };
    let scene = Scene::open(&SceneSource::Folder(path.to_path_buf()), options, &|_, _| {})?;
    // One more for the click after all maps.
    let (classes, clicks) = (setting.classes, setting.strokes + 1);
    let labels = scattered(&scene, &shot.labels(), classes, clicks, seed)?;
    write_strokes(&path.join(STROKES), &labels, &scene.frames)?;
    let option = [OsStr::new("--cost-of"), path.as_os_str()];
    in_own_process(option, &format!("{}: its cost", path.display()))
}

/// Measures one capture in this process, so that the peak of its memory is its own, and prints JSON.
pub(super) fn print_cost(arguments: &ScaleArguments, capture: &Path) -> Result<(), Failure> {
    let source = SceneSource::from_argument(capture);
    let options = arguments.reading.session_options(source, Preset::Auto);
    let cost = session_cost(options, arguments.seconds, &capture.join(STROKES))?;
    println!("{}", serde_json::to_string(&cost)?);
    Ok(())
}
