//! `inplace-lab bench latency`: how long a click waits for its maps while the session trains.

use std::time::{Duration, Instant};

use rand::{Rng, SeedableRng, rngs::SmallRng};
use serde::Serialize;

use super::arguments::LatencyArguments;
use super::commands::begin;
use super::learnt::{wait_for_map, wait_for_surface};
use super::page::Page;
use super::simulate::{Annotator, Click, Policy, name_objects};
use super::{Failure, SceneTruth, no_strokes, unusable_scene};
use inplace_core::export::{self, peak_memory};
use inplace_core::labels::LabelSet;
use inplace_core::scene::SceneSource;
use inplace_core::session::{Client, Command, Event, Progress, SessionOptions};

/// How long training goes on between clicks, in milliseconds: random, so that clicks fall on all of its work.
const REST_MS: std::ops::Range<u64> = 50..300;

/// How long clicks waited in one scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Latency {
    /// Name of the scene.
    scene: String,
    /// From the click until the map of the frame in view had been read, in milliseconds.
    in_view_ms: Percentiles,
    /// From the click until every frame had its map, in milliseconds.
    all_frames_ms: Percentiles,
    /// From the click until suggestions that know of it had come, in milliseconds.
    suggestions_ms: Percentiles,
    /// Number of clicks.
    clicks: usize,
    /// Number of frames.
    frames: usize,
    /// Number of classes.
    classes: usize,
    /// Number of objects that strokes named before the first click; then each click named another one.
    objects: usize,
    /// Voxels of the surface at the last click.
    surface_nodes: usize,
    /// Whether depth was read.
    depth: bool,
    /// Threads of the session.
    threads: usize,
    /// Seed of the clicks and of the session.
    seed: u64,
    /// Most memory that the process has taken, where the system tells.
    peak_memory_bytes: Option<u64>,
    /// Sessions that it took: when a field was trained, a new one went on from the same labels.
    sessions: usize,
}

/// Values that so many percent of all do not exceed; the smallest such ones.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Percentiles {
    /// Half of them.
    p50: f64,
    /// 95%.
    p95: f64,
    /// 99%.
    p99: f64,
}

impl Percentiles {
    /// Of some values; `None` without any.
    fn of(mut values: Vec<f64>) -> Option<Self> {
        values.sort_by(f64::total_cmp);
        let rank = |percent: usize| (values.len() * percent).div_ceil(100);
        let at = |percent: usize| values.get(rank(percent).saturating_sub(1)).copied();
        Some(Self {
            p50: at(50)?,
            p95: at(95)?,
            p99: at(99)?,
        })
    }
}

/// Measures every scene, writes `latency.json`, and prints.
pub fn run(arguments: &LatencyArguments) -> Result<(), Failure> {
    let training = &arguments.on.training;
    let out = &arguments.on.output.out;
    begin(out, &arguments.on.scenes)?;
    let mut measured = Vec::new();
    for argument in &arguments.on.scenes {
        let options = training.session_options(SceneSource::from_argument(argument));
        let progress = Progress::default();
        let clicks = (arguments.clicks.into(), arguments.objects.into());
        measured.push(click_latency(&options, clicks, &mut |what| {
            progress.show(format!("{}: {what}", argument.display()));
        })?);
    }
    let result = match measured.as_slice() {
        [one] => serde_json::to_value(one)?,
        several => serde_json::to_value(several)?,
    };
    export::write_json(&out.join("latency.json"), &result)?;
    page(&measured)?.publish(&arguments.on.output, "latency", &result)
}

fn page(measured: &[Latency]) -> Result<Page, Failure> {
    let mut page = Page::default();
    page.paragraph(
        "Milliseconds from a click to the map of the frame in view, to those of all frames, and to the suggestions \
         after it, while the field is being trained: half, 95% and 99% of the clicks wait no longer.",
    );
    page.means(
        measured,
        "scene | frames | in view 50%=in_view_ms.p50:0 | 95%=in_view_ms.p95:0 | 99%=in_view_ms.p99:0 | \
         all frames 50%=all_frames_ms.p50:0 | 95%=all_frames_ms.p95:0 | 99%=all_frames_ms.p99:0 | \
         suggestions 50%=suggestions_ms.p50:0 | 95%=suggestions_ms.p95:0 | 99%=suggestions_ms.p99:0",
    )?;
    Ok(page)
}

/// Lets an annotator who knows the truth click so many random pixels, equally many of every class, each on
/// another frame than the one before, in a session whose field is being trained; waits for all maps of each click.
///
/// # Errors
/// A scene without ground truth or with a single frame to label, and whatever stops a session.
fn click_latency(
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
    run.send(Command::Suggest { only: None });
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
    let (mut in_view, mut all_frames, mut suggestions) = (Vec::new(), Vec::new(), Vec::new());
    let mut sessions = 1;
    for number in 1..=clicks {
        progress(&format!("click {number} of {clicks}"));
        run.work_until(Instant::now() + rest())?;
        if run.status().training_end.is_some() {
            // Not both at a time: they would share the memory and the cores.
            drop(run);
            sessions += 1;
            run = Client::start(options.clone());
            run.opened()?;
            run.send(Command::Suggest { only: None });
            run.label(labels(number - 1), generation(number - 1));
            run.mapped(generation(number - 1))?;
            run.work_until(Instant::now() + rest())?;
        }
        let frame = planned[number - 1].frame;
        let [view, all, suggested] = waited(&mut run, frame, labels(number), generation(number))?;
        in_view.push(view);
        all_frames.push(all);
        suggestions.push(suggested);
    }
    let none = || no_strokes(&scene);
    Ok(Latency {
        scene: scene.name(),
        in_view_ms: Percentiles::of(in_view).ok_or_else(none)?,
        all_frames_ms: Percentiles::of(all_frames).ok_or_else(none)?,
        suggestions_ms: Percentiles::of(suggestions).ok_or_else(none)?,
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

/// So many clicks, equally many of every class, without those on the frame of the click before.
fn on_changing_frames(annotator: &Annotator<'_>, clicks: usize, seed: u64) -> Vec<Click> {
    let rounds = 2 * clicks.div_ceil(annotator.classes().len().max(1));
    let mut planned = annotator.clicks(Policy::Random, rounds, seed);
    planned.dedup_by_key(|click| click.frame);
    planned.truncate(clicks);
    planned
}

/// Milliseconds from a click until the map of its frame has been read, until all maps are there, and until the suggestions
/// that follow them are.
fn waited(run: &mut Client, view: usize, labels: LabelSet, generation: u64) -> Result<[f64; 3], Failure> {
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
    let all = milliseconds();
    run.wait(|event| match event {
        Event::Suggestions { generation: of, .. } => (*of == generation).then_some(()),
        _ => None,
    })?;
    Ok([in_view, all, milliseconds()])
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
