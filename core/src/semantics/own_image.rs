//! What the label image of a frame says of the frame's own pixels.
//!
//! On the surface all label images become one, so that the errors of each vanish. Where depth is off by some pixels, so do
//! their borders. A frame's own image still has them in the right place.

use std::ops::Range;

use super::{CERTAIN, NO_NODE, Posterior, SurfaceImport};
use crate::labels::{ClassId, VOID};
use crate::lanes::{F32x16, LANES};
use crate::scene::{Frame, ImageEdges, PassWeights};

/// Weight of the surface at a pixel, when it is certain, as a share of the weight of labels where all pixels have one. It
/// grows with the distance between labelled pixels.
const SURFACE: f32 = 1.0 / 6.0;
/// Scale of the sums: this many times the distance between labels that are right, and at least so many pixels. Where it
/// would be more than the most, the surface knows better.
const SPACINGS: f32 = 0.75;
const PIXELS: (f32, f32) = (2.0, 16.0);
/// How far a pixel may be from where the surface has its class, in pixels; farther away, the image is wrong.
const MOST_OFF: usize = 8;

/// The node that every pixel takes its class from by a frame's own label image, [`NO_NODE`] where there is none; `nodes`
/// are those that the pixels show, at the size of `edges`, which is the frame's reduced by `stride`. `None` where the
/// image says too little.
///
/// Of the classes that the surface has nearby, a pixel takes the one with the largest sum of weights around it, up to the
/// edges of the image: of labels, which weigh the more the fewer there are, and of the surface, which weighs less. Where
/// strokes have overruled the images on the surface, labels do not count.
pub(super) fn nodes_by_own_image(
    (frame, number, stride): (&Frame, usize, u32),
    edges: &ImageEdges,
    nodes: &[u32],
    posterior: &Posterior,
    import: &SurfaceImport,
) -> Option<Vec<u32>> {
    let said = import.shown().of_frame(number)?.labels();
    let labelled = said.iter().filter(|&&class| class != VOID).count();
    let per_pixel = labelled as f32 / nodes.len() as f32;
    let right = per_pixel.sqrt() * (1.0 - import.random_share());
    let scale = (SPACINGS / right).max(PIXELS.0);
    let of_surface = SURFACE / per_pixel.sqrt();
    if said.len() != frame.camera.pixels() || !(PIXELS.0..=PIXELS.1).contains(&scale) {
        return None;
    }
    let class = |node: u32| posterior.labels.get(node as usize).copied().unwrap_or(VOID);
    let is_overruled = |node: u32| import.is_overruled(node, class(node));
    let (width, full_width) = (edges.width(), frame.camera.width as usize);
    let reduced = |pixel: usize| {
        let (column, row) = (pixel % full_width, pixel / full_width);
        row / stride as usize * width + column / stride as usize
    };
    let mut classes: Vec<ClassId> = nodes.iter().map(|&node| class(node)).collect();
    classes.sort_unstable();
    classes.dedup();
    classes.retain(|&class| class != VOID);
    let mut best: Vec<(f32, ClassId)> = nodes.iter().map(|&node| (0.0, class(node))).collect();
    let mut values = vec![F32x16::ZERO; nodes.len()];
    let mut weights = PassWeights::default();
    for classes in classes.chunks(LANES) {
        let place = |class: ClassId| classes.binary_search(&class).ok();
        values.fill(F32x16::ZERO);
        let mut near = vec![0_u16; nodes.len()];
        for (at, &node) in nodes.iter().enumerate() {
            if let Some(place) = place(class(node)) {
                near[at] = 1 << place;
                values[at].0[place] = match is_overruled(node) {
                    true => 1.0,
                    false => of_surface * f32::from(posterior.confidence[node as usize]) / f32::from(CERTAIN),
                };
            }
        }
        for (pixel, &class) in said.iter().enumerate() {
            let at = reduced(pixel);
            if let Some(place) = place(class)
                && !is_overruled(nodes[at])
            {
                values[at].0[place] += 1.0 / per_pixel;
            }
        }
        edges.sum_nearest(&mut values, scale, &mut weights);
        let near = widened(&near, width);
        for ((best, values), near) in best.iter_mut().zip(&values).zip(near) {
            for (place, &value) in values.0.iter().enumerate() {
                if near & (1 << place) != 0 && value > best.0 {
                    *best = (value, classes[place]);
                }
            }
        }
    }
    let chosen = best.iter().zip(nodes).enumerate();
    let chosen = chosen.map(
        |(at, (&(_, best), &node))| match best == class(node) || node == NO_NODE {
            true => node,
            false => nearest(nodes, width, at, &|other| class(other) == best).unwrap_or(node),
        },
    );
    Some(chosen.collect())
}

/// The nearest node with something, as seen from a pixel.
fn nearest(nodes: &[u32], width: usize, at: usize, has: &dyn Fn(u32) -> bool) -> Option<u32> {
    let (column, row) = (at % width, at / width);
    let squared = |x: usize, y: usize| x.abs_diff(column).pow(2) + y.abs_diff(row).pow(2);
    let of_row = |y: usize| around(column, width).map(move |x| (squared(x, y), y * width + x));
    let all = around(row, nodes.len() / width).flat_map(of_row);
    let nearest = all.filter(|&(_, other)| has(nodes[other])).min();
    nearest.map(|(_, other)| nodes[other])
}

/// The bits that any pixel near each has.
fn widened(bits: &[u16], width: usize) -> Vec<u16> {
    let any = |row: &[u16], column: usize| row[around(column, width)].iter().fold(0, |all, own| all | own);
    let rows: Vec<u16> = bits
        .chunks_exact(width)
        .flat_map(|row| (0..width).map(move |column| any(row, column)))
        .collect();
    let height = bits.len() / width;
    let mut all = vec![0; bits.len()];
    for row in 0..height {
        for other in around(row, height) {
            for column in 0..width {
                all[row * width + column] |= rows[other * width + column];
            }
        }
    }
    all
}

/// The rows or columns, of so many, that are near one.
fn around(at: usize, count: usize) -> Range<usize> {
    at.saturating_sub(MOST_OFF)..(at + MOST_OFF + 1).min(count)
}
