//! Semi-global matching (Hirschmueller 2008): costs are summed along eight paths through each pixel, on which a change
//! of depth costs extra.

use super::view::View;
use crate::lanes::{Dispatch, VectorUnit, dispatched};

/// Cost of a change by one label, and of a larger one where brightness stays the same; that falls with the change of
/// brightness, in 8-bit steps.
const SMALL: u16 = 12;
const LARGE: f32 = 200.0;
const FALL: f32 = 0.15;
/// Larger than every sum of costs, and small enough to add penalties to.
const HUGE: u16 = 1 << 14;

/// Buffers that go from view to view.
#[derive(Default)]
pub struct Workspace {
    sums: Vec<u16>,
    /// Costs of the paths through the row before and through this one, three directions each, `[3, width, labels + 2]`.
    before: Vec<u16>,
    row: Vec<u16>,
    /// Costs of the path along the row, of the pixel before and this one.
    along: [Vec<u16>; 2],
    /// The least cost of each path in `before` and `row`.
    least: [Vec<u16>; 2],
}

/// The image of costs, row-major `[height, width, labels]`.
struct Volume<'a> {
    width: usize,
    height: usize,
    labels: usize,
    costs: &'a [u8],
    /// In 8-bit steps.
    luma: &'a [f32],
}

/// The inverse depths of least cost, of labels `step` apart and between them by a parabola; the median of each
/// neighbourhood of 3 x 3. `costs` are row-major `[height, width, labels]`.
pub fn inverse_depths(
    view: &View,
    costs: &[u8],
    step: f32,
    labels: usize,
    workspace: &mut Workspace,
) -> Vec<f32> {
    let volume = Volume {
        width: view.camera.width as usize,
        height: view.camera.height as usize,
        labels,
        costs,
        luma: &view.luma(),
    };
    workspace.sums.clear();
    workspace.sums.resize(costs.len(), 0);
    for forwards in [true, false] {
        aggregate(Dispatch::detect(), &volume, forwards, workspace);
    }
    let of_pixel = |sums: &[u16]| {
        let least = sums.iter().copied().min().unwrap_or(0);
        let label = sums.iter().position(|&sum| sum == least).unwrap_or(0);
        let mut at = label as f32;
        if label > 0 && label + 1 < labels {
            let [before, own, after] = [0, 1, 2].map(|k| f32::from(sums[label + k - 1]));
            at += 0.5 * (before - after) / (before - 2.0 * own + after).max(1.0);
        }
        at * step
    };
    let best: Vec<f32> = workspace.sums.chunks_exact(labels).map(of_pixel).collect();
    median(&best, volume.width)
}

dispatched! {
    /// Adds the sums along the four paths that come from the left and from above, or from the right and from below.
    fn aggregate = aggregate_on(volume: &Volume<'_>, forwards: bool, workspace: &mut Workspace)
}

#[inline(always)]
fn aggregate_on<U: VectorUnit>(_: U, volume: &Volume, forwards: bool, workspace: &mut Workspace) {
    let &Volume {
        width,
        height,
        labels,
        costs,
        luma,
    } = volume;
    let padded = labels + 2;
    let Workspace {
        sums,
        before,
        row,
        along,
        least,
    } = workspace;
    for paths in [&mut *before, &mut *row] {
        paths.clear();
        paths.resize(3 * width * padded, HUGE);
    }
    for paths in along.iter_mut() {
        paths.clear();
        paths.resize(padded, HUGE);
    }
    for least in least.iter_mut() {
        least.clear();
        least.resize(3 * width, 0);
    }
    for line in 0..height {
        let y = if forwards { line } else { height - 1 - line };
        let mut least_along = 0;
        for step in 0..width {
            let x = if forwards { step } else { width - 1 - step };
            let pixel = y * width + x;
            let cost = &costs[pixel * labels..(pixel + 1) * labels];
            let sum = &mut sums[pixel * labels..(pixel + 1) * labels];
            // Where nothing comes before, all labels are equal.
            let penalty = |from: Option<usize>| match from {
                Some(from) => ((LARGE / (1.0 + FALL * (luma[pixel] - luma[from]).abs())) as u16).max(SMALL),
                None => 0,
            };
            let neighbour = |dx: isize, dy: bool| {
                let dx = if forwards { dx } else { -dx };
                let column = x.checked_add_signed(dx).filter(|&column| column < width)?;
                let above = if forwards {
                    y.checked_sub(1)
                } else {
                    Some(y + 1).filter(|&y| y < height)
                };
                let y = if dy { above? } else { y };
                Some((column, y * width + column))
            };
            {
                let from = neighbour(-1, false).map(|(_, pixel)| pixel);
                let [old, new] = &mut *along;
                least_along = follow(cost, old, least_along, penalty(from), from.is_some(), new, sum);
                std::mem::swap(old, new);
            }
            for (direction, dx) in [-1, 0, 1].into_iter().enumerate() {
                let from = neighbour(dx, true);
                let column = from.map_or(x, |(column, _)| column);
                let place = direction * width + column;
                let old = &before[place * padded..(place + 1) * padded];
                let own = direction * width + x;
                let new = &mut row[own * padded..(own + 1) * padded];
                least[1][own] = follow(
                    cost,
                    old,
                    least[0][place],
                    penalty(from.map(|(_, pixel)| pixel)),
                    from.is_some(),
                    new,
                    sum,
                );
            }
        }
        std::mem::swap(before, row);
        least.swap(0, 1);
    }
}

/// One step of a path: writes its costs at a pixel, adds them to the pixel's sums, and returns the least.
#[inline(always)]
fn follow(
    cost: &[u8],
    old: &[u16],
    least: u16,
    large: u16,
    continues: bool,
    new: &mut [u16],
    sum: &mut [u16],
) -> u16 {
    let labels = cost.len();
    let (below, same, above) = (&old[..labels], &old[1..labels + 1], &old[2..labels + 2]);
    let (new, sum) = (&mut new[1..labels + 1], &mut sum[..labels]);
    let mut lowest = u16::MAX;
    if continues {
        for k in 0..labels {
            let near = below[k].min(above[k]) + SMALL;
            let from = same[k].min(near).min(least + large);
            let own = u16::from(cost[k]) + from - least;
            new[k] = own;
            sum[k] += own;
            lowest = lowest.min(own);
        }
    } else {
        for k in 0..labels {
            let own = u16::from(cost[k]);
            new[k] = own;
            sum[k] += own;
            lowest = lowest.min(own);
        }
    }
    lowest
}

/// The median of each pixel's neighbourhood of 3 x 3.
fn median(values: &[f32], width: usize) -> Vec<f32> {
    let height = values.len() / width;
    let mut medians = Vec::with_capacity(values.len());
    for y in 0..height {
        let rows = [y.saturating_sub(1), y, (y + 1).min(height - 1)];
        for x in 0..width {
            let columns = [x.saturating_sub(1), x, (x + 1).min(width - 1)];
            let mut window: [f32; 9] = std::array::from_fn(|k| values[rows[k / 3] * width + columns[k % 3]]);
            let (_, &mut middle, _) = window.select_nth_unstable_by(4, f32::total_cmp);
            medians.push(middle);
        }
    }
    medians
}
