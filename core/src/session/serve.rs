//! The loop of every worker: handle commands, then do a slice of work.

use std::time::Duration;

use crossbeam_channel::{Receiver, RecvTimeoutError};

use super::Command;
use super::worker::WorkerError;

/// How long a worker sleeps while it waits for a command or for another thread.
const NAP: Duration = Duration::from_millis(20);

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
