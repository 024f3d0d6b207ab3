//! The voxels of a surface, and which of them every pixel of a frame shows.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};
use std::sync::Arc;

use glam::{IVec3, Vec3, Vec3A};
use rustc_hash::FxHashMap;

use super::graph::{Node, SurfaceGraph, cube};
use super::windows::dilated;
use super::{FieldDepth, NO_NODE, NodeMap, pixel_length};
use crate::scene::{Cache, Camera, Frame, Pixels};

/// Rays that meet nothing end on a shell, whose distance is this many sides of the scene's box, in cells of this angle.
const SHELL_DISTANCE: f32 = 3.0;
pub(super) const SHELL_CELL: f32 = 0.05;
/// Bytes of cached node maps of frames that are no keyframes: some hundred of 640 x 480 pixels.
const CACHE_BYTES: usize = 64 << 20;
/// Pixels of a frame, along each axis, for each sample of the surface's depth.
const STRIDE: u32 = 2;
/// Pixels without a length that are at most this far from those with one, along each axis, are filled by colour.
const NARROW: u32 = 5;
/// Fewest points of a frame in the width of a voxel at the median depth, where there are pixels enough.
const POINTS: f32 = 3.5;

/// A voxel, or one of the two that it is parted into: on the surface or on the shell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Voxel {
    pub shell: bool,
    pub index: IVec3,
    /// Of one that is parted: whether this is the brighter half.
    pub half: Option<bool>,
}

/// What parts the colours of a voxel: a channel, and the value above which its pixels are in the brighter half.
#[derive(Clone, Copy, Debug)]
pub(super) struct Parting {
    pub channel: usize,
    pub above: f32,
}

/// Voxel sizes, and the voxel of each pixel.
#[derive(Clone, Debug)]
pub(super) struct Voxels {
    /// Side of a voxel on the surface, in metres.
    pub side: f32,
    /// Distance of the shell, in metres.
    shell: f32,
    /// Width of a pixel at the median depth, in metres, where the images decide the borders of labels; 0 where depth does,
    /// so that every pixel's counts.
    pixel: f32,
    /// The voxels that are parted.
    pub partings: FxHashMap<Voxel, Parting>,
}

/// Pixels of a frame as points of the world: every so many along each axis, the first in the corner.
pub(super) struct Points<'a> {
    pub frame: &'a Frame,
    pub pixels: Pixels,
    /// Pixels per point along each axis.
    step: u32,
    /// The grid of the points, as a smaller image of the frame.
    pub grid: Camera,
    /// Ray length of every point, row-major.
    pub lengths: Vec<f32>,
    /// Unit direction of the ray through every point, row-major.
    directions: Vec<Vec3>,
}

impl<'a> Points<'a> {
    /// Every `step`-th pixel along each axis of a frame with these pixels, by the field's depth where none was measured.
    pub fn of(frame: &'a Frame, pixels: Pixels, field: Option<&FieldDepth>, step: u32) -> Self {
        let camera = &frame.camera;
        let rotation = frame.camera_to_world.matrix3;
        let grid = camera.reduced(step);
        let mut directions = Vec::with_capacity(grid.pixels());
        let mut lengths = Vec::with_capacity(grid.pixels());
        for row in (0..camera.height).step_by(step as usize) {
            for column in (0..camera.width).step_by(step as usize) {
                let direction = rotation * Vec3A::from(camera.pixel_direction(column, row));
                let pixel = (row * camera.width + column) as usize;
                directions.push(direction.normalize().into());
                lengths.push(pixel_length(frame, &pixels, field, pixel));
            }
        }
        Self {
            frame,
            pixels,
            step,
            grid,
            lengths,
            directions,
        }
    }

    /// Row-major index of the pixel that is this point.
    pub fn pixel(&self, point: usize) -> usize {
        let (column, row) = (point as u32 % self.grid.width, point as u32 / self.grid.width);
        (self.step * (row * self.frame.camera.width + column)) as usize
    }

    /// Where the ray of a point ends, seen from the camera.
    pub fn offset(&self, point: usize) -> Vec3 {
        self.lengths[point] * self.directions[point]
    }

    /// The value of the point nearest to each pixel of the frame, by those of the points.
    fn spread(&self, values: Vec<u32>) -> Vec<u32> {
        if self.step == 1 {
            return values;
        }
        let nearest = |pixel: u32, points: u32| ((pixel + self.step / 2) / self.step).min(points - 1);
        let (camera, grid) = (&self.frame.camera, &self.grid);
        let columns: Vec<u32> = (0..camera.width)
            .map(|column| nearest(column, grid.width))
            .collect();
        let mut pixels: Vec<u32> = Vec::with_capacity(camera.pixels());
        for row in 0..camera.height {
            let start = nearest(row, grid.height) * grid.width;
            if row > 0 && start == nearest(row - 1, grid.height) * grid.width {
                pixels.extend_from_within(pixels.len() - columns.len()..);
            } else {
                pixels.extend(columns.iter().map(|column| values[(start + column) as usize]));
            }
        }
        pixels
    }
}

impl Voxels {
    /// Voxels of this side, in a scene whose box has sides of `extent`, in metres; `pixel` is the width of a pixel at the
    /// median depth, in metres, where the images decide the borders of labels, and 0 elsewhere.
    pub fn new(side: f32, extent: f32, pixel: f32) -> Self {
        Self {
            side,
            shell: SHELL_DISTANCE * extent,
            pixel,
            partings: FxHashMap::default(),
        }
    }

    /// Pixels of a frame, along each axis, for each point that is looked up: more than one where voxels are many pixels
    /// wide, as in the images of a phone.
    pub fn step(&self) -> u32 {
        match self.pixel {
            0.0 => 1,
            pixel => (self.side / (POINTS * pixel)).max(1.0) as u32,
        }
    }

    /// Side of a voxel, in metres.
    pub fn side_of(&self, shell: bool) -> f32 {
        if shell { SHELL_CELL * self.shell } else { self.side }
    }

    /// The voxel that a point lies in, and its place; `None` where its length is not known.
    pub fn cell(&self, points: &Points<'_>, point: usize) -> Option<(Voxel, Vec3)> {
        self.cell_at(points, point, points.lengths[point])
    }

    /// The same at this length along the point's ray, which may be infinite or not a number.
    fn cell_at(&self, points: &Points<'_>, point: usize, length: f32) -> Option<(Voxel, Vec3)> {
        if length.is_nan() {
            return None;
        }
        let shell = length.is_infinite();
        let length = if shell { self.shell } else { length };
        let place = points.frame.center() + length * points.directions[point];
        let index = (Vec3A::from(place) / self.side_of(shell)).floor().as_ivec3();
        let half = None;
        let mut cell = Voxel { shell, index, half };
        if let Some(parting) = self.partings.get(&cell) {
            let color = points.pixels.color.color(points.pixel(point));
            cell.half = Some(color[parting.channel] > parting.above);
        }
        Some((cell, place))
    }
}

/// The node of each voxel that has one.
#[derive(Debug)]
pub(super) struct VoxelNodes {
    pub voxels: Voxels,
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

    /// The node that every pixel of a frame with these pixels shows, by the field's depth where none was measured.
    pub fn shown(
        &self,
        frame: &Frame,
        pixels: Pixels,
        field: Option<&FieldDepth>,
        nodes: &[Node],
    ) -> NodeMap {
        let points = Points::of(frame, pixels, field, self.voxels.step());
        // Neighbouring points are often in one voxel.
        let mut last: Option<(Voxel, u32)> = None;
        let node_of = |point| {
            let Some((cell, place)) = self.voxels.cell(&points, point) else {
                return NO_NODE;
            };
            match last {
                Some((same, node)) if same == cell => node,
                _ => {
                    let (node, own) = self.node_of(cell, place, nodes);
                    last = own.then_some((cell, node));
                    node
                }
            }
        };
        let mut own: Vec<u32> = (0..points.lengths.len()).map(node_of).collect();
        self.look_up_wide_holes(&points, nodes, &mut own);
        fill_holes(&points, &mut own);
        let mut own = points.spread(own);
        for pixel in points.pixels.color.invalid() {
            own[pixel] = NO_NODE;
        }
        NodeMap::pack(frame.camera.width as usize, &own)
    }

    /// Fills wide holes in a frame's lengths from the surface, which other frames may have seen there. Narrow holes lie
    /// along the edges of things, where colours tell more than squares of a voxel's size.
    fn look_up_wide_holes(&self, points: &Points<'_>, nodes: &[Node], own: &mut [u32]) {
        let frame = points.frame;
        let color = &points.pixels.color;
        let lengths = points.lengths.iter().enumerate();
        // Pixels outside the image get no node in the end.
        let known: Vec<bool> = lengths
            .map(|(point, length)| !length.is_nan() || !color.is_valid(points.pixel(point)))
            .collect();
        let narrow = NARROW.div_ceil(points.step) as usize;
        let near = dilated(&known, points.grid.width as usize, narrow, |a, b| a | b);
        if !near.contains(&false) {
            return;
        }
        let surface = FieldDepth::of_surface(frame, nodes, self.voxels.side_of(true), STRIDE);
        for point in (0..own.len()).filter(|&point| !near[point]) {
            let length = surface.at(frame, color, points.pixel(point));
            if let Some((cell, place)) = self.voxels.cell_at(points, point, length) {
                own[point] = self.node_of(cell, place, nodes).0;
            }
        }
    }

    /// The node of a voxel and true, or else that of its other half, or of the neighbouring voxel, nearest to the place.
    fn node_of(&self, cell: Voxel, place: Vec3, nodes: &[Node]) -> (u32, bool) {
        if let Some(&node) = self.index.get(&cell) {
            return (node, true);
        }
        let nearest = |reach: i32| {
            let halves = |offset| {
                let index = cell.index + offset;
                let halves = [None, Some(false), Some(true)].into_iter();
                halves.filter_map(move |half| self.index.get(&Voxel { index, half, ..cell }).copied())
            };
            cube(reach).flat_map(halves).min_by(|&a, &b| {
                let gap = |node: u32| nodes[node as usize].position.distance_squared(place);
                gap(a).total_cmp(&gap(b))
            })
        };
        (nearest(0).or_else(|| nearest(1)).unwrap_or(NO_NODE), false)
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
        let made = Arc::new(self.places.shown(frame, pixels, None, graph.nodes()));
        self.made.put(number, made.size(), Arc::clone(&made));
        Some(made)
    }
}

/// Gives points without a node that of the nearest point in the image; differences in colour count as distance.
fn fill_holes(points: &Points<'_>, nodes: &mut [u32]) {
    const COLOR: f32 = 2000.0;
    if nodes.iter().all(|&node| node == NO_NODE) || nodes.iter().all(|&node| node != NO_NODE) {
        return;
    }
    let color = |point: usize| points.pixels.color.color(points.pixel(point));
    let cost = |a: usize, b: usize| 1.0 + COLOR * (color(a) - color(b)).length_squared();
    let mut queue = BinaryHeap::new();
    let mut reached = vec![f32::INFINITY; nodes.len()];
    for point in 0..nodes.len() {
        if nodes[point] == NO_NODE {
            continue;
        }
        reached[point] = 0.0;
        let is_open = |other: usize| nodes[other] == NO_NODE;
        if points.grid.beside(point).any(is_open) {
            queue.push(Reverse((0_u32, point)));
        }
    }
    // Non-negative floats compare like their bits.
    while let Some(Reverse((bits, point))) = queue.pop() {
        let distance = f32::from_bits(bits);
        if distance > reached[point] {
            continue;
        }
        for other in points.grid.beside(point) {
            let through = distance + cost(point, other);
            if through < reached[other] {
                reached[other] = through;
                nodes[other] = nodes[point];
                queue.push(Reverse((through.to_bits(), other)));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::testing::wall;

    #[test]
    fn wide_voxels_are_looked_up_every_few_pixels_and_each_pixel_has_what_its_nearest_point_has() {
        assert_eq!(Voxels::new(0.035, 4.0, 0.01).step(), 1);
        assert_eq!(Voxels::new(0.12, 4.0, 0.01).step(), 3);
        assert_eq!(Voxels::new(0.12, 4.0, 0.0).step(), 1);
        let scene = wall(1, 20, 11);
        let frame = &scene.frames[0];
        let points = Points::of(frame, frame.pixels().unwrap(), None, 3);
        assert_eq!((points.grid.width, points.grid.height), (7, 4));
        let pixels = (0..28).map(|point| points.pixel(point) as u32).collect();
        for (pixel, nearest) in points.spread(pixels).into_iter().enumerate() {
            let of = |index: usize| [index % 20, index / 20];
            let (own, nearest) = (of(pixel), of(nearest as usize));
            assert!(nearest.iter().all(|at| at.is_multiple_of(3)), "{pixel}");
            let is_near = (0..2).all(|axis| own[axis].abs_diff(nearest[axis]) <= 1);
            assert!(is_near, "{own:?} {nearest:?}");
        }
        let depth = frame.depth().unwrap();
        for (point, &length) in points.lengths.iter().enumerate() {
            assert_eq!(Some(length), depth.ray_length(points.pixel(point)));
        }
    }
}
