//! What captures of the demo room cost, each in a process of its own: waiting, speed of training, memory.

use std::ffi::OsStr;
use std::path::Path;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use super::{Setting, scattered};
use crate::arguments::ScaleArguments;
use crate::commands::in_own_process;
use crate::learnt::{wait_for_map, wait_for_surface};
use crate::{Failure, no_strokes};
use inplace_core::export::{peak_memory, write_strokes};
use inplace_core::field::Preset;
use inplace_core::labels::read_strokes;
use inplace_core::scene::{OpenOptions, Scene, SceneSource, demo, write_replica};
use inplace_core::session::{Client, Command, Event, Progress, SessionOptions, Status};

/// The strokes of a capture, in its folder.
const STROKES: &str = "strokes.json";

/// How long the events that waited are followed before steps are counted.
const CATCHING_UP: Duration = Duration::from_millis(300);

/// What one capture cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// Seconds until the capture was open.
    pub opening_s: f64,
    /// Seconds from then until there was a surface to spread labels over.
    pub surface_s: f64,
    /// Seconds from giving the strokes until the map of the frame in view was read.
    pub map_in_view_s: f64,
    /// Seconds from giving the strokes until every frame's map had been read, pixel by pixel.
    pub all_maps_s: f64,
    /// Seconds from one more click, in the frame in view, until every frame's map had been read again.
    pub update_s: f64,
    /// Voxels of the surface.
    pub surface_nodes: usize,
    /// Trainable parameters after the training.
    pub parameters: usize,
    /// Steps a second after that, everything else running beside them.
    pub steps_per_s: f64,
    /// The most memory held until the capture was open, in bytes.
    pub peak_opening_bytes: Option<u64>,
    /// The most memory held in all, in bytes.
    pub peak_memory_bytes: Option<u64>,
}

/// Renders the capture of a setting to a folder that is removed in the end, and measures it with strokes of this seed.
pub(super) fn cost(setting: Setting, seed: u64, progress: &Progress) -> Result<Cost, Failure> {
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
    let shot = demo::Shot {
        rooms,
        frames,
        width,
        height,
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
    let labels = scattered(&scene, &shot.labels(), classes, strokes + 1, seed)?;
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

/// Opens a capture in a session, gives it all strokes of a strokes file but the last, then the last as one more click, and
/// trains for `seconds`. Peak memory is that of the whole process: measure each capture in a process of its own.
///
/// # Errors
/// A session that fails, and strokes that do not fit the capture or are fewer than two.
fn session_cost(options: SessionOptions, seconds: f64, strokes: &Path) -> Result<Cost, Failure> {
    let start = Instant::now();
    // The cost of training is measured whatever the labels need.
    let mut run = Client::start(SessionOptions {
        views: true,
        ..options
    });
    let scene = run.opened()?;
    let opening_s = start.elapsed().as_secs_f64();
    let peak_opening_bytes = peak_memory();
    let open = Instant::now();
    run.send(Command::Suggest { only: None });
    wait_for_surface(&mut run)?;
    let surface_s = open.elapsed().as_secs_f64();

    let labels = read_strokes(strokes, &scene)?;
    let mut first = labels.clone();
    let Some((_, last)) = first.strokes.pop_last().filter(|_| !first.strokes.is_empty()) else {
        return Err(no_strokes(&scene));
    };
    let view = last.frame;
    run.send(Command::View { frame: view });
    let click = Instant::now();
    run.label(first, 1);
    wait_for_map(&mut run, view, 1)?;
    read(&run, view);
    let map_in_view_s = click.elapsed().as_secs_f64();
    run.mapped(1)?;
    (0..scene.frames.len()).for_each(|frame| read(&run, frame));
    let all_maps_s = click.elapsed().as_secs_f64();

    let click = Instant::now();
    run.label(labels, 2);
    run.mapped(2)?;
    (0..scene.frames.len()).for_each(|frame| read(&run, frame));
    let update_s = click.elapsed().as_secs_f64();

    // What was told while the maps were being read is past: steps are counted from a status of now.
    run.work_until(Instant::now() + CATCHING_UP)?;
    run.wait_until(None, |event| matches!(event, Event::Status(_)))?;
    let (training, steps) = (Instant::now(), run.status().steps);
    let enough = |status: &Status| training.elapsed().as_secs_f64() >= seconds || status.settled;
    if !run.status().settled {
        let is_enough = |event: &Event| matches!(event, Event::Status(status) if enough(status));
        run.wait_until(None, is_enough)?;
    }
    let steps = run.status().steps - steps;
    Ok(Cost {
        opening_s,
        surface_s,
        map_in_view_s,
        all_maps_s,
        update_s,
        surface_nodes: run.status().surface_nodes,
        parameters: run.status().parameters,
        steps_per_s: steps as f64 / training.elapsed().as_secs_f64(),
        peak_opening_bytes,
        peak_memory_bytes: peak_memory(),
    })
}

/// Reads a frame's map as a window would.
fn read(run: &Client, frame: usize) {
    if let Some(map) = run.map(frame) {
        std::hint::black_box((map.labels().len(), map.entropy().len()));
    }
}
