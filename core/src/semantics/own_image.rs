//! What the label image of a frame says of the frame's own pixels.
//!
//! On the surface all label images are one, and the errors of each vanish. Their borders do, too, where depth is off by
//! some pixels. The frame's own image has them where they are.

use super::{CERTAIN, NO_NODE, Posterior, SurfaceImport};
use crate::labels::{ClassId, VOID};
use crate::lanes::{F32x16, LANES};
use crate::scene::{Frame, ImageEdges, PassWeights};

/// What the surface says of a pixel, when it is certain, as a share of what a label that is right says of it.
const SURFACE: f32 = 1.0 / 6.0;
/// How far pixels speak for others: this many times the distance of the right labels from each other, and at least so
/// many pixels.
const SPACINGS: f32 = 0.6;
const NARROWEST: f32 = 2.0;
/// How far a pixel may be from where the surface has its class, in pixels: beyond, the image is wrong.
const MOST_OFF: usize = 8;

/// The node that every pixel takes its class from by a frame's own label image, [`NO_NODE`] where there is none; `nodes`
/// are those that the pixels show, at the size of `edges`, which is the frame's reduced by `stride`. `None` where the
/// image says nothing.
///
/// Of the classes that the surface has nearby, a pixel takes the one that most is said for around it, up to the edges of
/// the image: by labels, the more the fewer there are, and a little by the surface. Where strokes have overruled the
/// images on the surface, they do so here.
pub(super) fn nodes_by_own_image(
    (frame, number, stride): (&Frame, usize, u32),
    edges: &ImageEdges,
    nodes: &[u32],
    posterior: &Posterior,
    import: &SurfaceImport,
) -> Option<Vec<u32>> {
    let image = import.images().of_frame(number)?;
    let said = image.labels();
    let labelled = said.iter().filter(|&&class| class != VOID).count();
    if labelled == 0 || said.len() != frame.camera.pixels() {
        return None;
    }
    let class = |node: u32| posterior.labels.get(node as usize).copied().unwrap_or(VOID);
    let is_overruled = |node: u32| import.is_overruled(node, class(node));
    let per_pixel = labelled as f32 / nodes.len() as f32;
    let right = (1.0 - import.random_share()).max(1e-3);
    let scale = (SPACINGS / (per_pixel.sqrt() * right)).max(NARROWEST);
    let of_surface = SURFACE / right;
    let (width, height) = (edges.width(), nodes.len() / edges.width());
    let reduced = |pixel: usize| {
        let [column, row] = [
            pixel % frame.camera.width as usize,
            pixel / frame.camera.width as usize,
        ];
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
                    false => SURFACE * f32::from(posterior.confidence[node as usize]) / f32::from(CERTAIN),
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
        edges.sum_around(&mut values, scale, &mut weights);
        let near = widened(&near, width, MOST_OFF);
        for ((best, values), near) in best.iter_mut().zip(&values).zip(near) {
            for (place, &value) in values.0.iter().enumerate() {
                if near & (1 << place) != 0 && value > best.0 {
                    *best = (value, classes[place]);
                }
            }
        }
    }
    let nearest = |at: usize, wanted: ClassId| {
        let (column, row) = (at % width, at / width);
        let of_row = |y: usize| {
            let columns = column.saturating_sub(MOST_OFF)..(column + MOST_OFF + 1).min(width);
            columns.map(move |x| (x.abs_diff(column).pow(2) + y.abs_diff(row).pow(2), y * width + x))
        };
        let rows = row.saturating_sub(MOST_OFF)..(row + MOST_OFF + 1).min(height);
        let around = rows
            .flat_map(of_row)
            .filter(|&(_, at)| class(nodes[at]) == wanted);
        around.min().map(|(_, at)| nodes[at])
    };
    let chosen = best.iter().zip(nodes).enumerate();
    let chosen = chosen.map(
        |(at, (&(_, best), &node))| match best == class(node) || node == NO_NODE {
            true => node,
            false => nearest(at, best).unwrap_or(node),
        },
    );
    Some(chosen.collect())
}

/// The bits that any pixel has in the window around each, `reach` pixels to each side.
fn widened(bits: &[u16], width: usize, reach: usize) -> Vec<u16> {
    let window = |at: usize, size: usize| at.saturating_sub(reach)..(at + reach + 1).min(size);
    let any = |row: &[u16], column: usize| row[window(column, width)].iter().fold(0, |all, own| all | own);
    let rows: Vec<u16> = bits
        .chunks_exact(width)
        .flat_map(|row| (0..width).map(move |column| any(row, column)))
        .collect();
    let height = bits.len() / width;
    let mut all = vec![0; bits.len()];
    for row in 0..height {
        for other in window(row, height) {
            for column in 0..width {
                all[row * width + column] |= rows[other * width + column];
            }
        }
    }
    all
}
