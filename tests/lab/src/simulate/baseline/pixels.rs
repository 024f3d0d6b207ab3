//! A random forest on the responses of a filter bank: each image for itself, without geometry.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::Click;
use crate::pixels::{FilterBank, Forest, RESPONSES, Sample};
use inplace_core::labels::{ClassId, VOID};
use inplace_core::scene::Scene;

/// One pixel in so many along each axis is classified; its neighbours get the same.
const STRIDE: usize = 2;

/// Learns from the clicks and classifies the pixels of frames.
pub(super) fn maps(scene: &Scene, clicks: &[Click], frames: &[usize], seed: u64) -> Vec<Vec<ClassId>> {
    let mut of_frame: BTreeMap<usize, Vec<&Click>> = BTreeMap::new();
    for click in clicks {
        of_frame.entry(click.frame).or_default().push(click);
    }
    let samples = |(frame, clicks): (usize, Vec<&Click>)| {
        let bank = FilterBank::of(&scene.frames[frame]);
        let sample = |click: &Click| {
            (
                bank.at(click.pixel[0] as usize, click.pixel[1] as usize),
                click.class,
            )
        };
        clicks.into_iter().map(sample).collect::<Vec<_>>()
    };
    let samples: Vec<Sample<RESPONSES>> = of_frame.into_par_iter().flat_map_iter(samples).collect();
    let forest = Forest::grown(&samples, seed);
    let map = |&frame: &usize| {
        let bank = FilterBank::of(&scene.frames[frame]);
        let (width, height) = (bank.width, bank.height);
        let mut labels = vec![VOID; width * height];
        for y in (0..height).step_by(STRIDE) {
            for x in (0..width).step_by(STRIDE) {
                let class = forest.class(&bank.at(x, y));
                for row in y..(y + STRIDE).min(height) {
                    labels[row * width + x..row * width + (x + STRIDE).min(width)].fill(class);
                }
            }
        }
        labels
    };
    frames.par_iter().map(map).collect()
}
