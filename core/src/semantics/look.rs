//! What the regions of a surface look like, and how unlike each other they are.

mod descriptor;

use glam::Vec3;
use rayon::prelude::*;

use self::descriptor::{Descriptor, descriptors};
use super::graph::SurfaceGraph;
use super::kinds::Kind;
use super::posterior::stretch;
use super::segments::segments;
use crate::features::{COMPONENTS, dot};

/// Two regions become one where an edge costs at most this over their number of nodes more than the edges inside.
const SCALE: f32 = 30.0;
/// Fewest nodes of a region.
const FEWEST_NODES: u32 = 10;
/// Largest gap by what regions look like.
const MOST_UNLIKE: f32 = 6.5;
/// Gap between regions in which a pretrained network sees nothing in common, and the largest gap with one.
const FEATURES: f32 = 3.0;
const MOST_UNLIKE_SEEN: f32 = 8.0;
/// A label tells less of other regions, by this times the logarithm of how much smaller its own is than the largest:
/// most that is far from all labels belongs to large things.
const SMALLNESS: f32 = 0.25;
/// A thing ends: a label of one tells less of a larger region, by this times the logarithm of how many times more nodes it
/// has.
const LARGER: f32 = 0.5;
/// Nor does it look like the room around it, nor a part of the room like another one: a label of a thing, or of such a part,
/// tells so much less of what looks like a part of the room that has another class.
const ROOM: f32 = 2.0;
const OTHER_PART: f32 = 4.0;
/// So many other regions are kept of each that look most like it.
const ALIKE: usize = 64;
/// Most nodes of a region that stand for all of it.
const MOST_SAMPLES: usize = 16;
/// Cosines between the vertical and the normals that it is averaged from, one after the other, each so many times.
const LEVEL: [f32; 3] = [0.7, 0.85, 0.95];
const AVERAGINGS: usize = 5;

/// The regions of a surface: parts without borders inside, and what they look like.
#[derive(Clone, Debug, Default)]
pub struct Look {
    /// The region of each node.
    regions: Vec<u32>,
    descriptors: Vec<Descriptor>,
    /// Logarithm of the pixels of the region that most show.
    most_pixels: f32,
    /// Nodes that stand for each region, evenly chosen, at least one.
    pub(super) samples: Vec<Vec<u32>>,
    /// For each region those that look most like it, in no order, with how unlike they are, by all but a pretrained network.
    pub(super) alike: Vec<Vec<(u32, f32)>>,
    /// Upwards, in world coordinates, of unit length; zero where nothing tells.
    pub vertical: Vec3,
    /// Unit vectors `[regions, COMPONENTS]` of what a pretrained network sees there, where there is one; zero where it has
    /// seen none.
    pub(super) features: Option<Vec<f32>>,
}

impl Look {
    /// Divides a surface into regions (Felzenszwalb and Huttenlocher 2004, by the costs of the graph's edges) and
    /// describes them. `up` is about upwards, in world coordinates, of any length; the vertical is the mean normal of what
    /// is about level.
    pub fn new(graph: &SurfaceGraph, up: Vec3) -> Self {
        let nodes = graph.len() as u32;
        let edges = (0..nodes).flat_map(|from| graph.edges(from).map(move |(to, cost)| (cost, from, to)));
        let edges = edges.filter(|&(_, from, to)| from < to).collect();
        let regions = segments(graph.len(), edges, SCALE, FEWEST_NODES);
        let vertical = vertical(graph, up);
        let samples = samples(&regions);
        let descriptors = descriptors(graph, &regions, &samples, vertical);
        let pixels = descriptors.iter().map(|region| region.pixels);
        let mut look = Self {
            most_pixels: pixels.fold(f32::NEG_INFINITY, f32::max),
            descriptors,
            samples,
            alike: Vec::new(),
            regions,
            vertical,
            features: None,
        };
        let count = look.len() as u32;
        look.alike = (0..count)
            .into_par_iter()
            .map(|region| look.most_alike(region))
            .collect();
        look
    }

    /// The regions that look most like a region, with how unlike they are.
    fn most_alike(&self, region: u32) -> Vec<(u32, f32)> {
        let others = (0..self.len() as u32).filter(|&other| other != region);
        let mut others: Vec<_> = others.map(|other| (other, self.unlike(region, other))).collect();
        if others.len() > ALIKE {
            let by_gap = |a: &(u32, f32), b: &(u32, f32)| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0));
            others.select_nth_unstable_by(ALIKE, by_gap);
            others.truncate(ALIKE);
        }
        others
    }

    /// The same without what a pretrained network sees; `None` where there is none.
    pub(super) fn without_features(&self) -> Option<Self> {
        self.has_features().then(|| Self {
            features: None,
            ..self.clone()
        })
    }

    /// Whether what a pretrained network sees in the regions is known.
    pub(crate) fn has_features(&self) -> bool {
        self.features.is_some()
    }

    /// Number of regions.
    pub(crate) fn len(&self) -> usize {
        self.descriptors.len()
    }

    /// The region of a node.
    pub fn region(&self, node: usize) -> u32 {
        self.regions[node]
    }

    /// The factor on distances to a label of this kind at one node, at another.
    pub(crate) fn stretch(&self, node: u32, labelled: u32, kind: Kind) -> f32 {
        let [region, labelled] = [node, labelled].map(|node| self.region(node as usize));
        stretch(self.gap(region, labelled, kind))
    }

    /// How unlike a region is to one with a label of this kind, at least 0; a class is exp(-gap) times as likely there.
    pub fn gap(&self, region: u32, labelled: u32, kind: Kind) -> f32 {
        if region == labelled {
            return 0.0;
        }
        self.unlike(region, labelled) + self.reserve(region, labelled, kind)
    }

    /// How unlike each other two regions look.
    fn unlike(&self, one: u32, other: u32) -> f32 {
        let [a, b] = [one, other].map(|region| &self.descriptors[region as usize]);
        let unlike = a.unlike(b);
        match &self.features {
            None => unlike.min(MOST_UNLIKE),
            Some(features) => {
                let of = |region: u32| &features[region as usize * COMPONENTS..][..COMPONENTS];
                let seen = FEATURES * (1.0 - dot(of(one), of(other)));
                (unlike + seen).min(MOST_UNLIKE_SEEN)
            }
        }
    }

    /// How much less a label of this kind in one region tells of another by the sizes of both, and by where the other is.
    pub(super) fn reserve(&self, region: u32, labelled: u32, kind: Kind) -> f32 {
        let [a, b] = [region, labelled].map(|region| &self.descriptors[region as usize]);
        let larger = if kind.ends { a.nodes - b.nodes } else { 0.0 };
        let room = if kind.thing { ROOM } else { OTHER_PART };
        SMALLNESS * (self.most_pixels - b.pixels)
            + LARGER * larger.max(0.0)
            + room * a.like_room(kind.other_than)
    }
}

/// The nodes of each region, of a large one so many at even steps.
fn samples(regions: &[u32]) -> Vec<Vec<u32>> {
    let count = regions.iter().max().map_or(0, |&last| last as usize + 1);
    let mut nodes = vec![Vec::new(); count];
    for (node, &region) in (0..).zip(regions) {
        nodes[region as usize].push(node);
    }
    for nodes in &mut nodes {
        let step = nodes.len().div_ceil(MOST_SAMPLES);
        *nodes = nodes.iter().copied().step_by(step).collect();
    }
    nodes
}

/// The direction about upwards that most of what is about level faces: cameras that are held without rolling look up or
/// down.
fn vertical(graph: &SurfaceGraph, up: Vec3) -> Vec3 {
    let mut up = up.normalize_or_zero();
    for level in LEVEL {
        for _ in 0..AVERAGINGS {
            let normals = graph.nodes().iter().map(|node| {
                let along = node.normal.dot(up);
                let sign = if along.abs() > level { along.signum() } else { 0.0 };
                node.pixels * sign * node.normal
            });
            up = normals.sum::<Vec3>().try_normalize().unwrap_or(up);
        }
    }
    up
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::RoomPart;
    use crate::semantics::Node;
    use crate::semantics::testing::node;

    #[test]
    fn regions_are_alike_by_colour_facing_and_height_and_small_ones_tell_less_and_things_least() {
        // A floor, a wall some way off, and a stain in the middle of the floor; z is up.
        let floor = (0..400).map(|k| node(0.05 * Vec3::new((k / 20) as f32, (k % 20) as f32, 0.0)));
        let wall = (0..400).map(|k| Node {
            normal: Vec3::X,
            ..node(0.05 * Vec3::new(-20.0, (k % 20) as f32, 1.0 + (k / 20) as f32))
        });
        let mut nodes: Vec<Node> = floor.chain(wall).collect();
        for index in [188, 189, 190, 191, 208, 209, 210, 211, 228, 229, 230, 231] {
            nodes[index].color = Vec3::new(0.5, 0.1, 0.1);
        }
        let graph = SurfaceGraph::new(nodes, 5);
        // A camera that looks down by 40 degrees.
        let look = Look::new(&graph, Vec3::new(0.64, 0.0, 0.77));
        let [floor, other, stain, wall] = [0, 399, 209, 600].map(|node| look.region(node));
        assert_eq!(floor, other);
        assert_eq!(look.len(), 3);
        let stuff = Kind::default();
        let thing = Kind {
            thing: true,
            ends: true,
            ..stuff
        };
        assert_eq!(look.gap(floor, floor, thing), 0.0);
        assert!(look.gap(floor, wall, stuff) > 1.0);
        assert!(look.gap(floor, stain, stuff) > look.gap(stain, floor, stuff));
        assert!(look.gap(floor, stain, thing) > look.gap(floor, stain, stuff));
        assert_eq!(look.gap(stain, floor, thing), look.gap(stain, floor, stuff));
        // Where the floor has a class, a label of a thing tells less of it, and of the wall just as much.
        let other_than = RoomPart::ALL.map(|part| part == RoomPart::Floor);
        let other = Kind { other_than, ..thing };
        assert!(look.gap(floor, stain, other) > look.gap(floor, stain, thing) + 0.9 * ROOM);
        assert_eq!(look.gap(wall, stain, other), look.gap(wall, stain, thing));
        // So does one of the wall.
        let part = Kind { other_than, ..stuff };
        assert!(look.gap(floor, wall, part) > look.gap(floor, wall, stuff) + 0.9 * OTHER_PART);
    }

    #[test]
    fn what_a_pretrained_network_sees_joins_the_rest_of_the_look() {
        let row = (0..300).map(|k| Node {
            color: [Vec3::splat(0.3), Vec3::new(0.7, 0.2, 0.2)][(k / 100) % 2],
            ..node(Vec3::new(0.05 * (k / 10) as f32, 0.05 * (k % 10) as f32, 0.0))
        });
        let graph = SurfaceGraph::new(row.collect(), 5);
        let mut look = Look::new(&graph, Vec3::Y);
        assert_eq!(look.len(), 3);
        let stuff = Kind::default();
        let before = [look.gap(2, 0, stuff), look.gap(1, 0, stuff)];
        let unit = |axis: usize| (0..COMPONENTS).map(move |own| if own == axis { 1.0 } else { 0.0 });
        // The network sees the same in the red part as in the first gray one, and something else in the last.
        look.features = Some(unit(0).chain(unit(0)).chain(unit(1)).collect());
        assert_eq!(look.gap(1, 0, stuff), before[1]);
        assert!((look.gap(2, 0, stuff) - before[0] - FEATURES).abs() < 1e-5);
    }
}
