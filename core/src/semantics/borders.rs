//! Borders of label maps at the resolution of the image: voxels are some pixels wide, and colours and measured
//! depth tell which of them a pixel beside a border belongs to.

use std::ops::Range;

use glam::Vec3;
use rayon::prelude::*;

use super::windows::window;
use super::{NO_NODE, Node};
use crate::labels::{ClassId, VOID};
use crate::scene::{DepthMap, Frame};

/// Pixels of the window to each side.
const REACH: usize = 2;
/// How far apart pixels, colours and ray lengths may be: in pixels, in units of the colour (channels in 0..=1)
/// and as a share of the length.
const PIXELS: f32 = 1.5;
const COLOR: f32 = 0.07;
const LENGTH: f32 = 0.014;
/// Largest share of the exponent by lengths, so that colours still count where a length is wrong.
const MOST_FOR_LENGTH: f32 = 9.0;

/// The node that every pixel of a frame takes its class from, row-major, [`NO_NODE`] where there is none;
/// `depth` is its measured depth, `shown` are the nodes that the pixels show, of these `nodes`, and `labels` the classes
/// of the nodes.
///
/// Near borders, where a window of 5 x 5 pixels shows several classes, a pixel has the class with the largest sum of
///
/// ```text
/// exp(-(|dx|^2 / 1.5^2 + |dcolour|^2 / 0.07^2 + (dlength / length / 0.014)^2) / 2)
/// ```
///
/// over the window (a joint bilateral filter: Petschnigg et al. 2004, Eisemann and Durand 2004), and the node of the
/// pixel that weighs most in that class. Everywhere else, and where the class stays the same, it keeps its own node.
pub(super) fn nodes_at_borders(
    frame: &Frame,
    depth: &DepthMap,
    shown: &[u32],
    nodes: &[Node],
    labels: &[ClassId],
) -> Vec<u32> {
    // Pixels without a node have no class.
    let class = |&node: &u32| labels.get(node as usize).copied().unwrap_or(VOID);
    let classes: Vec<ClassId> = shown.iter().map(class).collect();
    let (color, center) = (frame.color(), frame.center());
    // Measured, or that of the node's centre.
    let length = |pixel: usize| {
        let of_node = || Some(nodes.get(shown[pixel] as usize)?.position.distance(center));
        depth.ray_length(pixel).or_else(of_node).unwrap_or(f32::NAN)
    };
    let sights = (0..shown.len()).map(|pixel| (color.color(pixel), length(pixel)));
    let around = Around {
        sights: sights.collect(),
        shown,
        classes: &classes,
        width: frame.camera.width as usize,
        height: frame.camera.height as usize,
    };
    let beside = around.beside_borders();
    let node = |(pixel, &own): (usize, &u32)| match beside[pixel] && own != NO_NODE {
        true => around.node_of(pixel),
        false => own,
    };
    shown
        .par_iter()
        .enumerate()
        .with_min_len(4096)
        .map(node)
        .collect()
}

/// The votes of a window's pixels for one class.
struct Vote {
    class: ClassId,
    sum: f32,
    /// The largest weight of a pixel, and its node.
    most: f32,
    node: u32,
}

/// A frame and what its pixels show.
struct Around<'a> {
    /// The colour of every pixel, and its ray length in metres, which counts where it has a node.
    sights: Vec<(Vec3, f32)>,
    /// The node of every pixel, and its class.
    shown: &'a [u32],
    classes: &'a [ClassId],
    width: usize,
    height: usize,
}

impl Around<'_> {
    /// Whether the window around a pixel shows several classes, for every pixel.
    fn beside_borders(&self) -> Vec<bool> {
        let (classes, width, height) = (self.classes, self.width, self.height);
        let mut beside = vec![false; classes.len()];
        // A window shows several classes where it holds two neighbouring pixels that differ.
        let mut mark = |columns: Range<usize>, rows: Range<usize>| {
            for row in rows.start..rows.end.min(height) {
                beside[row * width + columns.start..row * width + columns.end.min(width)].fill(true);
            }
        };
        for row in 0..height {
            for column in 0..width {
                let class = classes[row * width + column];
                let all = |at: usize| at.saturating_sub(REACH)..at + REACH + 1;
                // The windows that reach both this pixel and the next.
                let both = |at: usize| (at + 1).saturating_sub(REACH)..at + REACH + 1;
                if column + 1 < width && classes[row * width + column + 1] != class {
                    mark(both(column), all(row));
                }
                if row + 1 < height && classes[(row + 1) * width + column] != class {
                    mark(all(column), both(row));
                }
            }
        }
        beside
    }

    /// The node that a pixel takes its class from.
    fn node_of(&self, pixel: usize) -> u32 {
        let own = self.shown[pixel];
        // First, so that it wins where votes are equal.
        let mut votes = vec![Vote {
            class: self.classes[pixel],
            sum: 0.0,
            most: f32::INFINITY,
            node: own,
        }];
        let (color, length) = self.sights[pixel];
        let per_length = (LENGTH * length).recip();
        let (column, row) = (pixel % self.width, pixel / self.width);
        for y in window(row, self.height, REACH) {
            for x in window(column, self.width, REACH) {
                let other = y * self.width + x;
                let node = self.shown[other];
                if node == NO_NODE {
                    continue;
                }
                let pixels = (x.abs_diff(column).pow(2) + y.abs_diff(row).pow(2)) as f32 / PIXELS.powi(2);
                let (other_color, other_length) = self.sights[other];
                let colors = (other_color - color).length_squared() / COLOR.powi(2);
                let lengths = ((other_length - length) * per_length).powi(2);
                let weight = (-0.5 * (pixels + colors + lengths.min(2.0 * MOST_FOR_LENGTH))).exp();
                let class = self.classes[other];
                match votes.iter_mut().find(|vote| vote.class == class) {
                    Some(vote) => {
                        vote.sum += weight;
                        if weight > vote.most {
                            (vote.most, vote.node) = (weight, node);
                        }
                    }
                    None => votes.push(Vote {
                        class,
                        sum: weight,
                        most: weight,
                        node,
                    }),
                }
            }
        }
        // The last of equals in the reverse order is the first.
        let largest = votes.iter().rev().max_by(|a, b| a.sum.total_cmp(&b.sum));
        largest.map_or(own, |vote| vote.node)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::scene::testing::wall;
    use crate::scene::{ColorImage, Scene};
    use crate::semantics::testing::{loose, node};
    use crate::semantics::{NodeMap, Surface};

    const SIZE: [u32; 2] = [24, 9];
    /// The last column of the blocks left of the border, which lie on blocks of three columns.
    const BLOCKS_END: u32 = 12;

    /// One frame whose pixels show nodes three columns wide at two metres, of class 4 left of column 12 and of
    /// class 5 from there on.
    fn blocks() -> (Scene, Surface, Vec<ClassId>) {
        let scene = wall(1, SIZE[0], SIZE[1]);
        let frame = &scene.frames[0];
        let shown: Vec<u32> = (0..SIZE[0] * SIZE[1]).map(|pixel| pixel % SIZE[0] / 3).collect();
        let nodes: Vec<Node> = (0..SIZE[0] / 3)
            .map(|block| (4 * SIZE[0] + 3 * block + 1) as usize)
            .map(|middle| node(frame.center() + 2.0 * frame.ray_direction(middle)))
            .collect();
        let surface = Surface {
            pixels: vec![Arc::new(NodeMap::pack(SIZE[0] as usize, &shown))],
            ..loose(nodes, 0.3)
        };
        let labels = (0..SIZE[0] / 3)
            .map(|node| if 3 * node < BLOCKS_END { 4 } else { 5 })
            .collect();
        (scene, surface, labels)
    }

    fn paint(scene: &mut Scene, gray: impl Fn(u32, u32) -> u8) {
        let pixels = (0..SIZE[0] * SIZE[1]).map(|pixel| gray(pixel % SIZE[0], pixel / SIZE[0]));
        let rgb = pixels.flat_map(|value| [value; 3]).collect();
        scene.frames[0].set_color(ColorImage::new(SIZE[0], SIZE[1], rgb).unwrap());
    }

    fn nodes_of(scene: &Scene, surface: &Surface, labels: &[ClassId]) -> Vec<u32> {
        let shown = surface.pixels[0].unpack();
        let frame = &scene.frames[0];
        nodes_at_borders(
            frame,
            &frame.depth().unwrap(),
            &shown,
            surface.graph.nodes(),
            labels,
        )
    }

    #[test]
    fn a_border_follows_the_colours_of_the_image_or_else_the_measured_depth() {
        for (edge, by_depth) in [(11, false), (12, false), (13, false), (13, true)] {
            let (mut scene, surface, labels) = blocks();
            let left = |pixel: u32| pixel % SIZE[0] < edge;
            let lengths: Vec<f32> = (0..SIZE[0] * SIZE[1])
                .map(|pixel| if by_depth && !left(pixel) { 3.0 } else { 2.0 })
                .collect();
            let depth = DepthMap::from_ray_lengths(SIZE[0], &lengths);
            scene.frames[0].set_depth(Some(depth));
            paint(&mut scene, |x, _| match left(x) {
                _ if by_depth => 128,
                true => 60,
                false => 200,
            });
            for (pixel, node) in (0..).zip(nodes_of(&scene, &surface, &labels)) {
                let expected = if left(pixel) { 4 } else { 5 };
                assert_eq!(labels[node as usize], expected, "edge {edge} pixel {pixel}");
            }
        }
    }

    #[test]
    fn away_from_borders_and_on_plain_ones_every_pixel_keeps_its_node() {
        let (mut scene, surface, mut labels) = blocks();
        // Stripes that no border of classes is near.
        paint(&mut scene, |x, _| if x < 6 && x % 2 == 0 { 20 } else { 128 });
        let shown = surface.pixels[0].unpack();
        assert_eq!(nodes_of(&scene, &surface, &labels), shown);
        labels.fill(4);
        paint(&mut scene, |x, y| (37 * x + 91 * y) as u8);
        assert_eq!(nodes_of(&scene, &surface, &labels), shown);
    }

    #[test]
    fn pixels_without_a_node_stay_so_and_say_nothing() {
        let (mut scene, mut surface, labels) = blocks();
        paint(&mut scene, |x, _| if x < BLOCKS_END + 1 { 60 } else { 200 });
        let mut shown = surface.pixels[0].unpack();
        for (pixel, node) in shown.iter_mut().enumerate() {
            if pixel % SIZE[0] as usize <= 11 {
                *node = NO_NODE;
            }
        }
        surface.pixels[0] = Arc::new(NodeMap::pack(SIZE[0] as usize, &shown));
        // Column 12 has the colour of the left, where no pixel has a class.
        assert_eq!(nodes_of(&scene, &surface, &labels), shown);
    }
}
