//! Borders of label maps where depth was estimated: they run along the edges of the image.

use std::collections::VecDeque;
use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;

use super::label_images::LabelImages;
use super::segments::segments;
use super::windows::window;
use super::{NO_NODE, Posterior};
use crate::labels::{ClassId, VOID};
use crate::scene::{Cache, Camera, Frame, ImageEdges};

/// Most pixels in which superpixels are looked for; larger images are reduced by a whole number.
const MOST_PIXELS: usize = 160_000;
/// Scale of the segmentation, in 8-bit steps of colour: a superpixel of n pixels goes on across edges that cost at most
/// this / n more than those inside it.
const SCALE: f32 = 30.0;
/// Fewest pixels of a superpixel.
const FEWEST: u32 = 10;
/// How far from a border superpixels choose the class, and how far borders then move to the image's edges, in pixels.
const MOST_OFF: u8 = 8;
const REACH: u8 = 2;
/// A pixel keeps its class if it lies at least this much as deep inside of it as the deepest pixel in reach.
const DEEP: f32 = 0.6;
/// The highest gradient, in 8-bit steps of colour: between black and white along rows and columns at once. Borders are
/// flooded by levels of it, so many to a step.
const HIGHEST_GRADIENT: f32 = 625.0;
const LEVELS_PER_STEP: f32 = 4.0;
/// Bytes of superpixels that are kept: those of 25 frames or more.
const CACHE_BYTES: usize = 16 << 20;

/// The superpixels of a scene's frames. They follow from the image alone, so that a frame in view needs them once.
#[derive(Debug)]
pub struct Superpixels(Cache<Arc<Vec<u32>>>);

impl Default for Superpixels {
    fn default() -> Self {
        Self(Cache::new(CACHE_BYTES))
    }
}

impl Superpixels {
    /// Those of the frame with this number, as [`superpixels_of`] finds them.
    pub(super) fn of_frame(&self, number: usize, frame: &Frame) -> Arc<Vec<u32>> {
        self.0.get(number).unwrap_or_else(|| {
            let found = Arc::new(superpixels_of(frame));
            self.0
                .put(number, size_of_val(found.as_slice()), Arc::clone(&found));
            found
        })
    }
}

/// The node that every pixel of a frame takes its class from, row-major, [`NO_NODE`] where there is none;
/// `shown` are those that the pixels show; `superpixels` gives the frame's superpixels ([`superpixels_of`]).
///
/// Depth by stereo or from the field is off by some pixels at the edges of things, and so are borders that are looked up
/// along it. Near borders each superpixel (Felzenszwalb and Huttenlocher 2004) takes the class that most of its pixels show, then the
/// borders are flooded from inside the classes, the smallest gradient first (watershed; Meyer 1994). Pixels whose class
/// stays the same keep their node, others take that of a pixel beside them with the new class. Where there are label
/// images, nodes that are sure of their class keep their pixels, and the images may know better
/// ([`LabelImages::nodes_along_edges`]): they do if their borders lie where the colours differ more.
pub(super) fn nodes_along_edges(
    frame: &Frame,
    shown: Vec<u32>,
    posterior: &Posterior,
    images: Option<LabelImages<'_>>,
    superpixels: impl FnOnce() -> Arc<Vec<u32>>,
) -> Vec<u32> {
    let class = |node: u32| posterior.labels.get(node as usize).copied().unwrap_or(VOID);
    let from = |least: Option<u16>| {
        move |node: u32| least.is_some_and(|least| posterior.confidence[node as usize] >= least)
    };
    let mut is_sure = from(images.map(|images| images.import.sure()));
    let mut known = shown
        .iter()
        .filter(|&&node| node != NO_NODE)
        .map(|&node| class(node));
    let first = known.next();
    if known.all(|class| Some(class) == first) {
        return shown;
    }
    let (stride, camera, means) = reduced(frame);
    let colors: Vec<Vec3> = means.iter().copied().map(Vec3::from).collect();
    let middle = |index| shown[frame.camera.middle_of_reduced(stride, index)];
    let reduced: Vec<u32> = (0..camera.pixels()).map(middle).collect();
    let mut nodes = reduced.clone();
    vote(&camera, &superpixels(), &mut nodes, class, is_sure);
    flood(&camera, &|index| colors[index], &mut nodes, class, is_sure, REACH);
    if let Some(images) = images {
        let edges = ImageEdges::new(&means, camera.width as usize);
        let at_borders = |nodes: &[u32]| edges.mean_at(|a, b| class(nodes[a]) != class(nodes[b]));
        let said = images.nodes_along_edges((&camera, stride), &edges, &reduced, &nodes);
        if let Some(said) = said.filter(|said| at_borders(said) > at_borders(&nodes)) {
            nodes = said;
            is_sure = from(None);
        }
    }
    if stride == 1 {
        return nodes;
    }
    let mut full = shown;
    let rows = full.par_chunks_exact_mut(frame.camera.width as usize);
    rows.enumerate().for_each(|(row, pixels)| {
        let start = row / stride as usize * camera.width as usize;
        let blocks = pixels.chunks_mut(stride as usize).zip(&nodes[start..]);
        for (block, &near) in blocks.filter(|&(_, &near)| near != NO_NODE) {
            let chosen = class(near);
            for node in block {
                if *node != near && *node != NO_NODE && class(*node) != chosen && !is_sure(*node) {
                    *node = near;
                }
            }
        }
    });
    let image = frame.color();
    let color = |index| Vec3::from(image.pixel(index).map(f32::from));
    let reach = u8::try_from(stride).unwrap_or(u8::MAX);
    flood(&frame.camera, &color, &mut full, class, is_sure, reach);
    full
}

/// By which number an image with so many pixels is reduced.
fn reduction(pixels: usize) -> u32 {
    (pixels as f32 / MOST_PIXELS as f32).sqrt().ceil().max(1.0) as u32
}

/// By how much a frame is reduced for its superpixels, its camera then, and its colours in 8-bit steps.
fn reduced(frame: &Frame) -> (u32, Camera, Vec<[f32; 3]>) {
    let stride = reduction(frame.camera.pixels());
    (
        stride,
        frame.camera.reduced(stride),
        frame.color().reduced(stride),
    )
}

/// The superpixel of every pixel of a frame's image, which is reduced to at most [`MOST_PIXELS`], counted from 0.
pub(super) fn superpixels_of(frame: &Frame) -> Vec<u32> {
    let (_, camera, means) = reduced(frame);
    let colors: Vec<Vec3> = means.into_iter().map(Vec3::from).collect();
    superpixels(&camera, &smoothed(&camera, &colors))
}

/// Colours after a Gaussian filter with a deviation of half a pixel.
fn smoothed(camera: &Camera, colors: &[Vec3]) -> Vec<Vec3> {
    const BESIDE: f32 = 0.107;
    let width = camera.width as usize;
    let mix = |colors: &[Vec3], at: usize, [before, after]: [usize; 2]| {
        (1.0 - 2.0 * BESIDE) * colors[at] + BESIDE * (colors[before] + colors[after])
    };
    let in_row = |at: usize| {
        let column = at % width;
        let beside = [at - usize::from(column > 0), at + usize::from(column + 1 < width)];
        mix(colors, at, beside)
    };
    let rows: Vec<Vec3> = (0..colors.len()).map(in_row).collect();
    let in_column = |at: usize| {
        let above = if at >= width { at - width } else { at };
        let below = if at + width < rows.len() { at + width } else { at };
        mix(&rows, at, [above, below])
    };
    (0..rows.len()).map(in_column).collect()
}

/// The superpixel of every pixel, counted from 0, by colours in 8-bit steps.
fn superpixels(camera: &Camera, colors: &[Vec3]) -> Vec<u32> {
    let width = camera.width as usize;
    let mut edges: Vec<(f32, u32, u32)> = Vec::with_capacity(4 * colors.len());
    for index in 0..colors.len() {
        let (column, is_last_row) = (index % width, index + width >= colors.len());
        let (is_first, is_last) = (column == 0, column + 1 == width);
        let beside = [
            (!is_last).then_some(index + 1),
            (!is_last_row && !is_first).then(|| index + width - 1),
            (!is_last_row).then_some(index + width),
            (!is_last_row && !is_last).then_some(index + width + 1),
        ];
        for other in beside.into_iter().flatten() {
            edges.push((colors[index].distance(colors[other]), index as u32, other as u32));
        }
    }
    segments(colors.len(), edges, SCALE, FEWEST)
}

/// Gives the pixels of each superpixel that are near a border the class that most of its pixels show.
fn vote(
    camera: &Camera,
    segments: &[u32],
    nodes: &mut [u32],
    class: impl Fn(u32) -> ClassId + Sync,
    is_sure: impl Fn(u32) -> bool,
) {
    let (depths, _) = depths(camera, nodes, &class, MOST_OFF + 1);
    let mut classes: Vec<ClassId> = nodes.iter().map(|&node| class(node)).collect();
    let own = classes.clone();
    classes.sort_unstable();
    classes.dedup();
    let place = |class: &ClassId| classes.partition_point(|other| other < class);
    let count = segments.iter().max().map_or(0, |&last| last as usize + 1);
    let mut votes = vec![0_u32; count * classes.len()];
    for ((&segment, &node), class) in segments.iter().zip(&*nodes).zip(&own) {
        if node != NO_NODE {
            votes[segment as usize * classes.len() + place(class)] += 1;
        }
    }
    // The first of equals.
    let most = |votes: &[u32]| (0..votes.len()).rev().max_by_key(|&at| votes[at]).unwrap_or(0);
    let chosen: Vec<ClassId> = votes
        .chunks_exact(classes.len())
        .map(|votes| classes[most(votes)])
        .collect();
    // The newest node of the chosen class, or the first one before there is any.
    let mut speakers = vec![NO_NODE; count];
    let speaks =
        |at: usize, segment: usize, nodes: &[u32]| nodes[at] != NO_NODE && own[at] == chosen[segment];
    for at in (0..nodes.len()).rev() {
        let segment = segments[at] as usize;
        if speaks(at, segment, nodes) {
            speakers[segment] = nodes[at];
        }
    }
    for at in 0..nodes.len() {
        let segment = segments[at] as usize;
        if speaks(at, segment, nodes) {
            speakers[segment] = nodes[at];
        } else if nodes[at] != NO_NODE && depths[at] <= MOST_OFF && !is_sure(nodes[at]) {
            nodes[at] = speakers[segment];
        }
    }
}

/// Moves the borders of the classes to the edges of the image, at most about `reach` pixels.
fn flood(
    camera: &Camera,
    color: &(impl Fn(usize) -> Vec3 + Sync),
    nodes: &mut [u32],
    class: impl Fn(u32) -> ClassId + Sync,
    is_sure: impl Fn(u32) -> bool + Sync,
    reach: u8,
) {
    let (depths, near) = depths(camera, nodes, &class, (f32::from(reach) / DEEP).ceil() as u8);
    let (width, height) = (camera.width as usize, camera.height as usize);
    let is_shallow = |at: usize| {
        let around = |at: usize, count: usize| window(at, count, usize::from(reach));
        let is_deeper = |&depth: &u8| f32::from(depths[at]) < DEEP * f32::from(depth);
        let mut rows = around(at / width, height).map(|row| row * width);
        let columns = around(at % width, width);
        rows.any(|row| {
            depths[row + columns.start..row + columns.end]
                .iter()
                .any(is_deeper)
        })
    };
    let is_open =
        |&at: &usize| depths[at] < reach && nodes[at] != NO_NODE && is_shallow(at) && !is_sure(nodes[at]);
    let all_open: Vec<usize> = near.into_par_iter().filter(is_open).collect();
    let mut open = vec![false; nodes.len()];
    all_open.iter().for_each(|&at| open[at] = true);
    // In 8-bit steps of colour.
    let gradient = |at: usize| {
        let (column, row) = (at % width, at / width);
        let across = color(at + usize::from(column + 1 < width)) - color(at - usize::from(column > 0));
        let below = at + width * usize::from(row + 1 < height);
        let above = at - width * usize::from(row > 0);
        (across.length_squared() + (color(below) - color(above)).length_squared()).sqrt()
    };
    // The smallest gradient first, of equal ones the first that came.
    let level = |at: usize| (gradient(at) * LEVELS_PER_STEP) as usize;
    let mut queues = vec![VecDeque::new(); (HIGHEST_GRADIENT * LEVELS_PER_STEP) as usize + 1];
    let beside = all_open.into_iter().flat_map(|at| camera.beside(at));
    let mut seeds: Vec<usize> = beside.filter(|&at| !open[at] && nodes[at] != NO_NODE).collect();
    seeds.sort_unstable();
    seeds.dedup();
    for at in seeds {
        queues[level(at)].push_back(at);
    }
    let mut lowest = 0;
    while let Some(queue) = queues.get_mut(lowest) {
        let Some(at) = queue.pop_front() else {
            lowest += 1;
            continue;
        };
        for other in camera.beside(at) {
            if std::mem::take(&mut open[other]) {
                if class(nodes[other]) != class(nodes[at]) {
                    nodes[other] = nodes[at];
                }
                queues[level(other).max(lowest)].push_back(other);
            }
        }
    }
}

/// How many steps along rows and columns every pixel is away from the nearest pixel beside another class, at most `most`;
/// and the pixels that are less away than that.
pub(super) fn depths<'a>(
    camera: &Camera,
    nodes: &'a [u32],
    class: &(impl Fn(u32) -> ClassId + Sync),
    most: u8,
) -> (Vec<u8>, Vec<usize>) {
    let differs = &|a: u32, b: u32| a != b && a != NO_NODE && b != NO_NODE && class(a) != class(b);
    let width = camera.width as usize;
    let starts = (0..nodes.len()).into_par_iter().step_by(width.max(1));
    let at_borders = starts.flat_map_iter(|start| {
        let (row, below) = nodes[start..].split_at(width);
        let with = |others: &'a [u32], gap: usize| {
            let pairs = row.iter().zip(others).zip(start..);
            pairs
                .filter(|((a, b), _)| differs(**a, **b))
                .map(move |(_, at)| [at, at + gap])
        };
        with(&row[1..], 1).chain(with(below, width))
    });
    let at_borders: Vec<[usize; 2]> = at_borders.collect();
    let mut depths = vec![most; nodes.len()];
    let mut near = Vec::new();
    let mut reach = |depth: u8, at: usize, near: &mut Vec<usize>| {
        if depth < depths[at] {
            depths[at] = depth;
            near.push(at);
        }
    };
    for at in at_borders.into_iter().flatten() {
        reach(0, at, &mut near);
    }
    // The pixels of one depth after the other.
    let mut last = 0;
    for depth in 1..most {
        let end = near.len();
        for index in std::mem::replace(&mut last, end)..end {
            for other in camera.beside(near[index]) {
                reach(depth, other, &mut near);
            }
        }
    }
    (depths, near)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::{Class, ImportedLabels, ImportedMap, LabelSet, Trust};
    use crate::scene::testing::wall;
    use crate::scene::{ColorImage, Scene};
    use crate::semantics::testing::{loose, node};
    use crate::semantics::{CERTAIN, NodeMap, Surface, SurfaceImport};

    /// One frame of this size without depth, with these grey values by (column, row).
    fn scene([width, height]: [u32; 2], gray: impl Fn(u32, u32) -> u8) -> Scene {
        let mut scene = wall(1, width, height);
        let rgb = (0..width * height).flat_map(|pixel| [gray(pixel % width, pixel / width); 3]);
        let image = ColorImage::new(width, height, rgb.collect());
        scene.frames[0].set_color(image.unwrap());
        scene.frames[0].set_depth(None);
        scene
    }

    fn along_edges(scene: &Scene, shown: &[u32], labels: &[ClassId]) -> Vec<u32> {
        with_images(scene, shown, labels, None)
    }

    /// The same with label images, which the surface may follow or not.
    fn with_images(
        scene: &Scene,
        shown: &[u32],
        labels: &[ClassId],
        said: Option<&(Surface, SurfaceImport)>,
    ) -> Vec<u32> {
        let frame = &scene.frames[0];
        let posterior = Posterior {
            labels: labels.to_vec(),
            confidence: vec![CERTAIN; labels.len()],
            ..Posterior::default()
        };
        let superpixels = || Arc::new(superpixels_of(frame));
        let images = said.map(|(surface, import)| LabelImages {
            scene,
            surface,
            posterior: &posterior,
            import,
            number: 0,
        });
        nodes_along_edges(frame, shown.to_vec(), &posterior, images, superpixels)
    }

    /// A label image of the frame as votes, on a surface that shows these nodes.
    fn voted(scene: &Scene, shown: &[u32], said: &[ClassId]) -> (Surface, SurfaceImport) {
        let width = scene.frames[0].camera.width as usize;
        let nodes = (0..=shown.iter().max().copied().unwrap()).map(|k| node(k as f32 * Vec3::X));
        let surface = Surface {
            pixels: vec![Arc::new(NodeMap::pack(width, shown))],
            ..loose(nodes.collect(), 0.1)
        };
        let images = ImportedLabels::new(vec![ImportedMap::new(0, said)], Trust::VOTES);
        let labels = LabelSet {
            classes: [4, 5].map(|id| Class::new(id, id.to_string())).into(),
            imported: Some(Arc::new(images)),
            ..LabelSet::default()
        };
        let import = SurfaceImport::new(&surface, &labels).unwrap();
        (surface, import)
    }

    #[test]
    fn borders_that_are_some_pixels_off_follow_the_edges_of_images_of_all_sizes() {
        // The second is reduced by two, and the edge is in the middle of a reduced pixel.
        for (size, edge, off) in [([60, 40], 29, 6), ([600, 300], 301, 12)] {
            let scene = scene(size, |column, _| if column < edge { 60 } else { 90 });
            let columns =
                |border: u32| (0..size[0] * size[1]).map(move |pixel| u32::from(pixel % size[0] >= border));
            for border in [edge - off, edge, edge + off] {
                let shown: Vec<u32> = columns(border).collect();
                let nodes = along_edges(&scene, &shown, &[4, 5]);
                assert!(nodes.into_iter().eq(columns(edge)), "{size:?} from {border}");
            }
        }
    }

    #[test]
    fn a_node_that_label_images_are_sure_of_keeps_its_pixels() {
        for (size, edge, off) in [([60, 40], 29, 6), ([600, 300], 301, 12)] {
            let scene = scene(size, |column, _| if column < edge { 60 } else { 90 });
            let columns = |border: u32| (0..size[0] * size[1]).map(move |pixel| pixel % size[0] >= border);
            let shown: Vec<u32> = columns(edge + off).map(u32::from).collect();
            // They say the same as the surface, so that the frame's own one is no nearer to the edge.
            let said: Vec<ClassId> = columns(edge + off)
                .map(|right| 4 + ClassId::from(right))
                .collect();
            let nodes = with_images(&scene, &shown, &[4, 5], Some(&voted(&scene, &shown, &said)));
            assert!(nodes == shown, "{size:?}");
        }
    }

    #[test]
    fn a_frames_own_label_image_places_its_borders_however_noisy_unless_strokes_say_otherwise() {
        for (size, edge, off) in [([60, 40], 29, 6), ([600, 300], 301, 14)] {
            let scene = scene(size, |column, _| if column < edge { 60 } else { 66 });
            let columns = |border: u32| (0..size[0] * size[1]).map(move |pixel| pixel % size[0] >= border);
            let shown: Vec<u32> = columns(edge + off).map(u32::from).collect();
            // Every third pixel says the other class.
            let noisy = columns(edge)
                .zip(0_u32..)
                .map(|(right, pixel)| right ^ (pixel * 7 % 9 < 3));
            let said: Vec<ClassId> = noisy.map(|right| 4 + ClassId::from(right)).collect();
            let voted = voted(&scene, &shown, &said);
            let nodes = with_images(&scene, &shown, &[4, 5], Some(&voted));
            let wrong = nodes
                .iter()
                .zip(columns(edge))
                .filter(|(node, right)| **node != u32::from(*right));
            assert!(wrong.count() < nodes.len() / 100, "{size:?}");
            // Strokes have made both sides what the other one is in the image.
            assert_eq!(with_images(&scene, &shown, &[5, 4], Some(&voted)), shown);
        }
    }

    #[test]
    fn a_coarse_label_image_moves_no_borders() {
        let size = [60, 40];
        let scene = scene(size, |column, _| if column < 29 { 60 } else { 90 });
        let columns = |border: u32| (0..size[0] * size[1]).map(move |pixel| pixel % size[0] >= border);
        let shown: Vec<u32> = columns(31).map(u32::from).collect();
        let said: Vec<ClassId> = columns(24).map(|right| 4 + ClassId::from(right)).collect();
        let voted = voted(&scene, &shown, &said);
        assert_eq!(with_images(&scene, &shown, &[4, 5], Some(&voted)), shown);
    }

    #[test]
    fn a_small_thing_stays_and_a_border_without_an_edge_moves_little() {
        let in_square = |column: u32, row: u32| (10..16).contains(&column) && (10..16).contains(&row);
        // Its corners are as much the wall's.
        let is_corner = |column: u32, row: u32| [10, 15].contains(&column) && [10, 15].contains(&row);
        let scene = scene(
            [80, 30],
            |column, row| if in_square(column, row) { 200 } else { 60 },
        );
        let shown = |column: u32, row: u32| match in_square(column, row) {
            true => 0,
            false => 1 + u32::from(column >= 55),
        };
        let all: Vec<u32> = (0..80 * 30).map(|pixel| shown(pixel % 80, pixel / 80)).collect();
        let nodes = along_edges(&scene, &all, &[4, 5, 6]);
        for (pixel, node) in (0_u32..).zip(nodes) {
            let (column, row) = (pixel % 80, pixel / 80);
            if column.abs_diff(55) > u32::from(MOST_OFF + REACH) && !is_corner(column, row) {
                assert_eq!(node, shown(column, row), "{column} {row}");
            }
        }
    }

    #[test]
    fn pixels_without_a_node_stay_so_and_say_nothing() {
        let scene = scene([40, 30], |column, _| if column < 25 { 60 } else { 90 });
        let shown: Vec<u32> = (0..40 * 30)
            .map(|pixel| [NO_NODE, 0, 1][(pixel % 40 / 15) as usize])
            .collect();
        let nodes = along_edges(&scene, &shown, &[4, 5]);
        let changed = nodes.iter().zip(&shown).filter(|(a, b)| a != b).count();
        assert_eq!(changed, 5 * 30, "the border moves from column 30 to 25");
        for (node, shown) in nodes.iter().zip(&shown) {
            assert_eq!(*node == NO_NODE, *shown == NO_NODE);
        }
    }

    #[test]
    fn depths_count_the_steps_to_the_nearest_pixel_beside_another_class() {
        let [width, height] = [31, 23];
        let camera = &wall(1, width, height).frames[0].camera;
        // Two nodes of one class, one of another, and pixels without a node between them.
        let of_pixel = |pixel: u32| match [pixel % width, pixel / width] {
            [9..15, 4..9] | [30, 22] => 2,
            [15..18, _] => NO_NODE,
            [x, _] => u32::from(x > 20),
        };
        let nodes: Vec<u32> = (0..width * height).map(of_pixel).collect();
        let class = |node: u32| [4, 4, 5][node as usize];
        let differs = |&a: &u32, &b: &u32| a != NO_NODE && b != NO_NODE && class(a) != class(b);
        let is_border = |at: &usize| {
            camera
                .beside(*at)
                .any(|other| differs(&nodes[*at], &nodes[other]))
        };
        let borders: Vec<usize> = (0..nodes.len()).filter(is_border).collect();
        let steps = |at: usize, other: usize| {
            let width = width as usize;
            (at % width).abs_diff(other % width) + (at / width).abs_diff(other / width)
        };
        let (depths, mut near) = depths(camera, &nodes, &class, 4);
        let expected = (0..nodes.len()).map(|at| borders.iter().map(|&other| steps(at, other)).min());
        assert!(
            depths
                .iter()
                .map(|&depth| usize::from(depth))
                .eq(expected.map(|steps| steps.unwrap().min(4)))
        );
        near.sort_unstable();
        assert!(near.into_iter().eq((0..nodes.len()).filter(|&at| depths[at] < 4)));
    }
}
