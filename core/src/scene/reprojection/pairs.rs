//! Which frames are compared with each other.

use rayon::prelude::*;

use crate::scene::pixel_errors::median;
use crate::scene::{Frame, Scene};

/// Distance between the cameras of a pair that is aimed at, in distances to the surface: about five degrees,
/// which moves corners by many pixels and hardly changes their looks.
const PARALLAX: f64 = 0.08;
/// Rotation between the cameras of a pair that is as bad as e times that distance, in radians.
const ROTATION: f64 = 0.2;
/// Smallest distance, in the same unit: below it, epipolar lines say nothing.
const LEAST_PARALLAX: f64 = 0.005;
/// Typical distance from a camera to what it sees, in extents of the cameras, where nothing tells it.
const ASSUMED: f64 = 0.6;
/// Partners of a frame are at least this far from each other, in distances to the surface: nearer ones tell the same.
const APART: f64 = 0.03;
/// How far partners may be from making a good pair.
const MOST_MISMATCH: f64 = 3.0;

/// Two frames that look at the same, by their indices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Pair {
    pub first: usize,
    pub second: usize,
    /// Whether the cameras are so near each other that epipolar lines say nothing.
    pub is_turn: bool,
}

/// Up to `most` pairs: frames evenly spaced in the capture, each with the one whose camera is at the best
/// distance and turned the least.
///
/// Only the differences between poses matter, so that the pairs are alike under wrong conventions, too.
pub(super) fn choose(scene: &Scene, most: usize) -> Vec<Pair> {
    let frames = &scene.frames;
    let distance = surface_distance(scene);
    if frames.len() < 2 || distance <= 0.0 {
        return Vec::new();
    }
    let count = frames.len().min(most);
    let mut pairs: Vec<Pair> = (0..count)
        .into_par_iter()
        .filter_map(|number| {
            let first = number * frames.len() / count;
            let others = (0..frames.len()).filter(|&second| second != first);
            let cost = |second: usize| mismatch(&frames[first], &frames[second], distance);
            let second = others.min_by(|&a, &b| cost(a).total_cmp(&cost(b)))?;
            Some(Pair {
                first: first.min(second),
                second: first.max(second),
                is_turn: parallax(&frames[first], &frames[second], distance) < LEAST_PARALLAX,
            })
        })
        .collect();
    pairs.sort_unstable_by_key(|pair| (pair.first, pair.second));
    pairs.dedup();
    pairs
}

/// Up to `most` partners for each of these frames, by numbers in `frames`: as [`choose`] has them, but apart from each
/// other, and by the poses alone. A frame is in three times as many pairs at most, however many choose it, the best first.
/// Ascending, each pair once; none where all cameras are in one place.
pub(super) fn partners(scene: &Scene, frames: &[usize], most: usize) -> Vec<[usize; 2]> {
    let distance = assumed_distance(scene);
    if distance <= 0.0 {
        return Vec::new();
    }
    let frame = |number: usize| &scene.frames[frames[number]];
    let pairs = (0..frames.len()).into_par_iter().flat_map_iter(|own| {
        let others = (0..frames.len()).filter(|&other| other != own);
        let costs = others.map(|other| (mismatch(frame(own), frame(other), distance), other));
        let mut others: Vec<(f64, usize)> = costs.filter(|&(cost, _)| cost <= MOST_MISMATCH).collect();
        others.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut chosen: Vec<(f64, usize)> = Vec::new();
        for (cost, other) in others {
            let is_apart = |&(_, kept): &(f64, usize)| parallax(frame(kept), frame(other), distance) >= APART;
            if chosen.len() < most && chosen.iter().all(is_apart) {
                chosen.push((cost, other));
            }
        }
        let pair = move |(cost, other): (f64, usize)| (cost, [own.min(other), own.max(other)]);
        chosen.into_iter().map(pair)
    });
    let mut pairs: Vec<(f64, [usize; 2])> = pairs.collect();
    pairs.sort_by_key(|&(_, pair)| pair);
    pairs.dedup_by_key(|(_, pair)| *pair);
    // Stable, so that of equals the first come first.
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut counts = vec![0; frames.len()];
    pairs.retain(|(_, pair)| {
        let has_room = pair.iter().all(|&frame| counts[frame] < 3 * most);
        if has_room {
            pair.iter().for_each(|&frame| counts[frame] += 1);
        }
        has_room
    });
    let mut pairs: Vec<[usize; 2]> = pairs.into_iter().map(|(_, pair)| pair).collect();
    pairs.sort_unstable();
    pairs
}

/// How far two frames are from making a good pair, from 0.
fn mismatch(a: &Frame, b: &Frame, distance: f64) -> f64 {
    // The smallest distance only keeps the logarithm finite.
    let parallax = parallax(a, b, distance).max(1e-4);
    let turn = a.camera_to_world.matrix3.transpose() * b.camera_to_world.matrix3;
    let cosine = 0.5 * (turn.x_axis.x + turn.y_axis.y + turn.z_axis.z - 1.0);
    (parallax / PARALLAX).ln().abs() + f64::from(cosine.clamp(-1.0, 1.0).acos()) / ROTATION
}

/// Distance between two cameras, in distances to the surface.
fn parallax(a: &Frame, b: &Frame, distance: f64) -> f64 {
    f64::from(a.center().distance(b.center())) / distance
}

/// Typical distance from a camera to what it sees, in metres: the median of measured depth or sparse points, or
/// else the extent of the cameras; 0 where they are all in one place.
fn surface_distance(scene: &Scene) -> f64 {
    let keyframes = scene.frames.par_iter().filter(|frame| frame.is_keyframe());
    let lengths: Vec<f32> = keyframes.flat_map_iter(sampled_lengths).collect();
    if let Some(median) = median(lengths.into_iter().map(f64::from)) {
        return median;
    }
    extent(scene)
}

/// The same by the cameras alone.
pub(super) fn assumed_distance(scene: &Scene) -> f64 {
    ASSUMED * extent(scene)
}

/// Longest side of the box around the cameras, in metres.
fn extent(scene: &Scene) -> f64 {
    f64::from(scene.cameras().size().max_element())
}

/// About a hundred known ray lengths of a frame, in metres.
fn sampled_lengths(frame: &Frame) -> Vec<f32> {
    match frame.depth() {
        Some(depth) => depth.sampled(100).map(|(_, length)| length).collect(),
        None => frame
            .points
            .iter()
            .step_by((frame.points.len() / 100).max(1))
            .map(|point| point.length)
            .collect(),
    }
}
