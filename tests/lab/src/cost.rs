//! What a capture costs: waiting, speed of training, memory.

use std::path::Path;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use super::learnt::{wait_for_map, wait_for_surface};
use super::{Failure, no_strokes};
use inplace_core::export::peak_memory;
use inplace_core::labels::read_strokes;
use inplace_core::session::{Client, Command, Event, SessionOptions, Status};

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

/// Opens a capture in a session, gives it all strokes of a strokes file but the last, then the last as one more click, and
/// trains for `seconds`. Peak memory is that of the whole process: measure each capture in a process of its own.
///
/// # Errors
/// A session that fails, and strokes that do not fit the capture or are fewer than two.
pub fn session_cost(options: SessionOptions, seconds: f64, strokes: &Path) -> Result<Cost, Failure> {
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
    let (training, steps) = (Instant::now(), run.status().work.steps);
    let enough = |status: &Status| training.elapsed().as_secs_f64() >= seconds || status.settled;
    if !run.status().settled {
        let is_enough = |event: &Event| matches!(event, Event::Status(status) if enough(status));
        run.wait_until(None, is_enough)?;
    }
    let steps = run.status().work.steps - steps;
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
        std::hint::black_box(map.mean_entropy() + map.coverage());
    }
}
