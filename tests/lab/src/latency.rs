//! How long a click waits for its maps while the session trains.

use std::sync::Arc;
use std::time::{Duration, Instant};

use rand::{Rng, SeedableRng, rngs::SmallRng};
use serde::Serialize;

use super::learnt::{wait_for_map, wait_for_surface};
use super::simulate::{Annotator, Click, Policy};
use super::{Failure, SceneTruth, no_strokes, unusable_scene};
use inplace_core::export::peak_memory;
use inplace_core::labels::{LabelSet, Object, ObjectId};
use inplace_core::session::{Client, Command, SessionOptions};

/// How long training goes on between clicks, in milliseconds: random, so that clicks fall on all of its work.
const REST_MS: std::ops::Range<u64> = 50..300;

/// How long clicks waited in one scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Latency {
    /// Name of the scene.
    pub scene: String,
    /// From the click until the map of the frame in view had been read, in milliseconds.
    pub in_view_ms: Percentiles,
    /// From the click until every frame had its map, in milliseconds.
    pub all_frames_ms: Percentiles,
    /// Number of clicks.
    pub clicks: usize,
    /// Number of frames.
    pub frames: usize,
    /// Number of classes.
    pub classes: usize,
    /// Number of objects that strokes named before the first click; then each click named another one.
    pub objects: usize,
    /// Voxels of the surface at the last click.
    pub surface_nodes: usize,
    /// Whether depth was read.
    pub depth: bool,
    /// Threads of the session.
    pub threads: usize,
    /// Seed of the clicks and of the session.
    pub seed: u64,
    /// Most memory that the process has taken, where the system tells.
    pub peak_memory_bytes: Option<u64>,
    /// Sessions that it took: when a field was trained, a new one went on from the same labels.
    pub sessions: usize,
}

/// Values that so many percent of all do not exceed; the smallest such ones.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Percentiles {
    /// Half of them.
    pub p50: f64,
    /// 95%.
    pub p95: f64,
    /// 99%.
    pub p99: f64,
    /// All values, ascending.
    #[serde(skip)]
    pub sorted: Vec<f64>,
}

impl Percentiles {
    /// Of some values; `None` without any.
    pub fn of(mut values: Vec<f64>) -> Option<Self> {
        values.sort_by(f64::total_cmp);
        let rank = |percent: usize| (values.len() * percent).div_ceil(100);
        let at = |percent: usize| values.get(rank(percent).saturating_sub(1)).copied();
        Some(Self {
            p50: at(50)?,
            p95: at(95)?,
            p99: at(99)?,
            sorted: values,
        })
    }
}

/// Lets an annotator who knows the truth click so many random pixels, equally many of every class, each on
/// another frame than the one before, in a session whose field is being trained; waits for all maps of each click.
///
/// # Errors
/// A scene without ground truth or with a single frame to label, and whatever stops a session.
pub fn click_latency(
    options: &SessionOptions,
    (clicks, objects): (usize, usize),
    progress: &mut dyn FnMut(&str),
) -> Result<Latency, Failure> {
    // Training goes on whatever the labels need: a click has to be fast all the same.
    let options = &SessionOptions {
        views: true,
        ..options.clone()
    };
    let mut run = Client::start(options.clone());
    let scene = run.opened()?;
    let truth = SceneTruth::read(&scene)?;
    let annotator = Annotator::new(&scene, &truth);
    let planned = on_changing_frames(&annotator, clicks, options.seed);
    if planned.len() < clicks {
        let too_few =
            "there are too few frames to click on another one each time; measure on a longer capture";
        return Err(unusable_scene(&scene, too_few));
    }
    wait_for_surface(&mut run)?;
    let rounds = objects.div_ceil(annotator.classes().len().max(1));
    let mut named = annotator.clicks(Policy::Random, rounds, !options.seed);
    named.truncate(objects);
    let labels = |clicks: usize| {
        let mut labels = annotator.labels(&[&named, &planned[..clicks]].concat());
        if objects > 0 {
            name_objects(&mut labels);
        }
        labels
    };
    // After so many clicks.
    let generation = |clicks: usize| clicks as u64 + 1;
    run.label(labels(0), generation(0));
    run.mapped(generation(0))?;

    let mut rng = SmallRng::seed_from_u64(options.seed);
    let mut rest = || Duration::from_millis(rng.random_range(REST_MS));
    let (mut in_view, mut all_frames) = (Vec::new(), Vec::new());
    let mut sessions = 1;
    for number in 1..=clicks {
        progress(&format!("click {number} of {clicks}"));
        run.work_until(Instant::now() + rest())?;
        if run.status().training_end.is_some() {
            // Not both at a time: they would share the memory and the cores.
            drop(run);
            sessions += 1;
            let before = number - 1;
            run = going_on(options, labels(before), generation(before))?;
            run.work_until(Instant::now() + rest())?;
        }
        let frame = planned[number - 1].frame;
        let (view, all) = waited(&mut run, frame, labels(number), generation(number))?;
        in_view.push(view);
        all_frames.push(all);
    }
    let none = || no_strokes(&scene);
    Ok(Latency {
        scene: scene.name(),
        in_view_ms: Percentiles::of(in_view).ok_or_else(none)?,
        all_frames_ms: Percentiles::of(all_frames).ok_or_else(none)?,
        clicks,
        frames: scene.frames.len(),
        classes: annotator.classes().len(),
        objects: named.len(),
        peak_memory_bytes: peak_memory(),
        surface_nodes: run.status().surface_nodes,
        depth: scene.has_depth(),
        threads: options.threads,
        seed: options.seed,
        sessions,
    })
}

/// Has each stroke say an object of its own; all classes become things.
fn name_objects(labels: &mut LabelSet) {
    labels.classes.iter_mut().for_each(|class| class.thing = true);
    for (number, stroke) in (1..).zip(labels.strokes.values_mut()) {
        let Some(id) = ObjectId::new(number) else {
            return;
        };
        let (class, name) = (stroke.class, format!("object {number}"));
        labels.objects.push(Object { id, class, name });
        Arc::make_mut(stroke).object = Some(id);
    }
}

/// So many clicks, equally many of every class, without those on the frame of the click before.
fn on_changing_frames(annotator: &Annotator<'_>, clicks: usize, seed: u64) -> Vec<Click> {
    let rounds = 2 * clicks.div_ceil(annotator.classes().len().max(1));
    let mut planned = annotator.clicks(Policy::Random, rounds, seed);
    planned.dedup_by_key(|click| click.frame);
    planned.truncate(clicks);
    planned
}

/// A new session with these labels, when all maps of them are there.
fn going_on(options: &SessionOptions, labels: LabelSet, generation: u64) -> Result<Client, Failure> {
    let mut run = Client::start(options.clone());
    run.opened()?;
    run.label(labels, generation);
    run.mapped(generation)?;
    Ok(run)
}

/// Milliseconds from a click until the map of its frame has been read, and until all maps are there.
fn waited(run: &mut Client, view: usize, labels: LabelSet, generation: u64) -> Result<(f64, f64), Failure> {
    let click = Instant::now();
    let milliseconds = || 1000.0 * click.elapsed().as_secs_f64();
    run.send(Command::View { frame: view });
    run.label(labels, generation);
    wait_for_map(run, view, generation)?;
    if let Some(map) = run.map(view) {
        // A map's pixels are looked up when they are read.
        std::hint::black_box(map.labels());
    }
    let in_view = milliseconds();
    run.mapped(generation)?;
    Ok((in_view, milliseconds()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_values_that_were_measured() {
        let values = (1..=40).rev().map(f64::from).collect();
        let percentiles = Percentiles::of(values).unwrap();
        let told = [percentiles.p50, percentiles.p95, percentiles.p99];
        assert_eq!(told, [20.0, 38.0, 40.0]);
        assert_eq!(Percentiles::of(vec![7.0]).unwrap().p50, 7.0);
        assert_eq!(Percentiles::of(Vec::new()), None);
    }
}
