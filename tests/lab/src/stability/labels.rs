//! Labels that are few, wrong or lopsided.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;

use rand::rngs::SmallRng;
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};

use super::trial::{Measured, Trial};
use super::{Condition, Line, Settings, Way, disturbed};
use crate::paper::{Flipped, Objects, pixel_noise};
use crate::simulate::{Annotator, Click, Policy};
use crate::{Failure, learnt};
use inplace_core::labels::{ClassId, ImportedLabels, ImportedMap, Trust, VOID};

/// Pixels of the longest stroke that meets no border, and of its end beyond one.
const LONGEST_STROKE: u32 = 40;
const BEYOND: u32 = 3;

pub(super) fn conditions() -> Vec<Condition> {
    vec![
        disturbed(
            "labels-one-frame",
            "five clicks a class on the one frame that shows most classes; the others do not count",
            "follows the surface from that frame to all that it does not show",
            Line::Least(0.5),
            one_frame,
        ),
        Condition::new(
            "labels-one-click",
            "one click in all: every pixel has its class, and nothing else happens",
            "gives every pixel the only class that there is",
            Line::Least(0.999),
            Way::Course(one_click),
        )
        .in_short(),
        disturbed(
            "labels-pixel-noise",
            "label images of the training frames, 90% of whose pixels have a random class, and no click",
            "takes the pixels as votes, finds out how many are random, and diffuses the more the noisier they are",
            Line::Least(0.8),
            random_pixels,
        ),
        Condition::new(
            "labels-region-noise",
            "label images of the training frames, with the objects of one class under a random one in half of them, and no click",
            "takes the pixels as votes; the frames that are right outvote the others",
            Line::Least(0.8),
            Way::Disturb(Rc::new(random_objects)),
        ),
        disturbed(
            "labels-contradictory",
            "one click in five is of a wrong class",
            "believes every stroke, and marks those that the others contradict in the list of strokes and on the image",
            Line::OfClean(0.5),
            contradictory,
        )
        .in_short(),
        disturbed(
            "labels-across-borders",
            "every click is a brush 3 pixels wide and 40 long at most, which ends 3 pixels beyond the first border",
            "spreads nothing from the end of a scribble, or another small part, beyond an edge; the painted pixels stay",
            Line::OfClean(0.7),
            across_borders,
        )
        .limited_by("edges that neither colour nor shape shows let the end pass"),
        disturbed(
            "labels-imbalance",
            "a thousand clicks of the largest class for one of each other",
            "lets the nearest label along the surface decide, not the number of labels",
            Line::Least(0.3),
            imbalance,
        ),
    ]
}

fn one_frame(trial: &mut Trial, rng: &mut SmallRng) {
    let shown = |frame: &usize| -> BTreeSet<ClassId> {
        let labels = trial.truth.images[frame].labels.iter().copied();
        labels.filter(|&class| class != VOID).collect()
    };
    let train = trial.truth.train.iter().copied();
    let Some(best) = train.max_by_key(|frame| shown(frame).len()) else {
        return;
    };
    let known = shown(&best);
    trial.truth.train = vec![best];
    for image in trial.truth.images.values_mut() {
        for class in &mut image.labels {
            if !known.contains(class) {
                *class = VOID;
            }
        }
    }
    trial.click_anew(rng.random());
}

fn one_click(trial: &Trial, settings: &Settings, _: &mut SmallRng) -> Result<Measured, Failure> {
    let mut labels = trial.labels.clone();
    labels.strokes = labels.strokes.into_iter().take(1).collect();
    let class = labels.strokes.values().next().map_or(VOID, |stroke| stroke.class);
    let one = Trial {
        labels,
        ..trial.clone()
    };
    let mut course = one.session(settings);
    course.settle(trial.seconds(settings))?;
    let (mut own, mut all) = (0, 0);
    for frame in 0..one.scene.frames.len() {
        if let Some(map) = course.run.map(frame) {
            own += map.labels().iter().filter(|&&label| label == class).count();
        }
        all += one.scene.frames[frame].camera.pixels();
    }
    Ok((own as f64 / all as f64, course.told()))
}

fn random_pixels(trial: &mut Trial, rng: &mut SmallRng) {
    let (mut maps, classes) = (label_images(trial), trial.truth.classes());
    for map in &mut maps {
        let mut labels = map.labels();
        pixel_noise(&mut labels, &classes, 0.9, rng);
        *map = ImportedMap::new(map.frame, &labels);
    }
    vote(trial, maps);
}

fn random_objects(trial: &mut Trial, settings: &Settings, rng: &mut SmallRng) -> Result<(), Failure> {
    let (mut maps, classes) = (label_images(trial), trial.truth.classes());
    let scene = Arc::new(trial.scene.clone());
    let most = Duration::from_secs_f64(trial.seconds(settings));
    let session = settings.training.session_options(scene.source.clone());
    let surface = learnt::session_surface(&scene, &session, most)?;
    let clean = ImportedLabels::new(maps.clone(), Trust::RIGHT);
    let objects = Objects::find(&surface, &classes, &clean);
    objects.flip(&mut maps, &classes, Flipped::Even, 0.5, rng.random());
    vote(trial, maps);
    Ok(())
}

/// True label images of the training frames.
fn label_images(trial: &Trial) -> Vec<ImportedMap> {
    let image = |&frame: &usize| ImportedMap::new(frame, &trial.truth.in_frame(&trial.scene, frame));
    trial.truth.train.iter().map(image).collect()
}

/// Replaces the clicks by label images whose pixels are votes.
fn vote(trial: &mut Trial, maps: Vec<ImportedMap>) {
    trial.labels.strokes.clear();
    trial.labels.imported = Some(Arc::new(ImportedLabels::new(maps, Trust::VOTES)));
}

fn contradictory(trial: &mut Trial, rng: &mut SmallRng) {
    let classes = trial.truth.classes();
    for (number, stroke) in trial.labels.strokes.values_mut().enumerate() {
        // One of each class, not one class in five.
        if (number / classes.len() + number).is_multiple_of(5) {
            let is_other = |class: &&ClassId| **class != stroke.class;
            let others: Vec<&ClassId> = classes.iter().filter(is_other).collect();
            Arc::make_mut(stroke).class = others.choose(rng).map_or(VOID, |class| **class);
        }
    }
}

fn across_borders(trial: &mut Trial, rng: &mut SmallRng) {
    let mut truths: BTreeMap<usize, Vec<ClassId>> = BTreeMap::new();
    for frame in trial.labels.strokes.values().map(|stroke| stroke.frame) {
        truths
            .entry(frame)
            .or_insert_with(|| trial.truth.in_frame(&trial.scene, frame));
    }
    for stroke in trial.labels.strokes.values_mut() {
        let camera = &trial.scene.frames[stroke.frame].camera;
        let truth = &truths[&stroke.frame];
        let start = stroke.first_point().unwrap_or_default();
        let angle = rng.random_range(0.0..std::f32::consts::TAU);
        let at = |step: f32| -> [u32; 2] {
            let inside = |from: u32, along: f32, size: u32| {
                (from as f32 + along).round().clamp(0.0, (size - 1) as f32) as u32
            };
            [
                inside(start[0], step * angle.cos(), camera.width),
                inside(start[1], step * angle.sin(), camera.height),
            ]
        };
        let is_own = |[x, y]: [u32; 2]| truth[(y * camera.width + x) as usize] == stroke.class;
        let border = (1..LONGEST_STROKE).find(|&step| !is_own(at(step as f32)));
        let end = at((border.unwrap_or(LONGEST_STROKE) + BEYOND) as f32);
        let stroke = Arc::make_mut(stroke);
        (stroke.radius, stroke.lines) = (1, vec![vec![start, end]]);
    }
}

fn imbalance(trial: &mut Trial, rng: &mut SmallRng) {
    let annotator = Annotator::new(&trial.scene, &trial.truth);
    let mut clicks = annotator.clicks(Policy::Random, 1, rng.random());
    let mut counts: BTreeMap<ClassId, usize> = BTreeMap::new();
    for frame in &trial.truth.train {
        for &class in &trial.truth.images[frame].labels {
            *counts.entry(class).or_default() += 1;
        }
    }
    counts.remove(&VOID);
    let largest = counts.into_iter().max_by_key(|&(_, count)| count);
    let Some((largest, _)) = largest else { return };
    let mut own = SmallRng::seed_from_u64(rng.random());
    let more = (0..10_000).filter_map(|_| {
        let is_largest = |class| class == largest;
        annotator.random(&trial.truth.train, is_largest, &mut own)
    });
    let more: Vec<Click> = more.take(999).collect();
    clicks.splice(0..0, more);
    trial.labels = annotator.labels(&clicks);
}
