//! How the capture was made: few frames, frames twice or out of order, frames that show nothing.

use std::sync::Arc;

use rand::Rng;
use rand::rngs::SmallRng;
use rand::seq::SliceRandom;

use super::images::replace;
use super::trial::Trial;
use super::{Condition, Line, disturbed};
use crate::paper::evenly;

pub(super) fn conditions() -> Vec<Condition> {
    let few = [
        ("frames-2", "two frames in all, measured on both", 2),
        ("frames-5", "five frames in all, measured on all", 5),
        ("frames-10", "ten frames in all, measured on all", 10),
    ];
    let mut all = few
        .map(|(name, what, count)| {
            let answer = "makes the surface from their depth, whatever the field can learn from so few";
            let quick = count == 2;
            let few = disturbed(name, what, answer, Line::Least(0.5), move |trial, rng| {
                only(trial, count, rng);
            });
            Condition { quick, ..few }
        })
        .to_vec();
    all.extend([
        disturbed(
            "frames-shuffled",
            "frames out of order",
            "knows frames by their poses, never by their order",
            Line::OfClean(0.98),
            |trial, rng| {
                let mut order: Vec<usize> = (0..trial.scene.frames.len()).collect();
                order.shuffle(rng);
                keep(trial, &order);
            },
        ),
        disturbed(
            "frames-twice",
            "every frame twice",
            "averages equal views; nothing else changes",
            Line::OfClean(0.98),
            |trial, _| {
                let count = trial.scene.frames.len();
                let order: Vec<usize> = (0..2 * count).map(|at| at / 2).collect();
                keep(trial, &order);
                for (number, frame) in trial.scene.frames.iter_mut().enumerate() {
                    if number % 2 == 1 {
                        frame.stem += "_again";
                    }
                }
            },
        ),
        disturbed(
            "frame-black",
            "one frame is black",
            "averages a voxel's colour over all views of it",
            Line::OfClean(0.95),
            |trial, _| {
                let middle = trial.truth.train[trial.truth.train.len() / 2];
                let frame = &mut trial.scene.frames[middle];
                replace(frame, vec![0; 3 * frame.camera.pixels()]);
            },
        )
        .in_short(),
    ]);
    all
}

/// Keeps so many frames, evenly, and clicks anew: on all of them, as few frames leave none to measure on.
fn only(trial: &mut Trial, count: usize, rng: &mut SmallRng) {
    let order = evenly(trial.scene.frames.len(), count);
    keep(trial, &order);
    let all: Vec<usize> = (0..trial.scene.frames.len()).collect();
    (trial.truth.train, trial.truth.test) = (all.clone(), all);
    trial.click_anew(rng.random());
}

/// Takes these frames in this order; strokes and truth go with them, strokes with the first of equal ones.
fn keep(trial: &mut Trial, order: &[usize]) {
    let frames = &trial.scene.frames;
    trial.scene.frames = order.iter().map(|&frame| frames[frame].clone()).collect();
    let strokes = std::mem::take(&mut trial.labels.strokes).into_iter();
    let moved = strokes.filter_map(|(id, mut stroke)| {
        let place = order.iter().position(|&own| own == stroke.frame)?;
        Arc::make_mut(&mut stroke).frame = place;
        Some((id, stroke))
    });
    trial.labels.strokes = moved.collect();
    let images = &trial.truth.images;
    let image = |(to, from): (usize, &usize)| Some((to, images.get(from)?.clone()));
    let moved = order.iter().enumerate().filter_map(image).collect();
    let among = |chosen: &[usize]| -> Vec<usize> {
        let places = 0..order.len();
        places.filter(|&to| chosen.contains(&order[to])).collect()
    };
    (trial.truth.train, trial.truth.test) = (among(&trial.truth.train), among(&trial.truth.test));
    trial.truth.images = moved;
}
