//! Following a session from opening the scene to the final maps.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::{Duration, Instant};

use inplace_core::arguments::TrainingArguments;
use inplace_core::labels::LabelSet;
use inplace_core::project::{Contents, ProjectError};
use inplace_core::scene::{OpenOptions, Scene};
use inplace_core::semantics::Surface;
use inplace_core::session::{
    Client, ClientError, Command, Event, FrameMap, Phase, Progress, Saved, Session, SessionOptions, Status,
};

use super::budget::Budget;

/// Generation of the labels: they never change here.
pub(super) const GENERATION: u64 = 1;
/// How often deadlines are looked at.
const TICK: Duration = Duration::from_millis(50);

/// The options of a session of a project, which goes on with its model, or takes that as it is where no views are rendered.
pub(super) fn of_project(contents: &Contents, training: &TrainingArguments, views: bool) -> SessionOptions {
    let mut session = training.session_options(contents.scene.source.clone());
    session.open.depth &= contents.scene.depth;
    session.views = views;
    session.state = contents.model.clone().map(|model| Saved {
        model,
        is_final: !views,
    });
    session
}

/// The contents of a project fitted to its scene; warnings about both are told.
pub(super) fn matched(
    contents: Contents,
    scene: &Scene,
    open: OpenOptions,
) -> Result<Contents, ProjectError> {
    let contents = contents.matched(scene, open)?;
    for warning in contents.warnings.iter().chain(&scene.warnings) {
        eprintln!("inplace: {warning}");
    }
    Ok(contents)
}

/// Starts a session that tells on stderr how it goes.
pub(super) fn start(options: SessionOptions, progress: &Arc<Progress>) -> Client {
    let progress = Arc::clone(progress);
    progress.show("opening the scene");
    Client::observing(Session::start(options, || {}), move |event| match event {
        Event::Opening { done, total } => {
            progress.show_share("reading frames", *done as f32 / *total as f32);
        }
        Event::Estimating { share } => progress.show_share("estimating depth", *share),
        Event::Status(status) => progress.show(describe(status)),
        Event::Warning(sentence) => eprintln!("inplace: {sentence}"),
        _ => {}
    })
}

/// What an export tells of the frames that it has written.
pub(super) fn writing(progress: &Progress) -> impl Fn(usize, usize) -> ControlFlow<()> + Sync {
    |done, total| {
        progress.show_share("writing", done as f32 / total as f32);
        ControlFlow::Continue(())
    }
}

/// Waits for what is told first of the work on an opened scene, and returns it.
pub(super) fn first_status(client: &mut Client) -> Result<Status, ClientError> {
    loop {
        if let Some(Event::Status(status)) = client.next(None)? {
            return Ok(status);
        }
    }
}

/// Waits for the first surface, and returns it.
pub(super) fn surface(client: &mut Client) -> Result<Arc<Surface>, ClientError> {
    loop {
        if let Some(surface) = client.surface() {
            return Ok(surface);
        }
        client.next(None)?;
    }
}

/// Waits until the maps are final, and returns them.
pub(super) fn maps(client: &mut Client) -> Result<Vec<Arc<FrameMap>>, ClientError> {
    loop {
        if client.status().is_final(GENERATION)
            && let Some(maps) = client.all_maps(GENERATION)
        {
            return Ok(maps);
        }
        client.next(None)?;
    }
}

/// Waits until the maps are final, or for as long as the budget allows, and returns them. `start` is when the command
/// began. Where the budget will hardly be kept, a sentence on stderr says so. Imported images come into the maps later than
/// strokes; maps without them are none of these labels, however little time is left.
///
/// Where depth was measured there is a surface without training. Training waits for its maps then, because nothing can
/// be written without them.
pub(super) fn maps_within(
    client: &mut Client,
    (scene, labels): (&Scene, &LabelSet),
    budget: &mut Budget,
    start: Instant,
) -> Result<Vec<Arc<FrameMap>>, ClientError> {
    let opening = start.elapsed().as_secs_f64();
    let mut keyframes = scene.frames.iter().filter(|frame| frame.is_keyframe());
    let mut is_waiting = keyframes.any(|frame| frame.depth_coverage().is_some_and(|share| share > 0.0));
    let mut has_maps = false;
    let all_maps = |client: &Client| {
        let maps = client.all_maps(GENERATION);
        maps.filter(|maps| maps.iter().all(|map| map.has_import_of(labels)))
    };
    if is_waiting {
        client.send(Command::Pause);
    }
    let mut settling = false;
    loop {
        let event = client.next(Some(Instant::now() + TICK))?;
        let elapsed = start.elapsed().as_secs_f64();
        let of_all = |event| matches!(event, Event::AllMaps { generation } if generation == GENERATION);
        if !has_maps && event.is_some_and(of_all) && all_maps(client).is_some() {
            has_maps = true;
            if let Some(problem) = budget.problem(opening, elapsed, scene.frames.len()) {
                eprintln!("inplace: {problem}");
            }
            if std::mem::take(&mut is_waiting) {
                client.send(Command::Resume);
            }
        }
        if let Some(seconds) = client.status().seconds_to_settle {
            budget.looked(seconds);
        }
        if !settling && elapsed >= budget.settle_at() {
            settling = true;
            if std::mem::take(&mut is_waiting) {
                client.send(Command::Resume);
            }
            client.send(Command::Settle);
        }
        // While it pauses, it may still report that earlier work is final.
        let status = client.status();
        let is_final = status.phase != Phase::Paused && status.is_final(GENERATION);
        if (is_final || elapsed >= budget.write_at())
            && let Some(maps) = all_maps(client)
        {
            return Ok(maps);
        }
    }
}

fn describe(status: &Status) -> String {
    let psnr = status
        .held_out_psnr
        .map_or(String::new(), |psnr| format!(", {psnr:.1} dB"));
    let entropy = status
        .mean_entropy
        .map_or(String::new(), |entropy| format!(", entropy {entropy:.2}"));
    let doing = match status.phase {
        Phase::Opening | Phase::FindingSurface => "finding the surface",
        Phase::Estimating { .. } => "estimating depth",
        Phase::Training | Phase::Paused if status.finding_features => "finding look-alikes",
        Phase::Training | Phase::Paused => "training",
    };
    format!("{doing}: step {}{psnr}{entropy}", status.steps)
}
