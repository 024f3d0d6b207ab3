//! Opening a scene in the background.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, bounded, select};

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
    let (sender, opened) = bounded(1);
    let (source, what) = (options.source.clone(), options.open);
    let (outbox, threads) = (outbox.clone(), Arc::clone(threads));
    let thread = std::thread::Builder::new().name("inplace-open".to_owned());
    let spawned = thread.spawn(move || {
        let told = Mutex::new(None::<Instant>);
        let tell = |done, total| {
            let mut told = told.lock().unwrap_or_else(PoisonError::into_inner);
            if done == total || told.is_none_or(|told| told.elapsed() >= EVERY) {
                *told = Some(Instant::now());
                outbox.send(Event::Opening { done, total });
            }
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
        // The receiver is gone when the session was stopped.
        let _ = sender.send(scene);
    });
    if let Err(error) = spawned {
        return Err(WorkerError::Other(format!(
            "the scene could not be opened: {error}"
        )));
    }
    let mut early = Vec::new();
    loop {
        select! {
            recv(commands) -> command => match command {
                Ok(Command::Stop) | Err(_) => return Ok(None),
                Ok(command) => early.push(command),
            },
            recv(opened) -> scene => {
                let Ok(scene) = scene else {
                    let reason = format!("{}: an internal error stopped the reading", options.source);
                    return Err(WorkerError::Other(reason));
                };
                return Ok(Some((Arc::new(scene?), early)));
            }
        }
    }
}
