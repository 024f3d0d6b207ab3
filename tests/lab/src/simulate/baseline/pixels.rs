//! A random forest on the responses of a filter bank: each image for itself, without geometry.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::Click;
use crate::pixels::{FilterBank, Forest, Prediction, Sample};
use inplace_core::labels::ClassId;
use inplace_core::scene::Scene;

/// Learns from the clicks and classifies the pixels of frames.
pub(super) fn maps(scene: &Scene, clicks: &[Click], frames: &[usize], seed: u64) -> Vec<Vec<ClassId>> {
    let mut of_frame: BTreeMap<usize, Vec<&Click>> = BTreeMap::new();
    for click in clicks {
        of_frame.entry(click.frame).or_default().push(click);
    }
    let samples = |(frame, clicks): (usize, Vec<&Click>)| {
        let bank = FilterBank::of(&scene.frames[frame]);
        let at = |[x, y]: [u32; 2]| bank.at(x as usize, y as usize);
        let samples = clicks.into_iter().map(|click| (at(click.pixel), click.class));
        samples.collect::<Vec<Sample>>()
    };
    let samples: Vec<Sample> = of_frame.into_par_iter().flat_map_iter(samples).collect();
    let forest = Forest::grown(&samples, seed);
    let classes: Vec<ClassId> = samples.iter().map(|sample| sample.1).collect();
    let map = |&frame: &usize| Prediction::of(&scene.frames[frame], &forest, &classes).labels();
    frames.par_iter().map(map).collect()
}
