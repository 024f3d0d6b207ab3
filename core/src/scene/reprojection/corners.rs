//! Corners of an image, and finding them again in another by their looks.

use glam::DVec2;

use crate::scene::pixel_errors::median;
use crate::scene::{ColorImage, Frame};

/// A patch reaches this many pixels to each side of its corner.
const REACH: usize = 6;
const SIDE: usize = 2 * REACH + 1;
/// Values of a patch, filled up with zeros to whole vectors.
const LENGTH: usize = (SIDE * SIDE).next_multiple_of(LANES);
const LANES: usize = 16;
/// Half of the window over which the structure tensor is summed, and half of that in which a corner is the best.
const WINDOW: usize = 3;
/// Most corners of an image.
const MOST_CORNERS: usize = 400;
/// Weakest corner, in strengths of the strongest.
const WEAKEST: f32 = 0.01;
/// Smallest standard deviation of a patch that can be told from others, of colours 0..=255.
const FLATTEST: f32 = 3.0;
/// Lowest correlation of the patches of one corner.
const LEAST_CORRELATION: f32 = 0.85;
/// Largest ratio of 1 - correlation between the best and the second best corner.
const MOST_AMBIGUOUS: f32 = 0.7;
/// Neighbours whose motion between the images a match must share, and how far it may be from their median, in
/// lengths of the longer side of the image.
const NEIGHBOURS: usize = 5;
const MOST_STRAY: f64 = 0.04;
/// Steps of at most a pixel that bring a corner to where it looks most alike.
const STEPS: usize = 3;

/// A zero-mean patch of length 1: its product with another is their correlation.
type Patch = [f32; LENGTH];

/// A place that two frames show, in pixels of each (pixel centres at +0.5).
#[derive(Clone, Copy, Debug)]
pub(super) struct Match {
    pub first: DVec2,
    pub second: DVec2,
    /// Numbers of the corners that look most alike there: the first frame's, which is that place, and the second's.
    pub corners: [usize; 2],
}

/// The corners of a frame, with what they look like.
pub(super) struct Features {
    /// Pixels of the frame to one of `values`, along each axis.
    stride: usize,
    width: usize,
    height: usize,
    /// Brightness, 0..=255, row-major `[height, width]`.
    values: Vec<f32>,
    /// Pixels `[column, row]`, the strongest first.
    corners: Vec<[usize; 2]>,
    /// Those around the corners.
    patches: Vec<Patch>,
}

impl Features {
    /// Finds the corners (Shi and Tomasi, CVPR 1994: where the smaller eigenvalue of the structure tensor is a
    /// local maximum) of what the image on disk shows, brought down to at most `longest` pixels along its longer side.
    pub fn of(frame: &Frame, longest: usize) -> Self {
        let color = frame.color();
        let mut features = Self::brightness(frame, &color, longest);
        let strengths = features.strengths();
        let strongest = strengths.iter().copied().fold(0.0, f32::max);
        let (width, height) = (features.width, features.height);
        let mut found = Vec::new();
        for row in REACH + 1..height.saturating_sub(REACH + 1) {
            for column in REACH + 1..width.saturating_sub(REACH + 1) {
                let strength = strengths[row * width + column];
                if strength > WEAKEST * strongest && is_peak(&strengths, width, column, row) {
                    found.push((strength, [column, row]));
                }
            }
        }
        // Equal ones stay in the order of their pixels.
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        for (_, corner) in found {
            if features.corners.len() == MOST_CORNERS {
                break;
            }
            let patch = features
                .patch(corner)
                .filter(|_| features.is_shown(frame, &color, corner));
            if let Some(patch) = patch {
                features.corners.push(corner);
                features.patches.push(patch);
            }
        }
        features
    }

    /// The places of the corners, in pixels of the frame.
    pub fn places(&self) -> Vec<DVec2> {
        self.corners.iter().map(|&corner| self.place(corner)).collect()
    }

    /// Where this frame shows corner `theirs` of another, which matches its corner `own`, in pixels of the frame.
    pub fn place_of(&self, other: &Self, theirs: usize, own: usize) -> DVec2 {
        self.refined(&other.patches[theirs], self.corners[own])
    }

    /// The brightness of a frame, each value the mean of a square of pixels.
    fn brightness(frame: &Frame, color: &ColorImage, longest: usize) -> Self {
        let (full, rows) = (frame.camera.width as usize, frame.camera.height as usize);
        let stride = full.max(rows).div_ceil(longest).max(1);
        let (width, height) = (full / stride, rows / stride);
        let bytes = color.bytes();
        let mut values = Vec::with_capacity(width * height);
        for row in 0..height {
            for column in 0..width {
                let mut sum = 0_u32;
                for y in row * stride..(row + 1) * stride {
                    let from = 3 * (y * full + column * stride);
                    sum += bytes[from..from + 3 * stride]
                        .iter()
                        .map(|&value| u32::from(value))
                        .sum::<u32>();
                }
                values.push(sum as f32 / (3 * stride * stride) as f32);
            }
        }
        Self {
            stride,
            width,
            height,
            values,
            corners: Vec::new(),
            patches: Vec::new(),
        }
    }

    /// The smaller eigenvalue of the structure tensor around each pixel.
    fn strengths(&self) -> Vec<f32> {
        let (width, height) = (self.width, self.height);
        let mut tensors = vec![[0.0_f32; 3]; width * height];
        for row in 1..height.saturating_sub(1) {
            for column in 1..width.saturating_sub(1) {
                let at = row * width + column;
                let x = self.values[at + 1] - self.values[at - 1];
                let y = self.values[at + width] - self.values[at - width];
                tensors[at] = [x * x, x * y, y * y];
            }
        }
        let along_rows = summed(&tensors, width, 1);
        let sums = summed(&along_rows, height, width);
        sums.into_iter()
            .map(|[xx, xy, yy]| 0.5 * (xx + yy - (xx - yy).hypot(2.0 * xy)))
            .collect()
    }

    /// The patch around a pixel; `None` at the border and where it is flat.
    fn patch(&self, [column, row]: [usize; 2]) -> Option<Patch> {
        let inside = |v: usize, size: usize| v >= REACH && v + REACH < size;
        if !inside(column, self.width) || !inside(row, self.height) {
            return None;
        }
        let mut patch = [0.0; LENGTH];
        for (line, values) in patch.chunks_mut(SIDE).take(SIDE).enumerate() {
            let from = (row + line - REACH) * self.width + column - REACH;
            values.copy_from_slice(&self.values[from..from + SIDE]);
        }
        let area = (SIDE * SIDE) as f32;
        let mean = patch.iter().sum::<f32>() / area;
        let values = &mut patch[..SIDE * SIDE];
        values.iter_mut().for_each(|value| *value -= mean);
        let length = values.iter().map(|value| value * value).sum::<f32>().sqrt();
        if length < FLATTEST * area.sqrt() {
            return None;
        }
        values.iter_mut().for_each(|value| *value /= length);
        Some(patch)
    }

    /// Whether the image on disk shows the patch around a corner: where it was straightened, its rim is no
    /// part of the scene, and neither is what is hidden.
    fn is_shown(&self, frame: &Frame, color: &ColorImage, [column, row]: [usize; 2]) -> bool {
        let ends = |v: usize| [v - REACH, v + REACH].map(|v| v * self.stride);
        ends(row).iter().all(|y| {
            ends(column)
                .iter()
                .all(|x| color.is_valid(y * frame.camera.width as usize + x))
        })
    }

    /// The place of a patch of another image, given the corner that looks most like it, between the pixels.
    fn refined(&self, patch: &Patch, corner: [usize; 2]) -> DVec2 {
        let score = |[column, row]: [usize; 2]| {
            self.patch([column, row])
                .map_or(f32::NEG_INFINITY, |own| correlation(patch, &own))
        };
        let mut best = corner;
        let mut around = [[0.0; 3]; 3];
        for _ in 0..=STEPS {
            for (y, line) in around.iter_mut().enumerate() {
                for (x, value) in line.iter_mut().enumerate() {
                    *value = score([best[0] + x - 1, best[1] + y - 1]);
                }
            }
            let cells = (0..9).map(|cell| (around[cell / 3][cell % 3], cell));
            // The middle stays unless another is better.
            let (_, cell) = cells.fold((around[1][1], 4), |a, b| if b.0 > a.0 { b } else { a });
            if cell == 4 {
                break;
            }
            best = [best[0] + cell % 3 - 1, best[1] + cell / 3 - 1];
        }
        let column = peak([around[1][0], around[1][1], around[1][2]]);
        let row = peak([around[0][1], around[1][1], around[2][1]]);
        self.place(best) + self.stride as f64 * DVec2::new(column, row)
    }

    /// The centre of one of its pixels, in pixels of the frame.
    fn place(&self, [column, row]: [usize; 2]) -> DVec2 {
        self.stride as f64 * (DVec2::new(column as f64, row as f64) + 0.5)
    }
}

/// The places that two images show: corners that look most like each other, and like nothing else, of those that
/// `may_match`, by their numbers in the first and the second.
pub(super) fn matches(
    first: &Features,
    second: &Features,
    may_match: impl Fn(usize, usize) -> bool,
) -> Vec<Match> {
    let mut best = vec![(f32::NEG_INFINITY, 0); first.corners.len()];
    let mut next = vec![f32::NEG_INFINITY; first.corners.len()];
    let mut back = vec![(f32::NEG_INFINITY, 0); second.corners.len()];
    for (i, patch) in first.patches.iter().enumerate() {
        for (j, other) in second.patches.iter().enumerate() {
            if !may_match(i, j) {
                continue;
            }
            let score = correlation(patch, other);
            if score > best[i].0 {
                next[i] = best[i].0;
                best[i] = (score, j);
            } else if score > next[i] {
                next[i] = score;
            }
            if score > back[j].0 {
                back[j] = (score, i);
            }
        }
    }
    let clear = |i: usize| {
        let (score, j) = best[i];
        score >= LEAST_CORRELATION
            && back[j].1 == i
            && 1.0 - score <= MOST_AMBIGUOUS * (1.0 - next[i].max(-1.0))
    };
    let found: Vec<Match> = (0..first.corners.len())
        .filter(|&i| clear(i))
        .map(|i| Match {
            first: first.place(first.corners[i]),
            second: second.place_of(first, i, best[i].1),
            corners: [i, best[i].1],
        })
        .collect();
    let longest = first.stride * first.width.max(first.height);
    in_company(&found, MOST_STRAY * longest as f64)
}

/// The matches that move like those around them, up to this many pixels: what looks alike elsewhere does not.
fn in_company(matches: &[Match], most: f64) -> Vec<Match> {
    let motion = |found: &Match| found.second - found.first;
    let moves_along = |own: &&Match| {
        let mut others: Vec<(f64, DVec2)> = matches
            .iter()
            .map(|other| (other.first.distance_squared(own.first), motion(other)))
            .collect();
        // The nearest is the match itself.
        others.sort_by(|a, b| a.0.total_cmp(&b.0));
        let near = others.get(1..=NEIGHBOURS).unwrap_or_default();
        let middle = |axis: usize| {
            let median = median(near.iter().map(|(_, motion)| motion[axis]));
            median.unwrap_or(f64::INFINITY)
        };
        (motion(own) - DVec2::new(middle(0), middle(1))).length() <= most
    };
    matches.iter().filter(moves_along).copied().collect()
}

/// Correlation of two patches, -1..=1.
fn correlation(a: &Patch, b: &Patch) -> f32 {
    // One sum for each lane, so that the compiler may use vectors.
    let mut sums = [0.0_f32; LANES];
    for (a, b) in a.chunks_exact(LANES).zip(b.chunks_exact(LANES)) {
        for lane in 0..LANES {
            sums[lane] += a[lane] * b[lane];
        }
    }
    sums.iter().sum()
}

/// Where between -0.5 and 0.5 a parabola through values at -1, 0 and 1 has its peak; 0 where it has none.
fn peak([before, middle, after]: [f32; 3]) -> f64 {
    let bend = before - 2.0 * middle + after;
    if bend.is_finite() && bend < 0.0 {
        f64::from((0.5 * (before - after) / bend).clamp(-0.5, 0.5))
    } else {
        0.0
    }
}

/// Whether a pixel is the strongest around it, the first of equals.
fn is_peak(strengths: &[f32], width: usize, column: usize, row: usize) -> bool {
    let own = row * width + column;
    let lines = row - WINDOW..=row + WINDOW;
    lines.into_iter().all(|y| {
        let from = y * width + column - WINDOW;
        (from..=from + 2 * WINDOW).all(|other| {
            strengths[other] < strengths[own] || (strengths[other] == strengths[own] && other >= own)
        })
    })
}

/// Sums over windows of `2 WINDOW + 1` neighbours that lie `step` apart, along an axis of this size; 0 at its
/// ends.
fn summed(values: &[[f32; 3]], size: usize, step: usize) -> Vec<[f32; 3]> {
    let mut sums = vec![[0.0; 3]; values.len()];
    // Nothing is left of an image that is much longer than high.
    let line = (size * step).max(1);
    for (values, sums) in values.chunks(line).zip(sums.chunks_mut(line)) {
        for place in WINDOW..size.saturating_sub(WINDOW) {
            let own = sums[place * step..(place + 1) * step].as_flattened_mut();
            let window = &values[(place - WINDOW) * step..(place + WINDOW + 1) * step];
            for others in window.chunks(step) {
                for (sum, value) in own.iter_mut().zip(others.as_flattened()) {
                    *sum += value;
                }
            }
        }
    }
    sums
}
