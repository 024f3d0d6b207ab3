//! The surface that the frames see, fused to voxels, and which voxel every pixel shows.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::Arc;

use glam::{IVec3, Vec3, Vec3A};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::graph::{Node, SurfaceGraph};
use super::{FieldDepth, NodeMap, pixel_length, pixel_lengths};
use crate::scene::{Frame, Scene};

/// A pixel that shows no node: the image on disk does not reach it, or the whole frame has no depth.
pub const NO_NODE: u32 = u32::MAX;

/// Side of a voxel in footprints of a pixel at the median depth.
const VOXEL_FOOTPRINTS: f32 = 2.5;
/// A voxel is not thinner than so many times the noise of the measured depth: it would hold one layer of it.
const VOXEL_NOISES: f32 = 20.0;
/// Smallest and largest side of a voxel, in metres.
const VOXEL_RANGE: (f32, f32) = (0.02, 0.5);
/// Most nodes; a larger scene gets larger voxels.
const MOST_NODES: usize = 300_000;
/// In longer captures every second pixel along each axis is fused, and every fourth where those would be
/// more than this.
const ALL_PIXELS_FRAMES: usize = 40;
const MOST_FUSED_PIXELS: usize = 32_000_000;
/// Pixels that must show a voxel for it to count.
const FEWEST_PIXELS: f32 = 3.0;
/// What meets nothing lies on a shell this many sides of the scene's box away, in cells of this angle.
const SHELL_DISTANCE: f32 = 3.0;
pub(super) const SHELL_CELL: f32 = 0.05;

/// The surface graph of a scene and the node that each pixel of each frame shows.
#[derive(Clone, Debug, Default)]
pub struct Surface {
    /// The graph.
    pub graph: SurfaceGraph,
    /// For each frame, the node of every pixel.
    pub pixels: Vec<Arc<NodeMap>>,
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

/// A scene with what the field adds to its depth, frame by frame. The lengths of all pixels are found
/// anew whenever a frame needs them: kept, they would outweigh the scene.
#[derive(Clone, Copy)]
struct Lengths<'a> {
    scene: &'a Scene,
    field: &'a [Option<Arc<FieldDepth>>],
}

impl Lengths<'_> {
    fn field_of(&self, frame: usize) -> Option<&FieldDepth> {
        self.field.get(frame).and_then(Option::as_deref)
    }

    /// Ray length of every pixel of a frame.
    fn of_frame(&self, frame: usize) -> Vec<f32> {
        pixel_lengths(&self.scene.frames[frame], self.field_of(frame))
    }

    /// Ray length of one pixel of a frame.
    fn of_pixel(&self, frame: usize, pixel: usize) -> f32 {
        pixel_length(&self.scene.frames[frame], self.field_of(frame), pixel)
    }
}

/// The pixels of a frame as points of the world.
struct Points<'a> {
    frame: &'a Frame,
    /// Ray length of every pixel.
    lengths: Vec<f32>,
    /// Unit direction of the ray through every pixel.
    directions: Vec<Vec3>,
}

impl<'a> Points<'a> {
    /// Of a frame; directions are left out but at every `step`-th pixel along each axis.
    fn of(lengths: Lengths<'a>, number: usize, step: usize) -> Self {
        let frame = &lengths.scene.frames[number];
        let camera = &frame.camera;
        let rotation = frame.camera_to_world.matrix3;
        let mut directions = vec![Vec3::ZERO; camera.pixels()];
        for row in (0..camera.height).step_by(step) {
            for column in (0..camera.width).step_by(step) {
                let direction = rotation * Vec3A::from(camera.pixel_direction(column, row));
                directions[(row * camera.width + column) as usize] = direction.normalize().into();
            }
        }
        Self {
            frame,
            lengths: lengths.of_frame(number),
            directions,
        }
    }

    /// Where the ray of a pixel ends, seen from the camera.
    fn offset(&self, pixel: usize) -> Vec3 {
        self.lengths[pixel] * self.directions[pixel]
    }
}

/// Voxel sizes and the way from a pixel to its voxel.
struct Voxels {
    side: f32,
    shell: f32,
}

impl Surface {
    /// Whether a node is what rays that meet nothing show: on the shell around the scene, not on a surface.
    pub fn is_on_shell(&self, node: &Node) -> bool {
        node.voxel > 1.001 * self.voxel
    }

    /// The node under each of these pixels of a frame, row-major indices; `None` where it shows none.
    pub fn nodes_at(&self, frame: usize, pixels: &[u32]) -> Vec<Option<u32>> {
        let map = &self.pixels[frame];
        // A lookup reads half a row; from there on it is less work to read everything once.
        if pixels.len() > 2 * map.len() / map.width().max(1) {
            let nodes = map.unpack();
            let node = |&pixel: &u32| Some(nodes[pixel as usize]).filter(|&node| node != NO_NODE);
            return pixels.iter().map(node).collect();
        }
        pixels.iter().map(|&pixel| map.node(pixel as usize)).collect()
    }

    /// Fuses the frames' depths (measured, or else the field's) to a graph; `None` where no pixel of any
    /// frame has a depth.
    ///
    /// `extent` is the side of the scene's box, in metres.
    pub fn build(scene: &Scene, field: &[Option<Arc<FieldDepth>>], extent: f32) -> Option<Self> {
        let lengths = Lengths { scene, field };
        let mut voxels = Voxels {
            side: voxel_side(lengths)?,
            shell: SHELL_DISTANCE * extent,
        };
        let stride = stride(scene);
        loop {
            let sums = voxels.fuse(lengths, stride);
            if sums.len() > MOST_NODES {
                voxels.side *= (sums.len() as f32 / MOST_NODES as f32).sqrt().max(1.05);
                continue;
            }
            return Some(Self::from_sums(&voxels, sums, lengths));
        }
    }

    fn from_sums(voxels: &Voxels, sums: FxHashMap<Cell, Sum>, lengths: Lengths<'_>) -> Self {
        let scene = lengths.scene;
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
            .enumerate()
            .map(|(number, frame)| {
                let points = Points::of(lengths, number, 1);
                // Neighbouring pixels are often in one voxel.
                let mut last: Option<(Cell, u32)> = None;
                let node_of = |pixel| {
                    let Some((cell, point)) = voxels.cell(&points, pixel) else {
                        return NO_NODE;
                    };
                    match last {
                        Some((same, node)) if same == cell => node,
                        _ => {
                            let (node, own) = voxels.node_of(cell, point, &index, graph.nodes());
                            last = own.then_some((cell, node));
                            node
                        }
                    }
                };
                let mut own: Vec<u32> = (0..frame.camera.pixels()).map(node_of).collect();
                fill_holes(frame, &mut own);
                if frame.lens.is_some() {
                    for (index, node) in own.iter_mut().enumerate() {
                        if !frame.is_valid(index) {
                            *node = NO_NODE;
                        }
                    }
                }
                Arc::new(NodeMap::pack(frame.camera.width as usize, &own))
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
    fn cell(&self, points: &Points<'_>, pixel: usize) -> Option<(Cell, Vec3)> {
        let length = points.lengths[pixel];
        if length.is_nan() {
            return None;
        }
        let shell = length.is_infinite();
        let (length, side) = if shell {
            (self.shell, SHELL_CELL * self.shell)
        } else {
            (length, self.side)
        };
        let point = points.frame.center() + length * points.directions[pixel];
        let index = (point / side).floor().as_ivec3();
        Some((Cell { shell, index }, point))
    }

    /// Sums of the points of all frames by voxel; every `stride`-th pixel along each axis counts.
    fn fuse(&self, lengths: Lengths<'_>, stride: u32) -> FxHashMap<Cell, Sum> {
        let share = (stride * stride) as f32;
        let of_frame = |number: usize| {
            // Normals look two pixels far: with an even stride only every second one is ever read.
            let points = Points::of(lengths, number, if stride.is_multiple_of(2) { 2 } else { 1 });
            let frame = points.frame;
            let mut sums: FxHashMap<Cell, Sum> = FxHashMap::default();
            for row in (0..frame.camera.height).step_by(stride as usize) {
                for column in (0..frame.camera.width).step_by(stride as usize) {
                    let pixel = (row * frame.camera.width + column) as usize;
                    if let Some((cell, point)) = self.cell(&points, pixel) {
                        let sum = sums.entry(cell).or_default();
                        sum.position += share * point;
                        sum.color += share * frame.color.color(pixel);
                        sum.normal += share * normal(&points, column, row);
                        sum.pixels += share;
                    }
                }
            }
            sums
        };
        // In blocks, so that the sums come together in the same order with any number of threads.
        let mut all: FxHashMap<Cell, Sum> = FxHashMap::default();
        let frames: Vec<usize> = (0..lengths.scene.frames.len()).collect();
        for block in frames.chunks(16) {
            let parts: Vec<_> = block.par_iter().map(|&number| of_frame(number)).collect();
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

    /// The node of a voxel and true, or else that of the neighbouring voxel nearest to the point.
    fn node_of(&self, cell: Cell, point: Vec3, index: &FxHashMap<Cell, u32>, nodes: &[Node]) -> (u32, bool) {
        if let Some(&node) = index.get(&cell) {
            return (node, true);
        }
        let nearest = (0..27)
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
            });
        (nearest.unwrap_or(NO_NODE), false)
    }
}

/// Every how many pixels along each axis are fused: fewer of each frame where there are many frames.
fn stride(scene: &Scene) -> u32 {
    let pixels: usize = scene.frames.iter().map(|frame| frame.camera.pixels()).sum();
    match scene.frames.len() {
        0..=ALL_PIXELS_FRAMES => 1,
        _ if pixels / 4 <= MOST_FUSED_PIXELS => 2,
        _ => 4,
    }
}

/// Unit normal of the surface at a pixel, towards the camera; zero where a neighbour is missing or lies
/// on another surface.
fn normal(points: &Points<'_>, column: u32, row: u32) -> Vec3 {
    const REACH: u32 = 2;
    let (width, height) = (points.frame.camera.width, points.frame.camera.height);
    if column < REACH || row < REACH || column + REACH >= width || row + REACH >= height {
        return Vec3::ZERO;
    }
    let at = |column: u32, row: u32| {
        let pixel = (row * width + column) as usize;
        (points.lengths[pixel], points.offset(pixel))
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

/// Side of a voxel from the size of a pixel at the median depth and from the noise of measured depth; `None` where
/// there is no depth at all.
fn voxel_side(lengths: Lengths<'_>) -> Option<f32> {
    let mut footprints: Vec<f32> = Vec::new();
    for (number, frame) in lengths.scene.frames.iter().enumerate() {
        let pixels = frame.camera.pixels();
        let sampled = (0..pixels).step_by((pixels / 100).max(1) | 1);
        let known = sampled
            .map(|pixel| lengths.of_pixel(number, pixel))
            .filter(|length| length.is_finite());
        footprints.extend(known.map(|length| length / frame.camera.fx));
    }
    let side = (VOXEL_FOOTPRINTS * median(footprints)?).max(VOXEL_NOISES * depth_noise(lengths.scene));
    Some(side.clamp(VOXEL_RANGE.0, VOXEL_RANGE.1))
}

/// How far measured depth is from the mean of its two neighbours in the row, the median over the frames, in metres; 0
/// without measured depth.
fn depth_noise(scene: &Scene) -> f32 {
    let mut gaps = Vec::new();
    for frame in &scene.frames {
        let Some(depth) = &frame.depth else { continue };
        let pixels = frame.camera.pixels();
        let width = frame.camera.width as usize;
        for pixel in (0..pixels).step_by((pixels / 100).max(1) | 1) {
            if (1..width.saturating_sub(1)).contains(&(pixel % width)) {
                let around = [pixel - 1, pixel, pixel + 1].map(|index| depth.ray_length(index));
                if let [Some(left), Some(own), Some(right)] = around {
                    gaps.push((0.5 * (left + right) - own).abs());
                }
            }
        }
    }
    median(gaps).unwrap_or(0.0)
}

fn median(mut values: Vec<f32>) -> Option<f32> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f32::total_cmp).1)
}
