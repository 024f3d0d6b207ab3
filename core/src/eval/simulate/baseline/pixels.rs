//! A random forest on the responses of a filter bank: each image for itself, without geometry.

use std::collections::BTreeMap;

use rand::seq::IteratorRandom;
use rand::{Rng, SeedableRng, rngs::SmallRng};
use rayon::prelude::*;

use super::Click;
use crate::labels::{ClassId, VOID};
use crate::scene::{Frame, Scene};

/// Standard deviations of the Gaussians, in pixels.
const SCALES: [f32; 4] = [1.0, 2.0, 4.0, 8.0];
/// At each scale: colour, gradient magnitude, and the eigenvalues of the Hessian and their sum (the Laplacian).
const PER_SCALE: usize = 7;
const FEATURES: usize = PER_SCALE * SCALES.len();
const TREES: usize = 50;
/// Features tried at each split: the root of their number.
const TRIED: usize = 5;
/// One pixel in so many along each axis is classified; its neighbours get the same.
const STRIDE: usize = 2;

type Features = [f32; FEATURES];

/// Learns from the clicks and classifies the pixels of frames.
pub(super) fn maps(scene: &Scene, clicks: &[Click], frames: &[usize], seed: u64) -> Vec<Vec<ClassId>> {
    let mut of_frame: BTreeMap<usize, Vec<&Click>> = BTreeMap::new();
    for click in clicks {
        of_frame.entry(click.frame).or_default().push(click);
    }
    let of_frame: Vec<(usize, Vec<&Click>)> = of_frame.into_iter().collect();
    let samples: Vec<(Features, ClassId)> = of_frame
        .par_iter()
        .flat_map_iter(|(frame, clicks)| {
            let bank = FilterBank::of(&scene.frames[*frame]);
            let sample = move |click: &&Click| {
                (
                    bank.at(click.pixel[0] as usize, click.pixel[1] as usize),
                    click.class,
                )
            };
            clicks.iter().map(sample).collect::<Vec<_>>()
        })
        .collect();
    let forest: Vec<Tree> = (0..TREES as u64)
        .into_par_iter()
        .map(|tree| Tree::grown(&samples, seed ^ (tree << 32)))
        .collect();
    let map = |&frame: &usize| {
        let bank = FilterBank::of(&scene.frames[frame]);
        let (width, height) = (bank.width, bank.height);
        let mut labels = vec![VOID; width * height];
        for y in (0..height).step_by(STRIDE) {
            for x in (0..width).step_by(STRIDE) {
                let class = vote(&forest, &bank.at(x, y));
                for row in y..(y + STRIDE).min(height) {
                    labels[row * width + x..row * width + (x + STRIDE).min(width)].fill(class);
                }
            }
        }
        labels
    };
    frames.par_iter().map(map).collect()
}

/// The class that most trees say, the smallest id of those with as many.
fn vote(forest: &[Tree], features: &Features) -> ClassId {
    let mut said: Vec<ClassId> = forest.iter().map(|tree| tree.class(features)).collect();
    said.sort_unstable();
    let runs = said.chunk_by(|a, b| a == b).rev();
    runs.max_by_key(|run| run.len()).map_or(VOID, |run| run[0])
}

/// An image, blurred at every scale.
struct FilterBank {
    width: usize,
    height: usize,
    /// Colour `[height, width]` at each scale.
    blurred: Vec<Vec<[f32; 3]>>,
}

impl FilterBank {
    fn of(frame: &Frame) -> Self {
        let (width, height) = (frame.camera.width as usize, frame.camera.height as usize);
        let image: Vec<[f32; 3]> = (0..width * height)
            .map(|pixel| frame.color.color(pixel).to_array())
            .collect();
        let blurred = SCALES
            .iter()
            .map(|&sigma| blurred(&image, width, height, sigma))
            .collect();
        Self {
            width,
            height,
            blurred,
        }
    }

    /// The responses at a pixel: derivatives are central differences of the blurred brightness.
    fn at(&self, x: usize, y: usize) -> Features {
        let mut features = [0.0; FEATURES];
        for ((own, image), sigma) in features
            .chunks_exact_mut(PER_SCALE)
            .zip(&self.blurred)
            .zip(SCALES)
        {
            let bright = |dx: isize, dy: isize| {
                let x = x.saturating_add_signed(dx).min(self.width - 1);
                let y = y.saturating_add_signed(dy).min(self.height - 1);
                image[y * self.width + x].iter().sum::<f32>() / 3.0
            };
            own[..3].copy_from_slice(&image[y * self.width + x]);
            let middle = bright(0, 0);
            let (across, down) = (
                (bright(1, 0) - bright(-1, 0)) / 2.0,
                (bright(0, 1) - bright(0, -1)) / 2.0,
            );
            let xx = bright(1, 0) + bright(-1, 0) - 2.0 * middle;
            let yy = bright(0, 1) + bright(0, -1) - 2.0 * middle;
            let xy = (bright(1, 1) + bright(-1, -1) - bright(1, -1) - bright(-1, 1)) / 4.0;
            let (mean, spread) = ((xx + yy) / 2.0, ((xx - yy).powi(2) / 4.0 + xy * xy).sqrt());
            own[3] = sigma * across.hypot(down);
            own[4] = sigma * sigma * (mean + spread);
            own[5] = sigma * sigma * (mean - spread);
            own[6] = sigma * sigma * 2.0 * mean;
        }
        features
    }
}

/// A Gaussian blur, first along the rows, then along the columns; the border is repeated.
fn blurred(image: &[[f32; 3]], width: usize, height: usize, sigma: f32) -> Vec<[f32; 3]> {
    let reach = (2.5 * sigma).ceil() as isize;
    let weights: Vec<f32> = (-reach..=reach)
        .map(|k| (-((k * k) as f32) / (2.0 * sigma * sigma)).exp())
        .collect();
    let total: f32 = weights.iter().sum();
    let pass = |from: &[[f32; 3]], at: &dyn Fn(usize, usize, isize) -> usize| -> Vec<[f32; 3]> {
        let pixel = |index: usize| {
            let mut sum = [0.0; 3];
            for (weight, k) in weights.iter().zip(-reach..) {
                let other = from[at(index % width, index / width, k)];
                (0..3).for_each(|channel| sum[channel] += weight / total * other[channel]);
            }
            sum
        };
        (0..width * height).map(pixel).collect()
    };
    let rows = pass(image, &|x, y, k| {
        y * width + x.saturating_add_signed(k).min(width - 1)
    });
    pass(&rows, &|x, y, k| {
        y.saturating_add_signed(k).min(height - 1) * width + x
    })
}

/// A decision tree, grown until its leaves are pure (CART with Gini impurity; Breiman 2001).
enum Tree {
    Leaf(ClassId),
    Split {
        feature: usize,
        threshold: f32,
        /// Not above the threshold, and above it.
        sides: [Box<Tree>; 2],
    },
}

impl Tree {
    /// From as many samples as there are, drawn with repetition.
    fn grown(samples: &[(Features, ClassId)], seed: u64) -> Self {
        let mut rng = SmallRng::seed_from_u64(seed);
        let drawn = (0..samples.len()).map(|_| &samples[rng.random_range(0..samples.len())]);
        let drawn: Vec<&(Features, ClassId)> = drawn.collect();
        Self::on(drawn, &mut rng)
    }

    fn on(mut samples: Vec<&(Features, ClassId)>, rng: &mut SmallRng) -> Self {
        let Some(first) = samples.first() else {
            return Self::Leaf(VOID);
        };
        let class = first.1;
        let mut best: Option<(f32, usize, f32)> = None;
        if samples.iter().any(|sample| sample.1 != class) {
            for feature in (0..FEATURES).choose_multiple(rng, TRIED) {
                samples.sort_by(|a, b| a.0[feature].total_cmp(&b.0[feature]));
                if let Some((impurity, threshold)) = cut(&samples, feature)
                    && best.is_none_or(|(least, ..)| impurity < least)
                {
                    best = Some((impurity, feature, threshold));
                }
            }
        }
        let Some((_, feature, threshold)) = best else {
            return Self::Leaf(most_common(&samples));
        };
        let (low, high) = samples
            .into_iter()
            .partition(|sample| sample.0[feature] <= threshold);
        Self::Split {
            feature,
            threshold,
            sides: [Self::on(low, rng).into(), Self::on(high, rng).into()],
        }
    }

    fn class(&self, features: &Features) -> ClassId {
        let mut tree = self;
        loop {
            match tree {
                Self::Leaf(class) => return *class,
                Self::Split {
                    feature,
                    threshold,
                    sides,
                } => tree = &sides[usize::from(features[*feature] > *threshold)],
            }
        }
    }
}

/// The class of most samples, the smallest id of those with as many.
fn most_common(samples: &[&(Features, ClassId)]) -> ClassId {
    let mut counts: BTreeMap<ClassId, usize> = BTreeMap::new();
    samples
        .iter()
        .for_each(|sample| *counts.entry(sample.1).or_default() += 1);
    counts
        .into_iter()
        .rev()
        .max_by_key(|&(_, count)| count)
        .map_or(VOID, |(class, _)| class)
}

/// The threshold that separates sorted samples best with the impurity that is left; `None` where all are equal.
fn cut(samples: &[&(Features, ClassId)], feature: usize) -> Option<(f32, f32)> {
    let mut above: BTreeMap<ClassId, f32> = BTreeMap::new();
    samples
        .iter()
        .for_each(|sample| *above.entry(sample.1).or_default() += 1.0);
    let mut below: BTreeMap<ClassId, f32> = BTreeMap::new();
    let total = samples.len() as f32;
    // Sum of squares of the counts: Gini impurity is 1 - squares / count^2.
    let (mut squares_below, mut squares_above) = (0.0, above.values().map(|n| n * n).sum::<f32>());
    let mut best: Option<(f32, f32)> = None;
    for (index, pair) in samples.windows(2).enumerate() {
        let class = pair[0].1;
        let (n, m) = (below.entry(class).or_default(), above.entry(class).or_default());
        squares_below += 2.0 * *n + 1.0;
        squares_above -= 2.0 * *m - 1.0;
        *n += 1.0;
        *m -= 1.0;
        let (low, high) = (pair[0].0[feature], pair[1].0[feature]);
        if low < high {
            let count = (index + 1) as f32;
            let impurity = total - squares_below / count - squares_above / (total - count);
            if best.is_none_or(|(least, _)| impurity < least) {
                // Between the two, and never rounded up to the higher.
                let middle = low + 0.5 * (high - low);
                best = Some((impurity, if middle < high { middle } else { low }));
            }
        }
    }
    best
}
