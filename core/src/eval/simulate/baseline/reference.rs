//! The published network in a session, for a given time.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::Task;
use crate::eval::EvalError;
use crate::eval::followed::{Followed, is_settled};
use crate::field::Preset;
use crate::labels::{ClassId, LabelSet};
use crate::scene::Scene;
use crate::session::{Command, Event, SessionOptions};

/// Share of the time in which it trains; then it renders, as a ray takes milliseconds.
const TRAINING: f64 = 0.5;
const GENERATION: u64 = 1;

/// The maps of the task's frames when its time is over; the coarsest ones always come.
pub(super) fn maps(task: &Task<'_>) -> Result<Vec<Vec<ClassId>>, EvalError> {
    let (run, _) = course(task.options, &task.labels, task.wall)?;
    let map = |&frame: &usize| run.session.maps().get(frame);
    Ok(task
        .frames
        .iter()
        .map(|frame| map(frame).map_or_else(Vec::new, |map| map.labels().into_owned()))
        .collect())
}

/// Its session when so much wall time is over, with the scene that it opened; later where the coarsest maps take longer.
pub(in crate::eval) fn course(
    options: &SessionOptions,
    labels: &LabelSet,
    wall: Duration,
) -> Result<(Followed, Arc<Scene>), EvalError> {
    let start = Instant::now();
    let mut run = Followed::start(SessionOptions {
        preset: Preset::Reference,
        state: None,
        ..options.clone()
    });
    let scene = run.opened()?;
    run.session.send(Command::Labels {
        labels: labels.clone(),
        generation: GENERATION,
    });
    let trained = start + wall.mul_f64(TRAINING);
    let settled = |event: &Event, status: &_| is_settled(event, status, GENERATION);
    if !run.follow_until(Some(trained), settled)? {
        run.session.send(Command::Settle);
        run.follow(|event, _| matches!(event, Event::AllMaps { .. }))?;
        // What there is when the time is over.
        run.follow_until(Some(start + wall), settled)?;
    }
    Ok((run, scene))
}
