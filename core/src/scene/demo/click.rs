//! The demo's built-in clicks.

use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;

use super::Shot;
use super::house::{House, first_of};
use crate::labels::{ClassId, LabelSet, Stroke, VOID};

/// Clicks of each class.
const CLICKS: usize = 3;
/// Most frames of a room that are looked through.
const LOOKED_THROUGH: usize = 30;
/// Distance from a class's border at which a click is as safe as it gets, in pixels.
const SAFE: f32 = 12.0;
/// Distance between clicks of a class at which they are as far apart as they need to be, in metres.
const APART: f32 = 2.0;

/// A pixel that could be clicked.
struct Candidate {
    frame: usize,
    pixel: [u32; 2],
    class: ClassId,
    /// Distance to the nearest pixel of another class or the image's border, in pixels, up to [`SAFE`].
    inside: f32,
    /// Place in the room, in metres.
    point: Vec3,
    /// Share of the frame that its class covers.
    share: f32,
}

/// In every room greedily, for each class: the safest click in the frame that shows the class best, then clicks
/// that are both safe and far from the previous ones. On frames of the shot that are not held out.
pub(super) fn clicks(house: &House, shot: &Shot) -> LabelSet {
    let (classes, mut labels) = (super::classes(), LabelSet::default());
    for room in 0..house.count() {
        let first = |room| first_of(room, house.count(), shot.frames);
        let training: Vec<usize> = (first(room)..first(room + 1))
            .filter(|frame| frame % 2 == 0)
            .collect();
        let every = training.len().div_ceil(LOOKED_THROUGH).max(1);
        let candidates: Vec<Candidate> = training
            .into_par_iter()
            .step_by(every)
            .flat_map_iter(|frame| candidates(house, shot, frame))
            .collect();
        for class in &classes {
            choose(&candidates, class.id, &mut labels);
        }
    }
    labels.classes = classes;
    labels
}

/// Adds the clicks of a class.
fn choose(candidates: &[Candidate], class: ClassId, labels: &mut LabelSet) {
    let own: Vec<&Candidate> = candidates.iter().filter(|c| c.class == class).collect();
    let mut chosen: Vec<&Candidate> = Vec::new();
    for _ in 0..CLICKS {
        let score = |candidate: &Candidate| {
            let nearest = chosen
                .iter()
                .map(|other| other.point.distance(candidate.point))
                .fold(APART, f32::min);
            let first = if chosen.is_empty() {
                candidate.share.sqrt()
            } else {
                1.0
            };
            candidate.inside * nearest * first
        };
        let best = own.iter().max_by(|a, b| score(a).total_cmp(&score(b)));
        let Some(&best) = best.filter(|best| score(best) > 0.0) else {
            break;
        };
        let stroke = Stroke::click(best.frame, class, best.pixel);
        labels.strokes.insert(labels.next_stroke_id(), Arc::new(stroke));
        chosen.push(best);
    }
}

/// Every second pixel of every second row that is not at a border of its class.
fn candidates(house: &House, shot: &Shot, frame: usize) -> Vec<Candidate> {
    let view = shot.view(house, frame);
    let (width, height) = (view.camera.width as usize, view.camera.height as usize);
    let labels = view.labels();
    let inside = border_distance(&labels, width, height);
    let mut counts = vec![0_usize; usize::from(labels.iter().copied().max().unwrap_or(VOID)) + 1];
    for &label in &labels {
        counts[usize::from(label)] += 1;
    }
    let eye = view.camera_to_room.translation.as_vec3();
    let rotation = view.camera_to_room.matrix3.as_mat3();
    let pixels = (0..height)
        .step_by(2)
        .flat_map(|y| (0..width).step_by(2).map(move |x| (x, y)));
    pixels
        .filter(|&(x, y)| inside[y * width + x] >= 2)
        .map(|(x, y)| {
            let index = y * width + x;
            let pixel = [x as u32, y as u32];
            let direction = rotation * view.camera.pixel_direction(pixel[0], pixel[1]).normalize();
            Candidate {
                frame,
                pixel,
                class: labels[index],
                inside: f32::from(inside[index]).min(SAFE),
                point: eye + view.hit(index).distance * direction,
                share: counts[usize::from(labels[index])] as f32 / labels.len() as f32,
            }
        })
        .collect()
}

/// Chessboard distance of each pixel to the nearest pixel of another class or outside the image: two passes.
fn border_distance(labels: &[ClassId], width: usize, height: usize) -> Vec<u16> {
    let mut distance = vec![0_u16; labels.len()];
    let rows = 1..height.saturating_sub(1);
    let inner = rows.flat_map(|y| (1..width.saturating_sub(1)).map(move |x| y * width + x));
    let nearest = |distance: &[u16], index: usize, neighbours: [usize; 4]| {
        let own = |other: usize| {
            if labels[other] == labels[index] {
                distance[other]
            } else {
                0
            }
        };
        let distances = neighbours.map(own);
        1 + distances.into_iter().fold(u16::MAX - 1, u16::min)
    };
    for i in inner.clone() {
        distance[i] = nearest(&distance, i, [i - width - 1, i - width, i - width + 1, i - 1]);
    }
    for i in inner.rev() {
        let below = nearest(&distance, i, [i + width + 1, i + width, i + width - 1, i + 1]);
        distance[i] = distance[i].min(below);
    }
    distance
}
