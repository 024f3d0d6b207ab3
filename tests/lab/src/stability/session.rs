//! What happens to the session itself: it is paused and resumed without end, dies, or trains for hours.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::time::{Duration, Instant};

use rand::{Rng, rngs::SmallRng};

use super::edits::{maps, same};
use super::trial::{Measured, Settings, Trial};
use super::{Condition, Line, Way};
use crate::EvalError;
use inplace_core::export::resident_memory;
use inplace_core::session::{ClientError, Command};

/// Pauses and resumes of the storm.
const PAUSES: usize = 500;

pub(super) fn conditions() -> Vec<Condition> {
    vec![
        Condition::new(
            "pause-storm",
            "500 pauses and resumes at random moments: mIoU as a share of that without them",
            "answers commands between two steps",
            Line::Least(0.98),
            Way::Course(pause_storm),
        )
        .in_short(),
        Condition::new(
            "worker-dies",
            "the worker panics, and another one goes on: share of pixels as before",
            "tells of it, and starts another worker from the last saved model with all labels",
            Line::Least(1.0),
            Way::Course(worker_dies),
        )
        .in_short(),
        Condition::new(
            "long-training",
            "training goes on long after it has settled: the lesser of mIoU and free memory as shares of those before",
            "stops by itself; settled parts are not trained on",
            Line::Least(0.9),
            Way::Course(long_training),
        ),
    ]
}

fn pause_storm(trial: &Trial, settings: &Settings, rng: &mut SmallRng) -> Result<Measured, EvalError> {
    let mut calm = trial.session(settings);
    calm.settle(trial.seconds(settings))?;
    let expected = trial.miou(&calm)?;
    drop(calm);
    let mut course = trial.session(settings);
    for _ in 0..PAUSES {
        course.run.send(Command::Pause);
        std::thread::sleep(Duration::from_micros(rng.random_range(0..4000)));
        course.run.send(Command::Resume);
        std::thread::sleep(Duration::from_micros(rng.random_range(0..4000)));
    }
    course.settle(trial.seconds(settings))?;
    Ok((trial.miou(&course)? / expected, course.told()))
}

fn worker_dies(trial: &Trial, settings: &Settings, _: &mut SmallRng) -> Result<Measured, EvalError> {
    let frames = trial.scene.frames.len();
    let dies = Arc::new(AtomicBool::new(false));
    let death = Arc::clone(&dies);
    // Whoever follows a session is woken on the worker's thread.
    let wake = move || assert!(!death.swap(false, Relaxed), "a panic was asked for");
    let mut course = trial.session_woken(settings, None, wake);
    course.settle(trial.seconds(settings))?;
    course.run.send(Command::Pause);
    course.say(&trial.labels);
    let before = maps(&mut course, frames)?;
    let state = course.run.saved()?;
    dies.store(true, Relaxed);
    course.run.send(Command::Save);
    let Err(ClientError::Failed(told)) = course.run.wait_until(None, |_| false) else {
        return Err(EvalError::Session("the worker's death was not told".to_owned()));
    };
    drop(course);
    let mut next = trial.session_woken(settings, Some(state), || {});
    next.run.send(Command::Pause);
    next.say(&trial.labels);
    let after = maps(&mut next, frames)?;
    Ok((same(&before, &after), vec![told]))
}

fn long_training(trial: &Trial, settings: &Settings, _: &mut SmallRng) -> Result<Measured, EvalError> {
    let mut course = trial.session(settings);
    course.settle(trial.seconds(settings))?;
    let (miou, memory) = (trial.miou(&course)?, resident_memory());
    course.run.send(Command::Resume);
    let end = Instant::now() + Duration::from_secs_f64(settings.long_seconds);
    let mut generation = 0;
    // A click now and then keeps what follows the labels busy; the last one gives the labels of the beginning.
    while Instant::now() < end {
        let mut labels = trial.labels.clone();
        generation += 1;
        let omitted = labels.strokes.keys().nth(generation % labels.strokes.len());
        if let Some(id) = omitted.copied() {
            labels.strokes.remove(&id);
        }
        course.say(&labels);
        let next = Instant::now() + Duration::from_secs(5);
        course.run.work_until(end.min(next))?;
    }
    course.say(&trial.labels);
    course.settle(trial.seconds(settings))?;
    let kept = trial.miou(&course)? / miou;
    let held = match (memory, resident_memory()) {
        (Some(before), Some(after)) => before as f64 / after.max(1) as f64,
        _ => 1.0,
    };
    Ok((kept.min(held), course.told()))
}
