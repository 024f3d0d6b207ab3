//! The worker's thread from its start to its end, which is always reported.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use crossbeam_channel::Receiver;

use super::estimating::Estimation;
use super::opening::open;
use super::outbox::Outbox;
use super::serve::{WorkerError, serve};
use super::worker::Worker;
use super::{Command, Event, SessionOptions};
use crate::scene::Scene;

/// Has this thread, and those that it starts from now on, give way to others. On Linux alone: elsewhere threads do not
/// inherit priorities.
pub(super) fn give_way() {
    /// A thread of the usual priority gets about nine times as much of a core.
    #[cfg(target_os = "linux")]
    const NICE: i32 = 10;
    #[cfg(target_os = "linux")]
    if let Err(error) = rustix::process::nice(NICE) {
        tracing::warn!(%error, "training does not give way to the window");
    }
}

/// Runs until a command says stop, on `scene` or else on the options' source; errors, panics and the end become events.
pub(super) fn run(
    options: SessionOptions,
    scene: Option<Arc<Scene>>,
    commands: &Receiver<Command>,
    outbox: &Outbox,
) {
    guarded(outbox, || {
        let threads = rayon::ThreadPoolBuilder::new()
            .num_threads(options.threads.max(1))
            .thread_name(|index| format!("inplace-pool-{index}"))
            .build()
            .map_err(|error| {
                WorkerError::Other(format!("the training threads could not be started: {error}"))
            })?;
        let threads = Arc::new(threads);
        let (scene, mut early) = match scene {
            Some(scene) => {
                outbox.reset_maps(scene.frames.len());
                (scene, Vec::new())
            }
            None => match open(&options, commands, outbox, &threads)? {
                Some(opened) => opened,
                None => return Ok(()),
            },
        };
        let is_new = options.state.as_ref().is_none_or(|state| state.model.steps == 0);
        let with_first = options.first_look && is_new;
        let estimation = (!scene.has_depth())
            .then(|| Estimation::start(Arc::clone(&scene), with_first, outbox, options.threads.max(1)));
        let estimated = match &estimation {
            None => scene.into(),
            Some(estimation) => match estimation.next(commands, &mut early)? {
                Some(estimated) => estimated,
                None => return Ok(()),
            },
        };
        outbox.send(Event::Opened(Arc::clone(&estimated.scene)));
        let estimation = estimation.filter(|_| !estimated.is_all);
        threads.install(|| {
            let mut worker = Worker::new(estimated, estimation, &options, outbox)?;
            serve(&mut worker, early, commands)
        })
    });
}

/// Does the work and turns an error or a panic, and the end, into events.
fn guarded(outbox: &Outbox, work: impl FnOnce() -> Result<(), WorkerError>) {
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(Ok(())) => {}
        Ok(Err(error)) => outbox.send(Event::Error(error.to_string())),
        Err(panic) => outbox.send(Event::Error(format!(
            "training stopped by an internal error ({}); your labels are safe, open the scene again to go on",
            panic_message(panic.as_ref())
        ))),
    }
    outbox.send(Event::Stopped);
}

fn panic_message(panic: &(dyn Any + Send)) -> &str {
    panic
        .downcast_ref::<&str>()
        .copied()
        .or_else(|| panic.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("no message")
}
