//! Opening a scene in the background.

use std::sync::Arc;

use crossbeam_channel::{Receiver, bounded, select};

use super::outbox::Outbox;
use super::serve::WorkerError;
use super::{Command, Event, SessionOptions};
use crate::scene::Scene;

/// An open scene, and the commands that arrived in the meantime.
pub(super) type OpenedScene = (Arc<Scene>, Vec<Command>);

/// Opens the scene on a thread of its own, so that it can be stopped; `None` when it was.
pub(super) fn open(
    options: &SessionOptions,
    commands: &Receiver<Command>,
    outbox: &Outbox,
    threads: &Arc<rayon::ThreadPool>,
) -> Result<Option<OpenedScene>, WorkerError> {
    let (sender, opened) = bounded(1);
    let (source, what) = (options.source.clone(), options.open);
    let (progress, threads) = (outbox.clone(), Arc::clone(threads));
    let thread = std::thread::Builder::new().name("inplace-open".to_owned());
    let spawned = thread.spawn(move || {
        let tell = |done, total| progress.send(Event::Opening { done, total });
        let scene = threads.install(|| Scene::open(&source, what, &tell));
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
