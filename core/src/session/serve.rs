//! The loop that handles commands between slices of work, and the worker's errors.

use std::collections::HashMap;
use std::time::{Duration, Instant};

use candle_core::Tensor;
use crossbeam_channel::{Receiver, RecvTimeoutError};

use super::worker::Worker;
use super::{Command, ModelState};
use crate::field::FieldError;
use crate::scene::SceneError;

/// How long a worker sleeps while it waits for a command or for another thread.
const NAP: Duration = Duration::from_millis(20);

/// Why the worker ended early.
#[derive(Debug, thiserror::Error)]
pub(super) enum WorkerError {
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error(transparent)]
    Field(#[from] FieldError),
    #[error("{0}")]
    Other(String),
}

impl From<candle_core::Error> for WorkerError {
    fn from(error: candle_core::Error) -> Self {
        Self::Field(error.into())
    }
}

/// Handles the early commands, then works and handles commands until one says stop or all senders are gone. Of several
/// label sets that wait the newest alone is followed: a key that is held down must not leave a queue behind.
pub(super) fn serve(
    worker: &mut Worker<'_>,
    early: Vec<Command>,
    commands: &Receiver<Command>,
) -> Result<(), WorkerError> {
    let is_labels = |command: &Command| matches!(command, Command::Labels { .. });
    let mut waiting = early;
    worker.report_status();
    loop {
        waiting.extend(commands.try_iter());
        let newest = waiting.iter().rposition(is_labels);
        let is_idle = waiting.is_empty();
        for (number, command) in waiting.drain(..).enumerate() {
            let is_outdated = is_labels(&command) && Some(number) != newest;
            if !is_outdated && !worker.handle(command)? {
                return Ok(());
            }
        }
        if !is_idle || worker.advance()? {
            continue;
        }
        match commands.recv_timeout(NAP) {
            Ok(command) => waiting.push(command),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return Ok(()),
        }
    }
}

/// Adds the time that `work` takes to `seconds`.
pub(super) fn timed<T>(seconds: &mut f64, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = work();
    *seconds += start.elapsed().as_secs_f64();
    result
}

/// A model state of these tensors after this many steps.
pub(super) fn saved(tensors: &HashMap<String, Tensor>, steps: u64) -> Result<ModelState, WorkerError> {
    let tensors = safetensors::serialize(tensors, None)
        .map_err(|error| WorkerError::Other(format!("the model could not be saved: {error}")))?;
    Ok(ModelState { steps, tensors })
}
