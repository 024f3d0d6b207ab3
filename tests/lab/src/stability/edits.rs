//! Many edits, also of classes, while the session follows them: in the end its maps are those of the labels alone.

use rand::rngs::SmallRng;
use rand::seq::IndexedRandom;
use rand::{Rng, RngCore};

use super::trial::{Course, Measured, Settings, Trial};
use super::{Condition, Line, Way};
use crate::EvalError;
use inplace_core::labels::{ClassId, History, LabelSet, Stroke};
use inplace_core::session::Command;

/// Edits of the storm.
const EDITS: usize = 10_000;
/// The session is told of one edit in so many, as a person's newer edits replace those that it has not seen.
const TOLD: usize = 25;

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
            Way::Course(storm),
        ),
    ]
}

/// Every frame's map, once all follow the newest labels.
pub(super) fn maps(course: &mut Course, frames: usize) -> Result<Vec<Vec<ClassId>>, EvalError> {
    course.all_maps()?;
    let maps = (0..frames).map(|frame| course.run.map(frame));
    let labels = maps.map(|map| map.map_or_else(Vec::new, |map| map.labels().into_owned()));
    Ok(labels.collect())
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
fn resting(trial: &Trial, settings: &Settings, labels: &LabelSet) -> Result<Course, EvalError> {
    let mut course = trial.session(settings);
    course.settle(trial.seconds(settings))?;
    course.run.send(Command::Pause);
    course.say(labels);
    Ok(course)
}

fn classes_change(trial: &Trial, settings: &Settings, rng: &mut SmallRng) -> Result<Measured, EvalError> {
    let mut course = resting(trial, settings, &trial.labels)?;
    let mut history = History::new(trial.labels.clone());
    let classes = trial.truth.classes();
    let strokes: Vec<_> = trial.labels.strokes.values().cloned().collect();
    for round in 0..5 {
        let (added, _) = history.add_class(&format!("added {round}"));
        if let Some(stroke) = strokes.choose(rng) {
            history.add_stroke(Stroke {
                class: added,
                ..stroke.as_ref().clone()
            });
        }
        course.say(history.labels());
        maps(&mut course, trial.scene.frames.len())?;
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
    let frames = trial.scene.frames.len();
    let changed = maps(&mut course, frames)?;
    let mut anew = resting(trial, settings, history.labels())?;
    let figure = same(&changed, &maps(&mut anew, frames)?);
    Ok((figure, course.told()))
}

fn storm(trial: &Trial, settings: &Settings, rng: &mut SmallRng) -> Result<Measured, EvalError> {
    let frames = trial.scene.frames.len();
    let mut course = resting(trial, settings, &trial.labels)?;
    let before = maps(&mut course, frames)?;
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
                history.erase(frame, &[point], 20);
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
    let after = maps(&mut course, frames)?;
    Ok((same(&before, &after), course.told()))
}
