//! The voxels of a surface, and which of them every pixel of a frame shows.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};
use std::sync::Arc;

use glam::{IVec3, Vec3, Vec3A};
use rustc_hash::FxHashMap;

use super::graph::{Node, SurfaceGraph, cube};
use super::windows::window;
use super::{FieldDepth, NO_NODE, NodeMap, pixel_length};
use crate::scene::{Cache, ColorImage, Frame, Pixels};

/// Rays that meet nothing end on a shell, whose distance is this many sides of the scene's box, in cells of this angle.
const SHELL_DISTANCE: f32 = 3.0;
pub(super) const SHELL_CELL: f32 = 0.05;
/// Bytes of cached node maps of frames that are no keyframes: some hundred of 640 x 480 pixels.
const CACHE_BYTES: usize = 64 << 20;
/// Pixels of a frame, along each axis, for each sample of the surface's depth.
const STRIDE: u32 = 2;
/// Pixels without a length that are at most this far from those with one, along each axis, are filled by colour.
const NARROW: usize = 5;

/// A voxel: on the surface or on the shell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Voxel {
    pub shell: bool,
    pub index: IVec3,
}

/// Voxel sizes, and the voxel of each pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Voxels {
    /// Side of a voxel on the surface, in metres.
    pub side: f32,
    /// Distance of the shell, in metres.
    shell: f32,
}

/// The pixels of a frame as points of the world.
pub(super) struct Points<'a> {
    pub frame: &'a Frame,
    pub pixels: Pixels,
    /// Ray length of every pixel, or of every so many.
    pub lengths: Vec<f32>,
    /// Unit direction of the ray through every pixel.
    directions: Vec<Vec3>,
}

impl<'a> Points<'a> {
    /// Every `step`-th pixel along each axis of a frame with these pixels, by the field's depth where none was measured;
    /// those between have no length.
    pub fn of(frame: &'a Frame, pixels: Pixels, field: Option<&FieldDepth>, step: usize) -> Self {
        let camera = &frame.camera;
        let rotation = frame.camera_to_world.matrix3;
        let mut directions = vec![Vec3::ZERO; camera.pixels()];
        let mut lengths = vec![f32::NAN; camera.pixels()];
        for row in (0..camera.height).step_by(step) {
            for column in (0..camera.width).step_by(step) {
                let direction = rotation * Vec3A::from(camera.pixel_direction(column, row));
                let pixel = (row * camera.width + column) as usize;
                directions[pixel] = direction.normalize().into();
                lengths[pixel] = pixel_length(frame, &pixels, field, pixel);
            }
        }
        Self {
            frame,
            lengths,
            pixels,
            directions,
        }
    }

    /// Where the ray of a pixel ends, seen from the camera.
    pub fn offset(&self, pixel: usize) -> Vec3 {
        self.lengths[pixel] * self.directions[pixel]
    }
}

impl Voxels {
    /// Voxels of this side, in a scene whose box has sides of `extent`, in metres.
    pub fn new(side: f32, extent: f32) -> Self {
        Self {
            side,
            shell: SHELL_DISTANCE * extent,
        }
    }

    /// Side of a voxel, in metres.
    pub fn side_of(&self, shell: bool) -> f32 {
        if shell { SHELL_CELL * self.shell } else { self.side }
    }

    /// The voxel that a pixel shows, and the point in it; `None` where its length is not known.
    pub fn cell(&self, points: &Points<'_>, pixel: usize) -> Option<(Voxel, Vec3)> {
        self.cell_at(points, pixel, points.lengths[pixel])
    }

    /// The same at this length along the pixel's ray, which may be infinite or not a number.
    fn cell_at(&self, points: &Points<'_>, pixel: usize, length: f32) -> Option<(Voxel, Vec3)> {
        if length.is_nan() {
            return None;
        }
        let shell = length.is_infinite();
        let length = if shell { self.shell } else { length };
        let point = points.frame.center() + length * points.directions[pixel];
        let index = (point / self.side_of(shell)).floor().as_ivec3();
        Some((Voxel { shell, index }, point))
    }
}

/// The node of each voxel that has one.
#[derive(Debug)]
pub(super) struct VoxelNodes {
    voxels: Voxels,
    index: FxHashMap<Voxel, u32>,
}

impl VoxelNodes {
    /// The voxels of nodes, in the order of the nodes.
    pub fn new(voxels: Voxels, cells: impl Iterator<Item = Voxel>) -> Self {
        Self {
            voxels,
            index: cells.zip(0..).collect(),
        }
    }

    /// The node that every pixel shows.
    pub fn shown(&self, points: &Points<'_>, nodes: &[Node]) -> NodeMap {
        let frame = points.frame;
        // Neighbouring pixels are often in one voxel.
        let mut last: Option<(Voxel, u32)> = None;
        let node_of = |pixel| {
            let Some((cell, point)) = self.voxels.cell(points, pixel) else {
                return NO_NODE;
            };
            match last {
                Some((same, node)) if same == cell => node,
                _ => {
                    let (node, own) = self.node_of(cell, point, nodes);
                    last = own.then_some((cell, node));
                    node
                }
            }
        };
        let mut own: Vec<u32> = (0..frame.camera.pixels()).map(node_of).collect();
        self.look_up_wide_holes(points, nodes, &mut own);
        fill_holes(frame, &points.pixels.color, &mut own);
        if !frame.is_whole() {
            // Only what shows a part of the scene has an estimated length.
            let is_measured = points.pixels.depth.is_some();
            for (pixel, node) in own.iter_mut().enumerate() {
                let is_open = is_measured || points.lengths[pixel].is_nan();
                if is_open && !frame.shows(&points.pixels.color, pixel) {
                    *node = NO_NODE;
                }
            }
        }
        NodeMap::pack(frame.camera.width as usize, &own)
    }

    /// Fills wide holes in a frame's lengths from the surface, which other frames may have seen there. Narrow holes lie
    /// along the edges of things, where colours tell more than squares of a voxel's size.
    fn look_up_wide_holes(&self, points: &Points<'_>, nodes: &[Node], own: &mut [u32]) {
        let frame = points.frame;
        let pixels = points.lengths.iter().enumerate();
        // Pixels outside the image get no node in the end.
        let unknown: Vec<bool> = pixels
            .map(|(pixel, length)| length.is_nan() && frame.shows(&points.pixels.color, pixel))
            .collect();
        let wide = eroded(&unknown, frame.camera.width as usize, NARROW);
        if !wide.contains(&true) {
            return;
        }
        let surface = FieldDepth::of_surface(frame, nodes, self.voxels.side_of(true), STRIDE);
        for pixel in (0..own.len()).filter(|&pixel| wide[pixel]) {
            let length = surface.at(frame, &points.pixels.color, pixel);
            if let Some((cell, point)) = self.voxels.cell_at(points, pixel, length) {
                own[pixel] = self.node_of(cell, point, nodes).0;
            }
        }
    }

    /// The node of a voxel and true, or else that of the neighbouring voxel nearest to the point.
    fn node_of(&self, cell: Voxel, point: Vec3, nodes: &[Node]) -> (u32, bool) {
        if let Some(&node) = self.index.get(&cell) {
            return (node, true);
        }
        let nearest = cube(1)
            .filter_map(|offset| {
                let index = cell.index + offset;
                self.index.get(&Voxel { index, ..cell }).copied()
            })
            .min_by(|&a, &b| {
                let gap = |node: u32| nodes[node as usize].position.distance_squared(point);
                gap(a).total_cmp(&gap(b))
            });
        (nearest.unwrap_or(NO_NODE), false)
    }
}

/// The frames that are no keyframes; the nodes of their pixels are computed on demand.
#[derive(Debug)]
pub struct OtherFrames {
    frames: BTreeMap<usize, Frame>,
    places: VoxelNodes,
    made: Cache<Arc<NodeMap>>,
}

impl OtherFrames {
    /// These frames of a scene, by their indices; `None` where there are none.
    pub(super) fn new(frames: BTreeMap<usize, Frame>, places: VoxelNodes) -> Option<Arc<Self>> {
        (!frames.is_empty()).then(|| {
            Arc::new(Self {
                frames,
                places,
                made: Cache::new(CACHE_BYTES),
            })
        })
    }

    /// The node of every pixel of one of the frames: by its measured depth, and by that of the surface where too
    /// little was measured. No pixel has one where the frame's files can no longer be read.
    pub(super) fn nodes_of(&self, number: usize, graph: &SurfaceGraph) -> Option<Arc<NodeMap>> {
        let frame = self.frames.get(&number)?;
        if let Some(made) = self.made.get(number) {
            return Some(made);
        }
        let Ok(pixels) = frame.pixels() else {
            let nothing = vec![NO_NODE; frame.camera.pixels()];
            return Some(Arc::new(NodeMap::pack(frame.camera.width as usize, &nothing)));
        };
        let points = Points::of(frame, pixels, None, 1);
        let made = Arc::new(self.places.shown(&points, graph.nodes()));
        self.made.put(number, made.size(), Arc::clone(&made));
        Some(made)
    }
}

/// The pixels whose whole window, `reach` pixels to each side along both axes, is set; what lies outside counts as set.
fn eroded(mask: &[bool], width: usize, reach: usize) -> Vec<bool> {
    let height = mask.len() / width.max(1);
    let mut along_rows = vec![false; mask.len()];
    for (pixel, set) in along_rows.iter_mut().enumerate() {
        let start = pixel / width * width;
        *set = window(pixel % width, width, reach).all(|column| mask[start + column]);
    }
    (0..mask.len())
        .map(|pixel| window(pixel / width, height, reach).all(|row| along_rows[row * width + pixel % width]))
        .collect()
}

/// Gives pixels without a node that of the nearest pixel in the image; differences in colour count as distance.
fn fill_holes(frame: &Frame, image: &ColorImage, pixels: &mut [u32]) {
    const COLOR: f32 = 2000.0;
    if pixels.iter().all(|&node| node == NO_NODE) || pixels.iter().all(|&node| node != NO_NODE) {
        return;
    }
    let cost = |a: usize, b: usize| 1.0 + COLOR * (image.color(a) - image.color(b)).length_squared();
    let mut queue = BinaryHeap::new();
    let mut reached = vec![f32::INFINITY; pixels.len()];
    for pixel in 0..pixels.len() {
        if pixels[pixel] == NO_NODE {
            continue;
        }
        reached[pixel] = 0.0;
        let is_open = |other: usize| pixels[other] == NO_NODE;
        if frame.camera.beside(pixel).any(is_open) {
            queue.push(Reverse((0_u32, pixel)));
        }
    }
    // Non-negative floats compare like their bits.
    while let Some(Reverse((bits, pixel))) = queue.pop() {
        let distance = f32::from_bits(bits);
        if distance > reached[pixel] {
            continue;
        }
        for other in frame.camera.beside(pixel) {
            let through = distance + cost(pixel, other);
            if through < reached[other] {
                reached[other] = through;
                pixels[other] = pixels[pixel];
                queue.push(Reverse((through.to_bits(), other)));
            }
        }
    }
}
