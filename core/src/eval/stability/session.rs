//! What happens to the session itself: it is paused and resumed without end, dies, or trains for hours.

use std::time::{Duration, Instant};

use rand::{Rng, rngs::SmallRng};

use super::edits::{maps, same};
use super::trial::{Measured, Settings, Trial};
use super::{Condition, Line};
use crate::eval::EvalError;
use crate::export::resident_memory;
use crate::session::{Command, Event};

/// Pauses and resumes of the storm.
const PAUSES: usize = 500;

pub(super) fn conditions() -> Vec<Condition> {
    vec![
        Condition::course(
            "pause-storm",
            "500 pauses and resumes at random moments: mIoU as a share of that without them",
            "answers commands between two steps",
            Line::Least(0.98),
            pause_storm,
        )
        .in_short(),
        Condition::course(
            "worker-dies",
            "the worker panics, and another one goes on: share of pixels as before",
            "tells of it, and starts another worker from the last saved model with all labels",
            Line::Least(1.0),
            worker_dies,
        )
        .in_short(),
        Condition::course(
            "long-training",
            "training goes on long after it has settled: the lesser of mIoU and free memory as shares of those before",
            "stops by itself; settled parts are not taught on",
            Line::Least(0.9),
            long_training,
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
        course.run.session.send(Command::Pause);
        std::thread::sleep(Duration::from_micros(rng.random_range(0..4000)));
        course.run.session.send(Command::Resume);
        std::thread::sleep(Duration::from_micros(rng.random_range(0..4000)));
    }
    course.settle(trial.seconds(settings))?;
    Ok(Measured {
        figure: trial.miou(&course)? / expected,
        told: course.told,
    })
}

fn worker_dies(trial: &Trial, settings: &Settings, _: &mut SmallRng) -> Result<Measured, EvalError> {
    let frames = trial.scene.frames.len();
    let mut course = trial.session(settings);
    course.settle(trial.seconds(settings))?;
    course.run.session.send(Command::Pause);
    course.say(&trial.labels);
    let before = maps(&mut course, frames)?;
    let state = course.run.saved()?;
    course.run.session.send(Command::Panic);
    let told = loop {
        match course.run.session.events().recv_timeout(Duration::from_secs(60)) {
            Ok(Event::Error(reason)) => break reason,
            Ok(_) => {}
            Err(error) => {
                return Err(EvalError::Session(format!(
                    "the worker's death was not told: {error}"
                )));
            }
        }
    };
    drop(course);
    let mut next = trial.session_from(settings, Some(state));
    next.run.session.send(Command::Pause);
    next.say(&trial.labels);
    let after = maps(&mut next, frames)?;
    Ok(Measured {
        figure: same(&before, &after),
        told: vec![told],
    })
}

fn long_training(trial: &Trial, settings: &Settings, _: &mut SmallRng) -> Result<Measured, EvalError> {
    let mut course = trial.session(settings);
    course.settle(trial.seconds(settings))?;
    let (miou, memory) = (trial.miou(&course)?, resident_memory());
    course.run.session.send(Command::Resume);
    let end = Instant::now() + Duration::from_secs_f64(settings.long_seconds);
    let mut generation = 0;
    // A click now and then keeps what follows the labels busy; the last one gives the labels of the beginning.
    while Instant::now() < end {
        let mut labels = trial.labels.clone();
        generation += 1;
        if let Some(id) = labels
            .strokes
            .keys()
            .nth(generation % labels.strokes.len())
            .copied()
        {
            labels.strokes.remove(&id);
        }
        course.say(&labels);
        course
            .run
            .follow_until(Some(end.min(Instant::now() + Duration::from_secs(5))), |_, _| {
                false
            })?;
    }
    course.say(&trial.labels);
    course.settle(trial.seconds(settings))?;
    let kept = trial.miou(&course)? / miou;
    let held = match (memory, resident_memory()) {
        (Some(before), Some(after)) => before as f64 / after.max(1) as f64,
        _ => 1.0,
    };
    Ok(Measured {
        figure: kept.min(held),
        told: course.told,
    })
}
