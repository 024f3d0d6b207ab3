//! What the workers share: the loop that handles commands between slices of work, and their errors.

use std::collections::HashMap;
use std::time::{Duration, Instant};

use candle_core::Tensor;
use crossbeam_channel::{Receiver, RecvTimeoutError};

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

/// Work that is done in slices, so that commands are handled in between.
pub(super) trait WorkerTask {
    /// Carries out a command; `false` = stop.
    fn handle(&mut self, command: Command) -> Result<bool, WorkerError>;

    /// Reports the status.
    fn report_status(&mut self);

    /// Does a slice of work; `false` when there was nothing to do.
    fn advance(&mut self) -> Result<bool, WorkerError>;
}

/// Handles the early commands, then works and handles commands until one says stop or all senders are gone.
pub(super) fn serve(
    task: &mut impl WorkerTask,
    early: Vec<Command>,
    commands: &Receiver<Command>,
) -> Result<(), WorkerError> {
    for command in early {
        if !task.handle(command)? {
            return Ok(());
        }
    }
    task.report_status();
    loop {
        while let Ok(command) = commands.try_recv() {
            if !task.handle(command)? {
                return Ok(());
            }
        }
        if task.advance()? {
            continue;
        }
        match commands.recv_timeout(NAP) {
            Ok(command) => {
                if !task.handle(command)? {
                    return Ok(());
                }
            }
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
