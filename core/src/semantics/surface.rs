//! The surface that the frames see, fused to voxels, and which voxel every pixel shows.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::Arc;

use glam::{IVec3, Vec3};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::graph::{Node, SurfaceGraph};
use super::{FieldDepth, pixel_lengths};
use crate::scene::{Frame, Scene};

/// A pixel that shows no node: the image on disk does not reach it, or the whole frame has no depth.
pub const NO_NODE: u32 = u32::MAX;

/// Side of a voxel in footprints of a pixel at the median depth.
const VOXEL_FOOTPRINTS: f32 = 2.5;
/// Smallest and largest side of a voxel, in metres.
const VOXEL_RANGE: (f32, f32) = (0.02, 0.5);
/// Most nodes; a larger scene gets larger voxels.
const MOST_NODES: usize = 300_000;
/// Pixels that must show a voxel for it to count.
const FEWEST_PIXELS: f32 = 3.0;
/// What meets nothing lies on a shell this many sides of the scene's box away, in cells of this angle.
const SHELL_DISTANCE: f32 = 3.0;
const SHELL_CELL: f32 = 0.05;

/// The surface graph of a scene and the node that each pixel of each frame shows.
#[derive(Clone, Debug, Default)]
pub struct Surface {
    /// The graph.
    pub graph: SurfaceGraph,
    /// For each frame, row-major `[height, width]`: index of the node, or [`NO_NODE`].
    pub pixels: Vec<Vec<u32>>,
    /// Side of a voxel, in metres.
    pub voxel: f32,
}

/// Sums over the points of a voxel.
#[derive(Clone, Copy, Default)]
struct Sum {
    position: Vec3,
    color: Vec3,
    normal: Vec3,
    pixels: f32,
}

/// A voxel: on the surface or on the shell.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct Cell {
    shell: bool,
    index: IVec3,
}

/// Voxel sizes and the way from a pixel to its voxel.
struct Voxels {
    side: f32,
    shell: f32,
}

impl Surface {
    /// Fuses the frames' depths (measured, or else the field's) to a graph; `None` where no pixel of any
    /// frame has a depth.
    ///
    /// `extent` is the side of the scene's box, in metres.
    pub fn build(scene: &Scene, field: &[Option<Arc<FieldDepth>>], extent: f32) -> Option<Self> {
        let lengths: Vec<Vec<f32>> = scene
            .frames
            .par_iter()
            .enumerate()
            .map(|(index, frame)| pixel_lengths(frame, field.get(index).and_then(Option::as_deref)))
            .collect();
        let mut voxels = Voxels {
            side: voxel_side(scene, &lengths)?,
            shell: SHELL_DISTANCE * extent,
        };
        let stride = if scene.frames.len() > 40 { 2 } else { 1 };
        loop {
            let sums = voxels.fuse(scene, &lengths, stride);
            if sums.len() > MOST_NODES {
                voxels.side *= (sums.len() as f32 / MOST_NODES as f32).sqrt().max(1.05);
                continue;
            }
            return Some(Self::from_sums(scene, &voxels, sums, &lengths));
        }
    }

    fn from_sums(scene: &Scene, voxels: &Voxels, sums: FxHashMap<Cell, Sum>, lengths: &[Vec<f32>]) -> Self {
        let mut sums: Vec<(Cell, Sum)> = sums.into_iter().collect();
        // A fixed order, whatever order the frames were fused in.
        sums.sort_by_key(|(cell, _)| (cell.shell, cell.index.to_array()));
        let enough = scene.frames.len() as f32;
        sums.retain(|(_, sum)| sum.pixels >= FEWEST_PIXELS.min(enough));
        let index: FxHashMap<Cell, u32> = sums
            .iter()
            .enumerate()
            .map(|(node, (cell, _))| (*cell, node as u32))
            .collect();
        let nodes = sums
            .into_iter()
            .map(|(cell, sum)| Node {
                position: sum.position / sum.pixels,
                color: sum.color / sum.pixels,
                normal: sum.normal.normalize_or_zero(),
                pixels: sum.pixels,
                voxel: if cell.shell {
                    SHELL_CELL * voxels.shell
                } else {
                    voxels.side
                },
            })
            .collect();
        let graph = SurfaceGraph::new(nodes);
        let pixels = scene
            .frames
            .par_iter()
            .zip(lengths)
            .map(|(frame, lengths)| {
                let mut own: Vec<u32> = (0..lengths.len())
                    .map(|pixel| voxels.node_of(frame, pixel, lengths[pixel], &index, graph.nodes()))
                    .collect();
                fill_holes(frame, &mut own);
                if frame.lens.is_some() {
                    for (index, node) in own.iter_mut().enumerate() {
                        if !frame.is_valid(index) {
                            *node = NO_NODE;
                        }
                    }
                }
                own
            })
            .collect();
        Self {
            graph,
            pixels,
            voxel: voxels.side,
        }
    }
}

impl Voxels {
    fn cell(&self, frame: &Frame, pixel: usize, length: f32) -> Option<(Cell, Vec3)> {
        if length.is_nan() {
            return None;
        }
        let shell = length.is_infinite();
        let (length, side) = if shell {
            (self.shell, SHELL_CELL * self.shell)
        } else {
            (length, self.side)
        };
        let point = frame.center() + length * frame.ray_direction(pixel);
        let index = (point / side).floor().as_ivec3();
        Some((Cell { shell, index }, point))
    }

    /// Sums of the points of all frames by voxel; every `stride`-th pixel along each axis counts.
    fn fuse(&self, scene: &Scene, lengths: &[Vec<f32>], stride: u32) -> FxHashMap<Cell, Sum> {
        let share = (stride * stride) as f32;
        let of_frame = |frame: &Frame, lengths: &[f32]| {
            let mut sums: FxHashMap<Cell, Sum> = FxHashMap::default();
            for row in (0..frame.camera.height).step_by(stride as usize) {
                for column in (0..frame.camera.width).step_by(stride as usize) {
                    let pixel = (row * frame.camera.width + column) as usize;
                    if let Some((cell, point)) = self.cell(frame, pixel, lengths[pixel]) {
                        let sum = sums.entry(cell).or_default();
                        sum.position += share * point;
                        sum.color += share * frame.color.color(pixel);
                        sum.normal += share * normal(frame, lengths, column, row);
                        sum.pixels += share;
                    }
                }
            }
            sums
        };
        // In blocks, so that the sums come together in the same order with any number of threads.
        let mut all: FxHashMap<Cell, Sum> = FxHashMap::default();
        let frames: Vec<(&Frame, &Vec<f32>)> = scene.frames.iter().zip(lengths).collect();
        for block in frames.chunks(16) {
            let parts: Vec<_> = block
                .par_iter()
                .map(|(frame, lengths)| of_frame(frame, lengths))
                .collect();
            for part in parts {
                for (cell, sum) in part {
                    let total = all.entry(cell).or_default();
                    total.position += sum.position;
                    total.color += sum.color;
                    total.normal += sum.normal;
                    total.pixels += sum.pixels;
                }
            }
        }
        all
    }

    /// The node of a pixel's voxel, or of the nearest neighbouring voxel that has one.
    fn node_of(
        &self,
        frame: &Frame,
        pixel: usize,
        length: f32,
        index: &FxHashMap<Cell, u32>,
        nodes: &[Node],
    ) -> u32 {
        let Some((cell, point)) = self.cell(frame, pixel, length) else {
            return NO_NODE;
        };
        if let Some(&node) = index.get(&cell) {
            return node;
        }
        (0..27)
            .filter_map(|k| {
                let offset = IVec3::new(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
                let index_of = Cell {
                    index: cell.index + offset,
                    ..cell
                };
                index.get(&index_of).copied()
            })
            .min_by(|&a, &b| {
                let gap = |node: u32| nodes[node as usize].position.distance_squared(point);
                gap(a).total_cmp(&gap(b))
            })
            .unwrap_or(NO_NODE)
    }
}

/// Unit normal of the surface at a pixel, towards the camera; zero where a neighbour is missing or lies
/// on another surface.
fn normal(frame: &Frame, lengths: &[f32], column: u32, row: u32) -> Vec3 {
    const REACH: u32 = 2;
    let (width, height) = (frame.camera.width, frame.camera.height);
    if column < REACH || row < REACH || column + REACH >= width || row + REACH >= height {
        return Vec3::ZERO;
    }
    let at = |column: u32, row: u32| {
        let pixel = (row * width + column) as usize;
        (lengths[pixel], lengths[pixel] * frame.ray_direction(pixel))
    };
    let (length, centre) = at(column, row);
    let around = [
        at(column + REACH, row),
        at(column - REACH, row),
        at(column, row + REACH),
        at(column, row - REACH),
    ];
    // Not-a-number and infinite lengths fail this test too.
    if !around
        .iter()
        .all(|(other, _)| (other - length).abs() < 0.1 * length)
    {
        return Vec3::ZERO;
    }
    let normal = (around[0].1 - around[1].1)
        .cross(around[2].1 - around[3].1)
        .normalize_or_zero();
    if normal.dot(centre) > 0.0 { -normal } else { normal }
}

/// Gives pixels without a node the node of the pixel nearest along the image, across colour unwillingly.
fn fill_holes(frame: &Frame, pixels: &mut [u32]) {
    const COLOR: f32 = 2000.0;
    if pixels.iter().all(|&node| node == NO_NODE) || pixels.iter().all(|&node| node != NO_NODE) {
        return;
    }
    let width = frame.camera.width as usize;
    let neighbours = |pixel: usize| {
        let column = pixel % width;
        [
            (column > 0).then(|| pixel - 1),
            (column + 1 < width).then(|| pixel + 1),
            pixel.checked_sub(width),
            Some(pixel + width).filter(|&below| below < frame.camera.pixels()),
        ]
    };
    let cost =
        |a: usize, b: usize| 1.0 + COLOR * (frame.color.color(a) - frame.color.color(b)).length_squared();
    let mut queue = BinaryHeap::new();
    let mut reached = vec![f32::INFINITY; pixels.len()];
    for pixel in 0..pixels.len() {
        if pixels[pixel] == NO_NODE {
            continue;
        }
        reached[pixel] = 0.0;
        if neighbours(pixel)
            .into_iter()
            .flatten()
            .any(|other| pixels[other] == NO_NODE)
        {
            queue.push(Reverse((0_u32, pixel)));
        }
    }
    // Non-negative floats compare like their bits.
    while let Some(Reverse((bits, pixel))) = queue.pop() {
        let distance = f32::from_bits(bits);
        if distance > reached[pixel] {
            continue;
        }
        for other in neighbours(pixel).into_iter().flatten() {
            let through = distance + cost(pixel, other);
            if through < reached[other] {
                reached[other] = through;
                pixels[other] = pixels[pixel];
                queue.push(Reverse((through.to_bits(), other)));
            }
        }
    }
}

/// Side of a voxel from the size of a pixel at the median depth; `None` where there is no depth at all.
fn voxel_side(scene: &Scene, lengths: &[Vec<f32>]) -> Option<f32> {
    let mut footprints: Vec<f32> = Vec::new();
    for (frame, lengths) in scene.frames.iter().zip(lengths) {
        let stride = (lengths.len() / 100).max(1) | 1;
        let known = lengths.iter().step_by(stride).filter(|length| length.is_finite());
        footprints.extend(known.map(|length| length / frame.camera.fx));
    }
    let middle = footprints.len() / 2;
    if footprints.is_empty() {
        return None;
    }
    let median = *footprints.select_nth_unstable_by(middle, f32::total_cmp).1;
    Some((VOXEL_FOOTPRINTS * median).clamp(VOXEL_RANGE.0, VOXEL_RANGE.1))
}
