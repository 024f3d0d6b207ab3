//! The surface that the frames see, fused to voxels, and which voxel every pixel shows.

use std::sync::Arc;

use glam::{IVec3, Vec3};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::graph::{Node, SurfaceGraph};
use super::voxels::{OtherFrames, Parting, Points, Voxel, VoxelNodes, Voxels};
use super::{FieldDepth, Look, NO_NODE, NodeMap, Superpixels, pixel_length};
use crate::features::{COMPONENTS, FrameFeatures, ImageFeatures, normalise};
use crate::field::median;
use crate::scene::{Pixels, Scene};

/// How depth becomes voxels.
struct Fusion {
    /// Side of a voxel in footprints of a pixel at the median depth.
    footprints: f32,
    /// Pixels that must show a voxel for it to count.
    fewest_pixels: f32,
    /// Standard deviation of a channel, in 0..=1, from which a voxel is parted by it.
    spread: f32,
    /// Nearest neighbours that a node chooses. With more of them, paths find their way around more borders.
    neighbours: usize,
}
/// Measured depth.
const MEASURED: Fusion = Fusion {
    footprints: 2.5,
    fewest_pixels: 3.0,
    spread: f32::INFINITY,
    neighbours: 5,
};
/// Estimated depth differs between frames: thinner voxels would hold several layers of it, and what few pixels show is
/// a mistake, not a thing. It joins what lies behind one another, the legs of a chair and the floor, which colours tell
/// apart; where they part voxels, neighbours lie twice as dense.
const ESTIMATED: Fusion = Fusion {
    footprints: 3.5,
    fewest_pixels: 9.0,
    spread: 0.06,
    neighbours: 8,
};
/// Smallest side of a voxel in multiples of the noise of the measured depth: a thinner one would hold one layer of it.
const VOXEL_NOISES: f32 = 20.0;
/// Noise enlarges a voxel by this factor at most, so that small things are kept that many views can tell apart.
const MOST_GROWTH: f32 = 2.0;
/// Smallest and largest side of a voxel, in metres.
const VOXEL_RANGE: (f32, f32) = (0.02, 0.5);
/// Most nodes; a larger scene gets larger voxels.
const MOST_NODES: usize = 300_000;
/// In longer captures, and where all pixels would be more than this, every second one along each axis is fused, and every
/// fourth where those would be, too.
const ALL_PIXELS_FRAMES: usize = 40;
const MOST_FUSED_PIXELS: usize = 32_000_000;
/// How far from a point its normal looks, in pixels, along each axis; where points are farther apart, to the next ones.
const NORMAL_REACH: u32 = 2;

/// Every so many pixels of a frame say what a pretrained network sees in their region: no divisor of usual widths.
const FEATURE_STEP: usize = 7;

/// The surface graph of a scene and the node that each pixel of each frame shows.
#[derive(Clone, Debug, Default)]
pub struct Surface {
    /// The graph.
    pub graph: SurfaceGraph,
    /// What its regions look like.
    pub look: Arc<Look>,
    /// For each keyframe, the node of every pixel; empty for other frames ([`Surface::nodes_of`] has theirs).
    pub pixels: Vec<Arc<NodeMap>>,
    /// The frames that are no keyframes; `None` where all are.
    pub others: Option<Arc<OtherFrames>>,
    /// Side of a voxel, in metres.
    pub voxel: f32,
    /// Whether measured depth is so exact that its edges lie where the images show them; that of a sensor is not.
    pub is_sharp: bool,
    /// The superpixels of the frames that were looked at last.
    pub superpixels: Arc<Superpixels>,
}

/// Sums over the points of a voxel.
#[derive(Clone, Copy, Default)]
struct Sum {
    position: Vec3,
    color: Vec3,
    /// Of the squares of each channel.
    squares: Vec3,
    normal: Vec3,
    pixels: f32,
}

impl Sum {
    fn add(&mut self, other: &Self) {
        self.position += other.position;
        self.color += other.color;
        self.squares += other.squares;
        self.normal += other.normal;
        self.pixels += other.pixels;
    }

    /// Where the colours part in the channel that differs most, if its standard deviation is this large, and if either
    /// half may have enough pixels to count.
    fn parting(&self, fusion: &Fusion) -> Option<Parting> {
        let mean = self.color / self.pixels;
        let variance = self.squares / self.pixels - mean * mean;
        let channel = variance.max_position();
        let parts = self.pixels >= 2.0 * fusion.fewest_pixels && variance[channel] > fusion.spread.powi(2);
        let above = mean[channel];
        parts.then_some(Parting { channel, above })
    }
}

/// A scene with the field's depth where none was measured. The lengths of a frame's pixels are computed whenever they
/// are needed: kept, they would take more memory than the scene.
#[derive(Clone, Copy)]
struct Lengths<'a> {
    scene: &'a Scene,
    field: &'a [Option<Arc<FieldDepth>>],
}

impl Lengths<'_> {
    fn field_of(&self, frame: usize) -> Option<&FieldDepth> {
        self.field.get(frame).and_then(Option::as_deref)
    }

    fn fusion(&self) -> Fusion {
        match self.scene.has_depth() {
            true => MEASURED,
            false => ESTIMATED,
        }
    }

    /// Colours and measured depth of a keyframe.
    fn pixels_of(&self, frame: usize) -> Pixels {
        let own = &self.scene.frames[frame];
        let (color, depth) = (own.color(), own.depth());
        Pixels { color, depth }
    }
}

impl Surface {
    /// Whether a node is on the shell around the scene, which rays that meet nothing show.
    pub fn is_on_shell(&self, node: &Node) -> bool {
        node.voxel > 1.001 * self.voxel
    }

    /// The node of every pixel of a frame, computed now for one that is no keyframe unless it is cached. Empty for a
    /// frame that the surface does not know.
    pub fn nodes_of(&self, frame: usize) -> Arc<NodeMap> {
        let others = self.others.as_ref();
        others
            .and_then(|others| others.nodes_of(frame, &self.graph))
            .or_else(|| self.pixels.get(frame).cloned())
            .unwrap_or_default()
    }

    /// The node under each of these pixels of a frame, row-major indices; `None` where it shows none.
    pub fn nodes_at(&self, frame: usize, pixels: &[u32]) -> Vec<Option<u32>> {
        let map = self.nodes_of(frame);
        // A lookup reads half a row on average; for more pixels, unpacking everything once is less work.
        if pixels.len() > 2 * map.len() / map.width().max(1) {
            let nodes = map.unpack();
            let known = pixels.iter().map(|&pixel| nodes.get(pixel as usize).copied());
            return known.map(|node| node.filter(|&node| node != NO_NODE)).collect();
        }
        pixels.iter().map(|&pixel| map.node(pixel as usize)).collect()
    }

    /// Adds to the look of the regions what a pretrained network sees in them: the mean of their pixels in all frames that
    /// it has looked at.
    pub(crate) fn add_features(&mut self, scene: &Scene, features: &ImageFeatures) {
        let of_frame = |(frame, features): &(usize, FrameFeatures)| {
            let camera = &scene.frames[*frame].camera;
            let mut sums = vec![0.0; self.look.len() * COMPONENTS];
            let nodes = self.nodes_of(*frame).unpack();
            for (pixel, &node) in nodes.iter().enumerate().step_by(FEATURE_STEP) {
                if node != NO_NODE {
                    let sum =
                        &mut sums[self.look.region(node as usize) as usize * COMPONENTS..][..COMPONENTS];
                    let (x, y) = (pixel as u32 % camera.width, pixel as u32 / camera.width);
                    let share = |at: u32, size: u32| (at as f32 + 0.5) / size as f32;
                    features.add_at(share(x, camera.width), share(y, camera.height), sum);
                }
            }
            sums
        };
        let mut means = vec![0.0; self.look.len() * COMPONENTS];
        for block in features.frames.chunks(16) {
            for sums in block.par_iter().map(of_frame).collect::<Vec<_>>() {
                means.iter_mut().zip(sums).for_each(|(mean, sum)| *mean += sum);
            }
        }
        means.chunks_exact_mut(COMPONENTS).for_each(normalise);
        Arc::make_mut(&mut self.look).features = Some(means);
    }

    /// Fuses the keyframes' depths (measured, or else the field's) to a graph; `None` where no pixel of any
    /// frame has a depth.
    ///
    /// `extent` is the side of the scene's box, in metres.
    pub fn build(scene: &Scene, field: &[Option<Arc<FieldDepth>>], extent: f32) -> Option<Self> {
        Self::build_scaled(scene, field, extent, 1.0)
    }

    /// The same with about `size` times the chosen number of voxels: their side is divided by the root of `size`, also
    /// beyond the bounds of the choice.
    pub fn build_scaled(
        scene: &Scene,
        field: &[Option<Arc<FieldDepth>>],
        extent: f32,
        size: f32,
    ) -> Option<Self> {
        let lengths = Lengths { scene, field };
        let pixel = pixel_width(lengths)?;
        let (side, is_sharp) = voxel_side(lengths, pixel);
        let follows_depth = scene.has_depth() && is_sharp;
        let mut voxels = Voxels::new(side, extent, if follows_depth { 0.0 } else { pixel });
        let (stride, fusion) = (stride(scene), lengths.fusion());
        let fused = |voxels: &Voxels| {
            let sums = fuse(voxels, lengths, stride);
            let parting = |(&cell, sum): (&Voxel, &Sum)| Some((cell, sum.parting(&fusion)?));
            let partings: FxHashMap<Voxel, Parting> = sums.iter().filter_map(parting).collect();
            (sums, partings)
        };
        let (mut sums, mut partings) = fused(&voxels);
        loop {
            let nodes = sums.len() + partings.len();
            if nodes <= MOST_NODES {
                break;
            }
            voxels.side *= (nodes as f32 / MOST_NODES as f32).sqrt().max(1.05);
            drop(sums);
            (sums, partings) = fused(&voxels);
        }
        if size != 1.0 {
            voxels.side /= size.sqrt();
            drop(sums);
            (sums, partings) = fused(&voxels);
        }
        if !partings.is_empty() {
            voxels.partings = partings;
            drop(sums);
            sums = fuse(&voxels, lengths, stride);
        }
        Some(Self::from_sums(voxels, is_sharp, sums, lengths))
    }

    fn from_sums(voxels: Voxels, is_sharp: bool, sums: FxHashMap<Voxel, Sum>, lengths: Lengths<'_>) -> Self {
        let scene = lengths.scene;
        let keyframes = scene.keyframes();
        let mut sums: Vec<(Voxel, Sum)> = sums.into_iter().collect();
        // A fixed order, whatever order the frames were fused in: by cubes and the cubes in them, so that floods find
        // neighbours in the processor's cache.
        let cubes = |index: IVec3| [6, 4, 2, 0].map(|bits: i32| (index >> bits).to_array());
        sums.sort_by_cached_key(|(cell, _)| (cell.shell, cubes(cell.index), cell.half));
        let fusion = lengths.fusion();
        let fewest = fusion.fewest_pixels.min(keyframes.len() as f32);
        sums.retain(|(_, sum)| sum.pixels >= fewest);
        let places = VoxelNodes::new(voxels, sums.iter().map(|(cell, _)| *cell));
        let nodes = sums
            .into_iter()
            .map(|(cell, sum)| Node {
                position: sum.position / sum.pixels,
                color: sum.color / sum.pixels,
                normal: sum.normal.normalize_or_zero(),
                pixels: sum.pixels,
                voxel: places.voxels.side_of(cell.shell),
            })
            .collect();
        let graph = SurfaceGraph::new(nodes, fusion.neighbours);
        let shown: Vec<Arc<NodeMap>> = keyframes
            .par_iter()
            .map(|&number| {
                let (frame, pixels) = (&scene.frames[number], lengths.pixels_of(number));
                Arc::new(places.shown(frame, pixels, lengths.field_of(number), graph.nodes()))
            })
            .collect();
        let mut pixels = vec![Arc::default(); scene.frames.len()];
        for (number, shown) in keyframes.into_iter().zip(shown) {
            pixels[number] = shown;
        }
        let others = scene.frames.iter().enumerate();
        let others = others.filter(|(_, frame)| !frame.is_keyframe());
        let others = others.map(|(number, frame)| (number, frame.without_points()));
        let up: Vec3 = scene
            .frames
            .iter()
            .map(|frame| -Vec3::from(frame.camera_to_world.matrix3.y_axis))
            .sum();
        let voxel = places.voxels.side;
        Self {
            look: Arc::new(Look::new(&graph, up)),
            graph,
            pixels,
            others: OtherFrames::new(others.collect(), places),
            voxel,
            is_sharp,
            superpixels: Arc::default(),
        }
    }
}

/// Sums of the points of all keyframes by voxel; every `stride`-th pixel along each axis counts, or fewer where voxels are
/// wide.
fn fuse(voxels: &Voxels, lengths: Lengths<'_>, stride: u32) -> FxHashMap<Voxel, Sum> {
    // Normals look two pixels far: with an even stride only every second one is ever read.
    let step = voxels.step().max(if stride.is_multiple_of(2) { 2 } else { 1 });
    let every = stride.div_ceil(step);
    let share = (step * every).pow(2) as f32;
    let of_frame = |number: usize| {
        let (frame, pixels) = (&lengths.scene.frames[number], lengths.pixels_of(number));
        let points = Points::of(frame, pixels, lengths.field_of(number), step);
        let reach = (NORMAL_REACH / step).max(1);
        let mut sums: Vec<(Voxel, Sum)> = Vec::new();
        let mut places: FxHashMap<Voxel, usize> = FxHashMap::default();
        // Neighbouring points are often in one voxel.
        let mut last: Option<(Voxel, usize)> = None;
        for row in (0..points.grid.height).step_by(every as usize) {
            for column in (0..points.grid.width).step_by(every as usize) {
                let point = (row * points.grid.width + column) as usize;
                if let Some((cell, place)) = voxels.cell(&points, point) {
                    let own = match last {
                        Some((same, own)) if same == cell => own,
                        _ => *places.entry(cell).or_insert_with(|| {
                            sums.push((cell, Sum::default()));
                            sums.len() - 1
                        }),
                    };
                    last = Some((cell, own));
                    let color = points.pixels.color.color(points.pixel(point));
                    sums[own].1.add(&Sum {
                        position: share * place,
                        color: share * color,
                        squares: share * color * color,
                        normal: share * normal(&points, [column, row], reach),
                        pixels: share,
                    });
                }
            }
        }
        sums
    };
    // In blocks, so that the sums come together in the same order with any number of threads.
    let mut all: FxHashMap<Voxel, Sum> = FxHashMap::default();
    let frames = lengths.scene.keyframes();
    for block in frames.chunks(16) {
        let parts: Vec<_> = block.par_iter().map(|&number| of_frame(number)).collect();
        for part in parts {
            for (cell, sum) in part {
                all.entry(cell).or_default().add(&sum);
            }
        }
    }
    all
}

/// Pixels along each axis per fused pixel: fewer are fused of each frame where there are many frames or pixels.
fn stride(scene: &Scene) -> u32 {
    let keyframes = scene.keyframes();
    let pixels: usize = keyframes
        .iter()
        .map(|&frame| scene.frames[frame].camera.pixels())
        .sum();
    match pixels {
        0..=MOST_FUSED_PIXELS if keyframes.len() <= ALL_PIXELS_FRAMES => 1,
        _ if pixels / 4 <= MOST_FUSED_PIXELS => 2,
        _ => 4,
    }
}

/// Unit normal of the surface at a point, towards the camera, from the points `reach` away; zero where one of them is
/// missing or lies on another surface.
fn normal(points: &Points<'_>, [column, row]: [u32; 2], reach: u32) -> Vec3 {
    let (width, height) = (points.grid.width, points.grid.height);
    if column < reach || row < reach || column + reach >= width || row + reach >= height {
        return Vec3::ZERO;
    }
    let at = |column: u32, row: u32| {
        let point = (row * width + column) as usize;
        (points.lengths[point], points.offset(point))
    };
    let (length, centre) = at(column, row);
    let around = [
        at(column + reach, row),
        at(column - reach, row),
        at(column, row + reach),
        at(column, row - reach),
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

/// Width of a pixel at the median depth, in metres; `None` where there is no depth at all.
fn pixel_width(lengths: Lengths<'_>) -> Option<f32> {
    let mut widths: Vec<f32> = Vec::new();
    for number in lengths.scene.keyframes() {
        let frame = &lengths.scene.frames[number];
        let (own, field) = (lengths.pixels_of(number), lengths.field_of(number));
        let pixels = frame.camera.pixels();
        let sampled = (0..pixels).step_by((pixels / 100).max(1) | 1);
        let known = sampled
            .map(|pixel| pixel_length(frame, &own, field, pixel))
            .filter(|length| length.is_finite());
        widths.extend(known.map(|length| length / frame.camera.fx));
    }
    median(widths)
}

/// Side of a voxel from the width of a pixel at the median depth and from the noise of measured depth, and whether there is
/// so little noise that it does not matter.
fn voxel_side(lengths: Lengths<'_>, pixel: f32) -> (f32, bool) {
    let side = lengths.fusion().footprints * pixel;
    let noisy = VOXEL_NOISES * depth_noise(lengths.scene);
    let grown = side.max(noisy.min(MOST_GROWTH * side));
    (grown.clamp(VOXEL_RANGE.0, VOXEL_RANGE.1), noisy <= side)
}

/// Median distance of measured depth from the mean of its two neighbours in the row, over all frames, in metres; 0
/// without measured depth.
fn depth_noise(scene: &Scene) -> f32 {
    let mut gaps = Vec::new();
    for frame in scene.frames.iter().filter(|frame| frame.is_keyframe()) {
        let Some(depth) = frame.depth() else { continue };
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
