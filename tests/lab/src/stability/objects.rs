//! Strokes that say which thing of its class they are on: very many, and ones that contradict each other.

use std::collections::BTreeMap;

use rand::{Rng, rngs::SmallRng};

use super::session::{resting, same};
use super::trial::{Measured, Trial};
use super::{Condition, Line, Settings, Way};
use crate::Failure;
use crate::simulate::{Annotator, Click, Policy, name_objects};
use inplace_core::labels::{LabelSet, ObjectId};
use inplace_core::semantics::SurfaceObjects;

/// Objects of the many.
const MANY: usize = 300;
/// How far apart two clicks are that contradict each other, in pixels.
const BESIDE: u32 = 4;

pub(super) fn conditions() -> Vec<Condition> {
    vec![
        Condition::new(
            "objects-300",
            "300 random clicks, each on an object of its own: the lesser of the shares of pixels with the class that they have \
             without objects, and of clicks that show their object",
            "spreads objects along the paths of their classes, which stay as they are",
            Line::Least(0.999),
            Way::Course(many),
        ),
        Condition::new(
            "objects-contradictory",
            "a second click beside each says another object of the same thing: the lesser of the same shares",
            "gives each click the part of the thing that is nearest to it; the class of the thing stays",
            Line::Least(0.999),
            Way::Course(contradictory),
        )
        .in_short(),
    ]
}

fn many(trial: &Trial, settings: &Settings, rng: &mut SmallRng) -> Result<Measured, Failure> {
    let annotator = Annotator::new(&trial.scene, &trial.truth);
    let a_class = MANY.div_ceil(annotator.classes().len().max(1));
    let mut clicks = annotator.clicks(Policy::Uniform, a_class, rng.random());
    clicks.truncate(MANY);
    told_apart(trial, settings, annotator.labels(&clicks))
}

fn contradictory(trial: &Trial, settings: &Settings, _: &mut SmallRng) -> Result<Measured, Failure> {
    let annotator = Annotator::new(&trial.scene, &trial.truth);
    let mut clicks: Vec<Click> = Vec::new();
    for stroke in trial.labels.strokes.values() {
        let width = trial.scene.frames[stroke.frame].camera.width;
        let Some([x, y]) = stroke.first_point() else {
            continue;
        };
        // Beside it towards the middle of the image, where the same thing is there.
        let beside = if x < width / 2 { x + BESIDE } else { x - BESIDE };
        let pair = [[x, y], [beside, y]].map(|pixel| annotator.answer(stroke.frame, pixel));
        let pair: Vec<Click> = pair.into_iter().flatten().collect();
        if pair.len() == 2 && pair.iter().all(|click| click.class == stroke.class) {
            clicks.extend(pair);
        }
    }
    told_apart(trial, settings, annotator.labels(&clicks))
}

/// Labels a scene whose classes are all of things, then says with each of these strokes an object of its own.
fn told_apart(trial: &Trial, settings: &Settings, mut labels: LabelSet) -> Result<Measured, Failure> {
    labels.classes.iter_mut().for_each(|class| class.thing = true);
    let mut course = resting(trial, settings, &labels)?;
    let before = course.maps()?;
    name_objects(&mut labels);
    // A later stroke on the same pixel covers an earlier one.
    let strokes = labels.strokes.values();
    let told: BTreeMap<_, _> = strokes
        .map(|stroke| ((stroke.frame, stroke.first_point()), stroke.object))
        .collect();
    course.say(&labels);
    let after = course.maps()?;
    let shown = |frame: usize| {
        let map = course.run.map(frame)?;
        let (surface, posterior) = map.surface()?;
        let listed = (labels.classes.as_slice(), labels.objects.as_slice());
        let objects = SurfaceObjects::new(surface, posterior, listed, None);
        Some(map.looked_up_with(Some(&objects)).into_owned())
    };
    let mut looked_up = BTreeMap::new();
    let mut right = 0;
    for (&(frame, point), &object) in &told {
        let map = looked_up.entry(frame).or_insert_with(|| shown(frame)).as_ref();
        let at = point.zip(map).and_then(|([x, y], map)| {
            let index = (y * map.width + x) as usize;
            ObjectId::new(*map.objects()?.get(index)?)
        });
        right += usize::from(at.is_some() && at == object);
    }
    let right = right as f64 / told.len().max(1) as f64;
    Ok((right.min(same(&before, &after)), course.told()))
}
