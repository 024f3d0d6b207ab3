//! What every worker does between its pieces of work: it listens.

use std::time::Duration;

use crossbeam_channel::{Receiver, RecvTimeoutError};

use super::Command;
use super::worker::WorkerError;

/// How long a worker sleeps when there is nothing to do but to wait for a command or for another thread.
const NAP: Duration = Duration::from_millis(20);

/// Work that is done a piece at a time, so that commands are heard in between.
pub(super) trait Task {
    /// Does what a command says; `false` = stop.
    fn obey(&mut self, command: Command) -> Result<bool, WorkerError>;

    /// Tells how it goes.
    fn tell_status(&mut self);

    /// Does a piece of work; `false` when there was nothing to do.
    fn advance(&mut self) -> Result<bool, WorkerError>;
}

/// Obeys the early commands, then works and obeys until it is told to stop or nobody can tell any more.
pub(super) fn serve(
    task: &mut impl Task,
    early: Vec<Command>,
    commands: &Receiver<Command>,
) -> Result<(), WorkerError> {
    for command in early {
        if !task.obey(command)? {
            return Ok(());
        }
    }
    task.tell_status();
    loop {
        while let Ok(command) = commands.try_recv() {
            if !task.obey(command)? {
                return Ok(());
            }
        }
        if task.advance()? {
            continue;
        }
        match commands.recv_timeout(NAP) {
            Ok(command) => {
                if !task.obey(command)? {
                    return Ok(());
                }
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return Ok(()),
        }
    }
}
