//! Opening a scene in the background.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, select};

use super::background::Background;
use super::outbox::Outbox;
use super::serve::WorkerError;
use super::{Command, Event, SessionOptions};
use crate::scene::Scene;

/// Time between two reports of progress: each has the window drawn anew.
const EVERY: Duration = Duration::from_millis(150);

/// An open scene, and the commands that arrived in the meantime.
pub(super) type OpenedScene = (Arc<Scene>, Vec<Command>);

/// Opens the scene on a thread of its own, so that it can be stopped; `None` when it was. On return there is a map slot
/// for each frame: for the listed ones since they were, unless the opened scene has others.
pub(super) fn open(
    options: &SessionOptions,
    commands: &Receiver<Command>,
    outbox: &Outbox,
    threads: &Arc<rayon::ThreadPool>,
) -> Result<Option<OpenedScene>, WorkerError> {
    let (source, what) = (options.source.clone(), options.open);
    let (outbox, threads) = (outbox.clone(), Arc::clone(threads));
    let read = move |stopped: &AtomicBool| {
        let told = Told::default();
        let tell = |done, total| {
            told.now_and_then(done == total, || outbox.send(Event::Opening { done, total }));
            !stopped.load(Ordering::Relaxed)
        };
        let listed = OnceLock::new();
        let list = |scene: Scene| {
            let scene = listed.get_or_init(|| Arc::new(scene));
            outbox.reset_maps(scene.frames.len());
            outbox.send(Event::Listed(Arc::clone(scene)));
        };
        let scene = threads.install(|| Scene::open_listed(&source, what, &list, &tell));
        if let Ok(scene) = &scene
            && listed.get().is_none_or(|listed| !scene.has_frames_of(listed))
        {
            outbox.reset_maps(scene.frames.len());
        }
        scene
    };
    let mut early = Vec::new();
    let failed = format!("{}: the scene could not be opened", options.source);
    // It is about no labels, and told to stop when this ends.
    let reading = Background::start("inplace-open", 1, 0, move |stopped| Some(read(stopped)));
    match wait_for(&reading.answer, &failed, commands, &mut early)?.flatten() {
        Some(scene) => Ok(Some((Arc::new(scene?), early))),
        None => Ok(None),
    }
}

/// Waits for the next answer of work that is under way and keeps the commands that arrive in the meantime; `None` as soon
/// as one of them says stop. Where there is no thread, or the work panics, the sentence `failed` is the error.
pub(super) fn wait_for<T>(
    answers: &Receiver<T>,
    failed: &str,
    commands: &Receiver<Command>,
    early: &mut Vec<Command>,
) -> Result<Option<T>, WorkerError> {
    loop {
        select! {
            recv(commands) -> command => match command {
                Ok(Command::Stop) | Err(_) => return Ok(None),
                Ok(command) => early.push(command),
            },
            recv(answers) -> answer => return answer.map(Some).map_err(|_| stopped(failed)),
        }
    }
}

/// Work ended without an answer; the sentence `failed` says what it was.
pub(super) fn stopped(failed: &str) -> WorkerError {
    WorkerError::Other(format!("{failed}: an internal error stopped it"))
}

/// When progress was reported last, from any thread.
#[derive(Default)]
pub(super) struct Told(Mutex<Option<Instant>>);

impl Told {
    /// Reports unless that was done lately; the last report is always made.
    pub(super) fn now_and_then(&self, is_last: bool, report: impl FnOnce()) {
        let mut told = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if is_last || told.is_none_or(|told| told.elapsed() >= EVERY) {
            *told = Some(Instant::now());
            report();
        }
    }
}
