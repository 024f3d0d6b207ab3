//! The published network in a session, for a given time.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::Task;
use crate::EvalError;
use inplace_core::field::Preset;
use inplace_core::labels::{ClassId, LabelSet};
use inplace_core::scene::Scene;
use inplace_core::session::{Client, Command, SessionOptions};

/// Share of the time in which it trains; then it renders, as a ray takes milliseconds.
const TRAINING: f64 = 0.5;
const GENERATION: u64 = 1;

/// The maps of the task's frames when its time is over; the coarsest ones always come.
pub(super) fn maps(task: &Task<'_>) -> Result<Vec<Vec<ClassId>>, EvalError> {
    let (run, _) = course(task.options, &task.labels, task.wall)?;
    let map = |&frame: &usize| {
        let map = run.map(frame);
        map.map_or_else(Vec::new, |map| map.labels().into_owned())
    };
    Ok(task.frames.iter().map(map).collect())
}

/// Its session when so much wall time is over, with the scene that it opened; later where the coarsest maps take longer.
pub(crate) fn course(
    options: &SessionOptions,
    labels: &LabelSet,
    wall: Duration,
) -> Result<(Client, Arc<Scene>), EvalError> {
    let start = Instant::now();
    let mut run = Client::start(SessionOptions {
        preset: Preset::Reference,
        views: false,
        state: None,
        ..options.clone()
    });
    let scene = run.opened()?;
    run.label(labels.clone(), GENERATION);
    let trained = start + wall.mul_f64(TRAINING);
    if !run.settled(GENERATION, Some(trained))? {
        run.send(Command::Settle);
        run.mapped(GENERATION)?;
        // What there is when the time is over.
        run.settled(GENERATION, Some(start + wall))?;
    }
    Ok((run, scene))
}
