//! What happens to the session itself: many edits, also of classes, while it follows them; it is paused and resumed
//! without end, dies, or trains for hours.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::time::{Duration, Instant};

use rand::rngs::SmallRng;
use rand::seq::IndexedRandom;
use rand::{Rng, RngCore};

use super::trial::{Course, Measured, Trial};
use super::{Condition, Line, Settings, Way};
use crate::Failure;
use inplace_core::export::resident_memory;
use inplace_core::labels::{ClassId, History, LabelSet, Stroke};
use inplace_core::session::{ClientError, Command};

/// Edits of the storm.
const EDITS: usize = 10_000;
/// The session is told of one edit in so many, as a person's newer edits replace those that it has not seen.
const TOLD: usize = 25;
/// Pauses and resumes of the storm.
const PAUSES: usize = 500;

pub(super) fn conditions() -> Vec<Condition> {
    vec![
        Condition::new(
            "edits-classes",
            "classes are added, merged and deleted in the middle: share of pixels as labelled anew in the end",
            "updates distances exactly as labels come and go",
            Line::Least(0.999),
            Way::Course(classes_change),
        )
        .in_short(),
        Condition::new(
            "edits-storm",
            "10,000 random edits, undos and redos, all undone in the end: share of pixels as before",
            "updates distances exactly; undo gives the labels of before, bit by bit",
            Line::Least(1.0),
            Way::Course(edit_storm),
        ),
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

/// Share of the pixels that have the same class in both.
pub(super) fn same(a: &[Vec<ClassId>], b: &[Vec<ClassId>]) -> f64 {
    let (mut same, mut all) = (0, 0);
    for (a, b) in a.iter().zip(b) {
        same += a.iter().zip(b).filter(|(a, b)| a == b).count();
        all += a.len().max(b.len());
    }
    same as f64 / all.max(1) as f64
}

/// A session that rests: the maps follow the labels and nothing else.
pub(super) fn resting(trial: &Trial, settings: &Settings, labels: &LabelSet) -> Result<Course, Failure> {
    let mut course = trial.session(settings);
    course.settle(trial.seconds(settings))?;
    course.run.send(Command::Pause);
    course.say(labels);
    Ok(course)
}

fn classes_change(trial: &Trial, settings: &Settings, rng: &mut SmallRng) -> Result<Measured, Failure> {
    let mut course = resting(trial, settings, &trial.labels)?;
    let mut history = History::new(trial.labels.clone());
    let classes = trial.truth.classes();
    let strokes: Vec<_> = trial.labels.strokes.values().cloned().collect();
    for round in 0..5 {
        let (added, _) = history.add_class(&format!("added {round}"));
        if let Some(stroke) = strokes.choose(rng) {
            history.add_stroke(Stroke {
                class: added,
                object: None,
                ..stroke.as_ref().clone()
            });
        }
        course.say(history.labels());
        course.maps()?;
        if let (Some(&from), Some(&into)) = (classes.choose(rng), classes.choose(rng)) {
            history.merge_class(from, into);
        }
        course.say(history.labels());
        if round % 2 == 0 {
            history.delete_class(added);
        } else {
            history.undo();
        }
        course.say(history.labels());
    }
    let changed = course.maps()?;
    let mut anew = resting(trial, settings, history.labels())?;
    let figure = same(&changed, &anew.maps()?);
    Ok((figure, course.told()))
}

fn edit_storm(trial: &Trial, settings: &Settings, rng: &mut SmallRng) -> Result<Measured, Failure> {
    let frames = trial.scene.frames.len();
    let mut course = resting(trial, settings, &trial.labels)?;
    let before = course.maps()?;
    let mut history = History::new(trial.labels.clone());
    let classes = trial.truth.classes();
    for edit in 0..EDITS {
        let frame = rng.random_range(0..frames);
        let camera = &trial.scene.frames[frame].camera;
        let point = [camera.width, camera.height].map(|size| rng.random_range(0..size));
        match rng.next_u32() % 10 {
            0..=4 => {
                let class = classes.choose(rng).copied().unwrap_or_default();
                let mut stroke = Stroke::click(frame, class, point);
                stroke.radius = rng.random_range(0..6);
                history.add_stroke(stroke);
            }
            5 => {
                history.erase_where(frame, &[point], 20, |_| true);
            }
            6..=7 => {
                history.undo();
            }
            8 => {
                history.redo();
            }
            _ => {
                let (class, _) = history.add_class(&format!("class of edit {edit}"));
                history.delete_class(class);
            }
        }
        if edit % TOLD == 0 {
            course.say(history.labels());
        }
    }
    while history.undo().is_some() {}
    course.say(history.labels());
    let after = course.maps()?;
    Ok((same(&before, &after), course.told()))
}

fn pause_storm(trial: &Trial, settings: &Settings, rng: &mut SmallRng) -> Result<Measured, Failure> {
    let mut calm = trial.training_session(settings, None, || {});
    calm.settle(trial.seconds(settings))?;
    let expected = trial.miou(&calm)?;
    drop(calm);
    let mut course = trial.training_session(settings, None, || {});
    for _ in 0..PAUSES {
        course.run.send(Command::Pause);
        std::thread::sleep(Duration::from_micros(rng.random_range(0..4000)));
        course.run.send(Command::Resume);
        std::thread::sleep(Duration::from_micros(rng.random_range(0..4000)));
    }
    course.settle(trial.seconds(settings))?;
    course.has_trained()?;
    Ok((trial.miou(&course)? / expected, course.told()))
}

fn worker_dies(trial: &Trial, settings: &Settings, _: &mut SmallRng) -> Result<Measured, Failure> {
    let dies = Arc::new(AtomicBool::new(false));
    let death = Arc::clone(&dies);
    // Whoever follows a session is woken on the worker's thread.
    let wake = move || assert!(!death.swap(false, Relaxed), "a panic was asked for");
    let mut course = trial.training_session(settings, None, wake);
    course.settle(trial.seconds(settings))?;
    course.run.send(Command::Pause);
    course.say(&trial.labels);
    let before = course.maps()?;
    course.has_trained()?;
    let state = course.run.saved()?;
    dies.store(true, Relaxed);
    course.run.send(Command::Save);
    let Err(ClientError::Failed(told)) = course.run.wait_until(None, |_| false) else {
        return Err("the worker's death was not told".into());
    };
    drop(course);
    let mut next = trial.training_session(settings, Some(state), || {});
    next.run.send(Command::Pause);
    next.say(&trial.labels);
    let after = next.maps()?;
    Ok((same(&before, &after), vec![told]))
}

fn long_training(trial: &Trial, settings: &Settings, _: &mut SmallRng) -> Result<Measured, Failure> {
    let mut course = trial.training_session(settings, None, || {});
    course.settle(trial.seconds(settings))?;
    let (miou, memory) = (trial.miou(&course)?, resident_memory());
    course.run.send(Command::Resume);
    let end = Instant::now() + Duration::from_secs_f64(settings.long_seconds);
    let mut generation = 0;
    // A click now and then keeps what follows the labels busy; the last one gives the labels of the beginning.
    while Instant::now() < end {
        let mut labels = trial.labels.clone();
        generation += 1;
        let omitted = labels
            .strokes
            .keys()
            .nth(generation % labels.strokes.len().max(1));
        if let Some(id) = omitted.copied() {
            labels.strokes.remove(&id);
        }
        course.say(&labels);
        let next = Instant::now() + Duration::from_secs(5);
        course.run.work_until(end.min(next))?;
    }
    course.say(&trial.labels);
    course.settle(trial.seconds(settings))?;
    course.has_trained()?;
    let kept = trial.miou(&course)? / miou;
    let held = match (memory, resident_memory()) {
        (Some(before), Some(after)) => before as f64 / after.max(1) as f64,
        _ => 1.0,
    };
    Ok((kept.min(held), course.told()))
}
