//! Search for the nearest node of a surface.

use glam::{IVec3, Vec3};
use rustc_hash::FxHashMap;

use super::voxels::SHELL_CELL;
use super::{Node, Surface, cube};

/// Side of a cell, in voxels.
const CELL: f32 = 2.0;
/// Largest distance of a shell's node from where a ray meets the shell, in cells of the shell.
const SHELL_REACH: f32 = 6.0;

/// The nodes of a surface by their position.
pub struct NearestNodes<'a> {
    nodes: &'a [Node],
    surface: NodeCells,
    shell: Option<Shell>,
}

/// The shell, which rays that meet nothing show.
struct Shell {
    cells: NodeCells,
    /// Distance from a camera, in metres.
    radius: f32,
}

/// Nodes by cells of one size.
pub(crate) struct NodeCells {
    side: f32,
    /// Those of each cell, as a range of `order`.
    ranges: FxHashMap<IVec3, (u32, u32)>,
    order: Vec<u32>,
}

impl<'a> NearestNodes<'a> {
    /// All nodes of a surface.
    pub fn new(surface: &'a Surface) -> Self {
        let nodes = surface.graph.nodes();
        let (far, near): (Vec<u32>, Vec<u32>) =
            (0..nodes.len() as u32).partition(|&node| surface.is_on_shell(&nodes[node as usize]));
        let shell = far.first().map(|&node| nodes[node as usize].voxel);
        Self {
            nodes,
            surface: NodeCells::new(nodes, near, CELL * surface.voxel),
            shell: shell.map(|voxel| Shell {
                cells: NodeCells::new(nodes, far, CELL * voxel),
                radius: voxel / SHELL_CELL,
            }),
        }
    }

    /// The node of the surface that is nearest to a point of the world, at most `reach` metres away.
    pub fn nearest(&self, point: Vec3, reach: f32) -> Option<u32> {
        self.surface.nearest(self.nodes, point, reach)
    }

    /// The node that is shown by a ray from a camera at this place that meets nothing; `direction` is of unit length.
    pub fn beyond(&self, camera: Vec3, direction: Vec3) -> Option<u32> {
        let shell = self.shell.as_ref()?;
        let reach = SHELL_REACH * SHELL_CELL * shell.radius;
        shell
            .cells
            .nearest(self.nodes, camera + shell.radius * direction, reach)
    }
}

impl NodeCells {
    /// The nodes with the indices `order`, by cells of this side in metres.
    pub(crate) fn new(nodes: &[Node], mut order: Vec<u32>, side: f32) -> Self {
        let cell = |&node: &u32| cell_of(nodes[node as usize].position, side);
        order.sort_by_cached_key(|node| (cell(node).to_array(), *node));
        let mut ranges: FxHashMap<IVec3, (u32, u32)> = FxHashMap::default();
        for (place, node) in (0..).zip(&order) {
            ranges.entry(cell(node)).or_insert((place, place)).1 = place + 1;
        }
        Self { side, ranges, order }
    }

    /// The nearest node within reach, in metres; of equally near ones the first.
    pub(crate) fn nearest(&self, nodes: &[Node], point: Vec3, reach: f32) -> Option<u32> {
        let home = cell_of(point, self.side);
        let gap = |&node: &u32| (nodes[node as usize].position.distance(point), node);
        let nearer = |best: Option<(f32, u32)>, some: &[u32]| {
            let within = some.iter().map(gap).filter(|(gap, _)| *gap <= reach);
            within
                .chain(best)
                .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
        };
        let mut best = None;
        // What lies in ring r + 1 and beyond is at least r sides away.
        for ring in 0..=(reach / self.side) as i32 + 1 {
            // To look for cells in vain takes longer than to look at all nodes once there are fewer of them.
            if (2 * ring + 1).pow(3) as usize > self.ranges.len() {
                best = nearer(best, &self.order);
                break;
            }
            for offset in cube(ring).filter(|offset| offset.abs().max_element() == ring) {
                if let Some(&(start, end)) = self.ranges.get(&(home + offset)) {
                    best = nearer(best, &self.order[start as usize..end as usize]);
                }
            }
            if best.is_some_and(|(gap, _)| gap <= ring as f32 * self.side) {
                break;
            }
        }
        best.map(|(_, node)| node)
    }
}

fn cell_of(position: Vec3, side: f32) -> IVec3 {
    (position / side).floor().as_ivec3()
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng, rngs::SmallRng};

    use super::*;
    use crate::semantics::testing::{loose, node};

    #[test]
    fn the_nearest_node_is_that_of_a_search_through_all() {
        let mut rng = SmallRng::seed_from_u64(3);
        let mut point = |side: f32| Vec3::from_array(std::array::from_fn(|_| rng.random_range(-side..side)));
        let nodes: Vec<Node> = (0..300).map(|_| node(point(1.0))).collect();
        let surface = loose(nodes.clone(), 0.1);
        let nearest = NearestNodes::new(&surface);
        let gap = |node: u32, place: Vec3| nodes[node as usize].position.distance(place);
        let by_hand = |place: Vec3| {
            let by_distance = |a: &u32, b: &u32| gap(*a, place).total_cmp(&gap(*b, place));
            (0..300).min_by(by_distance).unwrap()
        };
        let mut found = 0;
        for _ in 0..500 {
            let (place, reach) = (point(1.5), 0.35);
            let expected = Some(by_hand(place)).filter(|&node| gap(node, place) <= reach);
            assert_eq!(nearest.nearest(place, reach), expected);
            found += usize::from(expected.is_some());
        }
        assert!((100..450).contains(&found), "{found}");
        // A search from far away ends, too.
        let far = Vec3::new(1e4, 0.0, 0.0);
        assert_eq!(nearest.nearest(far, 1e6), Some(by_hand(far)));
    }

    #[test]
    fn rays_that_meet_nothing_show_the_shell_in_their_direction() {
        let far = 30.0;
        let sky = |direction: Vec3| Node {
            voxel: SHELL_CELL * far,
            ..node(far * direction)
        };
        let surface = loose(vec![node(Vec3::Z), sky(Vec3::Z), sky(Vec3::X)], 0.1);
        let nearest = NearestNodes::new(&surface);
        let camera = Vec3::new(0.5, 0.2, -0.5);
        let aside = Vec3::new(1.0, 0.0, 0.1).normalize();
        for (direction, shown) in [(Vec3::Z, Some(1)), (aside, Some(2)), (Vec3::NEG_Y, None)] {
            assert_eq!(nearest.beyond(camera, direction), shown);
        }
        let near_the_shell = nearest.nearest(Vec3::new(0.0, 0.0, 29.9), 0.5);
        assert_eq!(near_the_shell, None, "the shell is no surface");
    }
}
