//! Classifying pixels by what their surroundings look like, without geometry: in the way of ilastik (Berg et al.
//! 2019), a random forest on the responses of a filter bank.

use std::collections::BTreeMap;

use rand::seq::IteratorRandom;
use rand::{Rng, SeedableRng, rngs::SmallRng};
use rayon::prelude::*;

use inplace_core::labels::{ClassId, VOID};
use inplace_core::scene::Frame;

/// Standard deviations of the Gaussians, in pixels.
const SCALES: [f32; 4] = [1.0, 2.0, 4.0, 8.0];
/// At each scale: colour, gradient magnitude, and the eigenvalues of the Hessian and their sum (the Laplacian).
const PER_SCALE: usize = 7;
/// Responses of a pixel.
pub const RESPONSES: usize = PER_SCALE * SCALES.len();

/// An image, blurred at every scale.
pub struct FilterBank {
    /// Width of the image in pixels.
    pub width: usize,
    /// Height of the image in pixels.
    pub height: usize,
    /// Colour `[height, width]` at each scale.
    blurred: [Vec<[f32; 3]>; SCALES.len()],
}

impl FilterBank {
    /// Blurs a frame's image.
    pub fn of(frame: &Frame) -> Self {
        let (width, height) = (frame.camera.width as usize, frame.camera.height as usize);
        let color = frame.color();
        let of = |pixel| color.color(pixel).to_array();
        let image: Vec<[f32; 3]> = (0..width * height).map(of).collect();
        let blurred = SCALES.map(|sigma| blurred(&image, width, height, sigma));
        Self {
            width,
            height,
            blurred,
        }
    }

    /// The responses at a pixel: derivatives are central differences of the blurred brightness.
    pub fn at(&self, x: usize, y: usize) -> [f32; RESPONSES] {
        let mut features = [0.0; RESPONSES];
        let of_scales = features.chunks_exact_mut(PER_SCALE).zip(&self.blurred);
        for ((own, image), sigma) in of_scales.zip(SCALES) {
            let bright = |dx: isize, dy: isize| {
                let x = x.saturating_add_signed(dx).min(self.width - 1);
                let y = y.saturating_add_signed(dy).min(self.height - 1);
                image[y * self.width + x].iter().sum::<f32>() / 3.0
            };
            own[..3].copy_from_slice(&image[y * self.width + x]);
            let middle = bright(0, 0);
            let across = (bright(1, 0) - bright(-1, 0)) / 2.0;
            let down = (bright(0, 1) - bright(0, -1)) / 2.0;
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
    let weight = |k: isize| (-((k * k) as f32) / (2.0 * sigma * sigma)).exp();
    let weights: Vec<f32> = (-reach..=reach).map(weight).collect();
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
    let near = |at: usize, k, size: usize| at.saturating_add_signed(k).min(size - 1);
    let rows = pass(image, &|x, y, k| y * width + near(x, k, width));
    pass(&rows, &|x, y, k| near(y, k, height) * width + x)
}

/// Trees of a random forest (Breiman 2001).
const TREES: usize = 50;
/// Features tried at each split: about the root of their number.
const TRIED: usize = 5;

/// Responses with their class.
pub type Sample = ([f32; RESPONSES], ClassId);

/// A random forest over the responses.
#[derive(Clone, Debug)]
pub struct Forest {
    trees: Vec<Tree>,
}

impl Forest {
    /// Learns from samples; void answers everything where there are none.
    pub fn grown(samples: &[Sample], seed: u64) -> Self {
        let grown = |tree: u64| Tree::grown(samples, seed ^ (tree << 32));
        let trees = (0..TREES as u64).into_par_iter().map(grown).collect();
        Self { trees }
    }

    /// The classes that the trees say, ascending, with the share of the trees that say each.
    pub fn shares(&self, features: &[f32; RESPONSES]) -> Vec<(ClassId, f32)> {
        let mut said: Vec<ClassId> = self.trees.iter().map(|tree| tree.class(features)).collect();
        said.sort_unstable();
        let share = |run: &[ClassId]| (run[0], run.len() as f32 / TREES as f32);
        said.chunk_by(|a, b| a == b).map(share).collect()
    }
}

/// One pixel in so many along each axis is classified; its neighbours get the same.
const STRIDE: usize = 2;

/// Class probabilities of a frame: the shares of the trees.
pub struct Prediction {
    width: usize,
    height: usize,
    /// Ascending, each once.
    pub classes: Vec<ClassId>,
    /// Of every second pixel along each axis, `[rows, columns, classes]`.
    probabilities: Vec<f32>,
}

impl Prediction {
    /// The probabilities of these classes.
    pub fn of(frame: &Frame, forest: &Forest, classes: &[ClassId]) -> Self {
        let bank = FilterBank::of(frame);
        let mut classes = classes.to_vec();
        classes.sort_unstable();
        classes.dedup();
        let mut probabilities = Vec::new();
        for y in (0..bank.height).step_by(STRIDE) {
            for x in (0..bank.width).step_by(STRIDE) {
                let mut shares = forest.shares(&bank.at(x, y)).into_iter().peekable();
                probabilities.extend(classes.iter().map(|class| {
                    let said = shares.next_if(|(said, _)| said == class);
                    said.map_or(0.0, |(_, share)| share)
                }));
            }
        }
        Self {
            width: bank.width,
            height: bank.height,
            classes,
            probabilities,
        }
    }

    /// The probabilities of a pixel.
    pub fn at(&self, pixel: usize) -> &[f32] {
        let (columns, count) = (self.width.div_ceil(STRIDE), self.classes.len());
        let place = (pixel / self.width / STRIDE) * columns + pixel % self.width / STRIDE;
        &self.probabilities[place * count..(place + 1) * count]
    }

    /// The likeliest class of every pixel.
    pub fn labels(&self) -> Vec<ClassId> {
        let pixels = 0..self.width * self.height;
        pixels
            .map(|pixel| likeliest(&self.classes, self.at(pixel)))
            .collect()
    }
}

/// The class with the largest value, the first of those with it; void without any.
pub fn likeliest(classes: &[ClassId], values: &[f32]) -> ClassId {
    let mut best = (f32::NEG_INFINITY, VOID);
    for (&value, &class) in values.iter().zip(classes) {
        if value > best.0 {
            best = (value, class);
        }
    }
    best.1
}

/// A decision tree, grown until its leaves are pure (CART with Gini impurity).
#[derive(Clone, Debug)]
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
    fn grown(samples: &[Sample], seed: u64) -> Self {
        let mut rng = SmallRng::seed_from_u64(seed);
        let drawn = (0..samples.len()).map(|_| &samples[rng.random_range(0..samples.len())]);
        let drawn: Vec<&Sample> = drawn.collect();
        Self::on(drawn, &mut rng)
    }

    fn on(mut samples: Vec<&Sample>, rng: &mut SmallRng) -> Self {
        let Some(first) = samples.first() else {
            return Self::Leaf(VOID);
        };
        let class = first.1;
        let mut best: Option<(f32, usize, f32)> = None;
        if samples.iter().any(|sample| sample.1 != class) {
            for feature in (0..RESPONSES).choose_multiple(rng, TRIED) {
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
        let is_low = |sample: &&Sample| sample.0[feature] <= threshold;
        let (low, high) = samples.into_iter().partition(is_low);
        Self::Split {
            feature,
            threshold,
            sides: [Self::on(low, rng).into(), Self::on(high, rng).into()],
        }
    }

    fn class(&self, features: &[f32]) -> ClassId {
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

/// Number of samples of each class.
fn counted(samples: &[&Sample]) -> BTreeMap<ClassId, f32> {
    let mut counts = BTreeMap::new();
    for (_, class) in samples {
        *counts.entry(*class).or_default() += 1.0;
    }
    counts
}

/// The class of most samples, the smallest id of those with as many.
fn most_common(samples: &[&Sample]) -> ClassId {
    let most = counted(samples)
        .into_iter()
        .rev()
        .max_by(|a, b| a.1.total_cmp(&b.1));
    most.map_or(VOID, |(class, _)| class)
}

/// The threshold that separates sorted samples best with the impurity that is left; `None` where all are equal.
fn cut(samples: &[&Sample], feature: usize) -> Option<(f32, f32)> {
    let mut above = counted(samples);
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
