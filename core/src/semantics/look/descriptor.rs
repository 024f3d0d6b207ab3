//! What a region of a surface looks like: itself, and what adjoins it.

use glam::Vec3;
use rayon::prelude::*;

use crate::labels::RoomPart;
use crate::semantics::graph::SurfaceGraph;
use crate::semantics::kinds::Room;

/// Largest gap in colour, the CIELAB distance at half of it, and the share of it for differences in lightness.
const COLOR: f32 = 4.0;
const HALF_COLOR: f32 = 10.0;
const LIGHTNESS_SHARE: f32 = 0.6;
/// Gaps between upright and level, and between the bottom and the top of the scene: of the regions, and of what adjoins
/// them.
const FACING: f32 = 1.4;
const HEIGHT: f32 = 4.0;
/// Gap between flat and round.
const FLATNESS: f32 = 2.5;
/// Gaps between regions of which one reaches e times as far, upwards and across; lengths are at least these metres.
const TALL: f32 = 0.75;
const WIDE: f32 = 0.5;
const SHORTEST: f32 = 0.02;
/// Gap between regions of which one costs about e times as much to leave.
const BORDER: f32 = 0.7;
/// Gap between what adjoins surfaces with nothing behind them, as walls, floor and ceiling, and with the whole scene.
const BEHIND: f32 = 2.5;
/// What is at least so many metres behind a surface counts, of so many nodes that stand for all, evenly over the pixels.
const FAR_BEHIND: f32 = 0.3;
const LANDMARKS: usize = 1000;

/// Means over the nodes of a region.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Descriptor {
    /// CIELAB (D65) colour, the lightness scaled by its share.
    color: Vec3,
    place: Place,
    /// Length of the mean normal: 1 where it is flat.
    flatness: f32,
    /// Logarithms of its standard deviations upwards and across, in metres.
    tall: f32,
    wide: f32,
    /// Logarithm of 1 + the mean cost of the edges that lead out of it.
    border: f32,
    /// What adjoins it.
    around: Place,
    /// Logarithms of the numbers of its nodes, and of the pixels of all frames that show it.
    pub(super) nodes: f32,
    pub(super) pixels: f32,
    /// How much it looks like each part of a room, in the order of [`RoomPart`]: 1 where it is as flat, as level or upright,
    /// and as high as that part, with nothing behind it; at least 0.
    room: [f32; RoomPart::ALL.len()],
}

/// Where a part of the surface is.
#[derive(Clone, Copy, Debug, Default)]
struct Place {
    /// |n . up| of the nodes with a normal: 1 where it is level, 0 where it is upright.
    facing: f32,
    /// Height, as a share of that of the scene.
    height: f32,
    /// Share of the scene that lies behind it.
    behind: f32,
}

impl Descriptor {
    /// How unlike each other two regions look.
    pub(super) fn unlike(&self, other: &Self) -> f32 {
        let color = self.color.distance(other.color);
        COLOR * color / (HALF_COLOR + color)
            + self.place.unlike(&other.place)
            + FLATNESS * (self.flatness - other.flatness).abs()
            + TALL * (self.tall - other.tall).abs()
            + WIDE * (self.wide - other.wide).abs()
            + BORDER * (self.border - other.border).abs()
            + self.around.unlike(&other.around)
            + BEHIND * (self.around.behind - other.around.behind).abs()
    }

    /// How much it looks like the likest of these parts of a room, from 0 to 1.
    pub(super) fn like_room(&self, parts: Room) -> f32 {
        let likes = self.room.iter().zip(parts).filter(|&(_, counts)| counts);
        likes.map(|(&like, _)| like).fold(0.0, f32::max)
    }

    /// What [`Self::room`] is.
    fn like_part(&self, part: RoomPart) -> f32 {
        let (facing, height) = match part {
            RoomPart::Floor => (1.0, 0.0),
            RoomPart::Ceiling => (1.0, 1.0),
            RoomPart::Wall => (0.0, self.place.height),
        };
        let place = Place {
            facing,
            height,
            behind: 0.0,
        };
        let unlike =
            self.place.unlike(&place) + BEHIND * self.place.behind + FLATNESS * (1.0 - self.flatness);
        (1.0 - unlike).max(0.0)
    }
}

impl Place {
    fn unlike(&self, other: &Self) -> f32 {
        FACING * (self.facing - other.facing).abs() + HEIGHT * (self.height - other.height).abs()
    }
}

/// Describes the regions of a surface, given the nodes that stand for each; `up` is a unit vector or zero.
pub(super) fn descriptors(
    graph: &SurfaceGraph,
    regions: &[u32],
    samples: &[Vec<u32>],
    up: Vec3,
) -> Vec<Descriptor> {
    let mut descriptors = of_nodes(graph, regions, samples.len(), up);
    let landmarks = landmarks(graph);
    descriptors
        .par_iter_mut()
        .zip(samples)
        .for_each(|(own, samples)| {
            let behind = samples.iter().map(|&node| behind(graph, node, &landmarks));
            own.place.behind = behind.sum::<f32>() / samples.len() as f32;
            own.room = RoomPart::ALL.map(|part| own.like_part(part));
        });
    add_borders(&mut descriptors, graph, regions);
    descriptors
}

/// Adds what the borders of the regions say.
fn add_borders(descriptors: &mut [Descriptor], graph: &SurfaceGraph, regions: &[u32]) {
    let mut edges = vec![0.0_f32; descriptors.len()];
    for (node, &region) in (0..).zip(regions) {
        for (other, cost) in graph.edges(node) {
            let other = regions[other as usize];
            if other != region {
                let adjoining = descriptors[other as usize].place;
                let own = &mut descriptors[region as usize];
                own.border += cost;
                own.around.facing += adjoining.facing;
                own.around.height += adjoining.height;
                own.around.behind += adjoining.behind;
                edges[region as usize] += 1.0;
            }
        }
    }
    for (own, edges) in descriptors.iter_mut().zip(edges) {
        let share = edges.max(1.0).recip();
        own.border = (share * own.border).ln_1p();
        own.around.facing *= share;
        own.around.height *= share;
        own.around.behind *= share;
    }
}

/// What the nodes of the regions themselves say.
fn of_nodes(graph: &SurfaceGraph, regions: &[u32], count: usize, up: Vec3) -> Vec<Descriptor> {
    let mut heights: Vec<f32> = graph.nodes().iter().map(|node| node.position.dot(up)).collect();
    heights.sort_unstable_by(f32::total_cmp);
    // The highest and lowest may be mistakes.
    let margin = heights.len() / 50;
    let (bottom, top) = match heights[..] {
        [] => (0.0, 0.0),
        _ => (heights[margin], heights[heights.len() - 1 - margin]),
    };
    #[derive(Clone, Copy, Default)]
    struct Sum {
        own: Descriptor,
        position: Vec3,
        normal: Vec3,
        with_normal: f32,
    }
    let mut sums = vec![Sum::default(); count];
    for (node, &region) in graph.nodes().iter().zip(regions) {
        let sum = &mut sums[region as usize];
        sum.position += node.position;
        sum.own.nodes += 1.0;
        sum.own.pixels += node.pixels;
        sum.own.color += cielab(node.color);
        sum.own.place.height += (node.position.dot(up) - bottom) / (top - bottom).max(f32::MIN_POSITIVE);
        if node.normal != Vec3::ZERO {
            sum.normal += node.normal;
            sum.own.place.facing += node.normal.dot(up).abs();
            sum.with_normal += 1.0;
        }
    }
    for (node, &region) in graph.nodes().iter().zip(regions) {
        let sum = &mut sums[region as usize];
        let from_middle = node.position - sum.position / sum.own.nodes;
        let upwards = from_middle.dot(up).powi(2);
        sum.own.tall += upwards;
        sum.own.wide += (from_middle.length_squared() - upwards).max(0.0);
    }
    let describe = |sum: Sum| {
        let Descriptor { nodes, place, .. } = sum.own;
        let with_normal = sum.with_normal.max(1.0);
        let extent = |squares: f32| ((squares / nodes).sqrt() + SHORTEST).ln();
        Descriptor {
            color: sum.own.color / nodes * Vec3::new(LIGHTNESS_SHARE, 1.0, 1.0),
            place: Place {
                facing: place.facing / with_normal,
                height: place.height / nodes,
                ..place
            },
            flatness: sum.normal.length() / with_normal,
            tall: extent(sum.own.tall),
            wide: extent(sum.own.wide),
            nodes: nodes.ln(),
            pixels: sum.own.pixels.ln(),
            ..sum.own
        }
    };
    sums.into_iter().map(describe).collect()
}

/// The places of nodes that stand for the scene, evenly over the pixels that show it.
fn landmarks(graph: &SurfaceGraph) -> Vec<Vec3> {
    let pixels: f64 = graph.nodes().iter().map(|node| f64::from(node.pixels)).sum();
    let step = pixels / LANDMARKS as f64;
    let (mut passed, mut places) = (0.0, Vec::new());
    for node in graph.nodes() {
        passed += f64::from(node.pixels);
        while passed > (places.len() as f64 + 0.5) * step {
            places.push(node.position);
        }
    }
    places
}

/// The share of the landmarks that lie behind a node.
fn behind(graph: &SurfaceGraph, node: u32, landmarks: &[Vec3]) -> f32 {
    let node = &graph.nodes()[node as usize];
    let own = node.normal.dot(node.position) - FAR_BEHIND;
    let behind = landmarks.iter().filter(|place| node.normal.dot(**place) < own);
    behind.count() as f32 / landmarks.len().max(1) as f32
}

/// CIELAB under D65 of an sRGB colour with channels in 0..=1.
fn cielab(color: Vec3) -> Vec3 {
    let linear = |value: f32| match value {
        value if value <= 0.04045 => value / 12.92,
        value => ((value + 0.055) / 1.055).powf(2.4),
    };
    let [r, g, b] = color.to_array().map(linear);
    let x = (0.412_456_4 * r + 0.357_576_1 * g + 0.180_437_5 * b) / 0.950_47;
    let y = 0.212_672_9 * r + 0.715_152_2 * g + 0.072_175 * b;
    let z = (0.019_333_9 * r + 0.119_192 * g + 0.950_304_1 * b) / 1.088_83;
    let [x, y, z] = [x, y, z].map(|value| match value {
        value if value > 0.008_856 => value.cbrt(),
        value => 7.787_037 * value + 16.0 / 116.0,
    });
    Vec3::new(116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::semantics::Node;
    use crate::semantics::testing::node;

    #[test]
    fn regions_are_described_by_themselves_and_by_what_adjoins_them() {
        // A floor of 2 m x 2 m, a wall of 2 m x 1 m along one of its sides, and a board half a metre above its middle; z is
        // up.
        let floor = (0..1600).map(|k| node(0.05 * Vec3::new((k / 40) as f32, (k % 40) as f32, 0.0)));
        let wall = (0..800).map(|k| Node {
            normal: Vec3::X,
            ..node(0.05 * Vec3::new(-0.5, (k % 40) as f32, 0.5 + (k / 40) as f32))
        });
        let board = (0..100).map(|k| {
            node(Vec3::new(0.75, 0.75, 0.5) + 0.05 * Vec3::new((k / 10) as f32, (k % 10) as f32, 0.0))
        });
        let graph = SurfaceGraph::new(floor.chain(wall).chain(board).collect(), 5);
        let regions: Vec<u32> = (0..2500)
            .map(|k| u32::from(k >= 1600) + u32::from(k >= 2400))
            .collect();
        let samples = [vec![800], vec![2000], vec![2450]];
        let [floor, wall, board] = descriptors(&graph, &regions, &samples, Vec3::Z)[..] else {
            panic!("three regions");
        };
        assert!(floor.place.facing > 0.95 && wall.place.facing < 0.05);
        assert!(wall.place.height > board.place.height && board.place.height > floor.place.height);
        assert!(wall.tall > floor.tall + 2.0 && floor.wide > board.wide + 1.0);
        assert_eq!([floor.place.behind, wall.place.behind], [0.0; 2]);
        assert!(board.place.behind > 0.5, "{}", board.place.behind);
        // Only the floor adjoins the wall; the board adjoins what is nearest.
        assert!((wall.around.facing - floor.place.facing).abs() < 1e-5);
        assert!((board.around.height - floor.place.height).abs() < 1e-5);
        assert!(floor.around.behind > 0.0);
        // The wall is a wall, the floor a floor, and the board, which has the floor behind it, neither.
        let like = |region: Descriptor| RoomPart::ALL.map(|part| region.like_part(part));
        assert!(
            like(floor)[0] > 0.9 && like(floor)[1..] == [0.0; 2],
            "{:?}",
            like(floor)
        );
        assert!(
            like(wall)[2] > 0.9 && like(wall)[..2] == [0.0; 2],
            "{:?}",
            like(wall)
        );
        assert_eq!(like(board), [0.0; 3]);
        assert_eq!(floor.like_room([false, true, true]), 0.0);
        assert_eq!(floor.unlike(&floor), 0.0);
        assert!(floor.unlike(&board) < floor.unlike(&wall));
    }

    #[test]
    fn white_and_red_in_cielab() {
        let white = cielab(Vec3::ONE);
        assert!(white.distance(Vec3::new(100.0, 0.0, 0.0)) < 0.1, "{white}");
        let red = cielab(Vec3::X);
        assert!(red.distance(Vec3::new(53.2, 80.1, 67.2)) < 0.2, "{red}");
    }
}
