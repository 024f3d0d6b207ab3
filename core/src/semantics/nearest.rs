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
        let mut best: Option<(f32, u32)> = None;
        // What lies in ring r + 1 and beyond is at least r sides away.
        for ring in 0..=(reach / self.side) as i32 + 1 {
            for offset in cube(ring).filter(|offset| offset.abs().max_element() == ring) {
                let Some(&(start, end)) = self.ranges.get(&(home + offset)) else {
                    continue;
                };
                for &node in &self.order[start as usize..end as usize] {
                    let gap = nodes[node as usize].position.distance(point);
                    if gap <= reach && best.is_none_or(|found| (gap, node) < found) {
                        best = Some((gap, node));
                    }
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
        let mut found = 0;
        for _ in 0..500 {
            let (place, reach) = (point(1.5), 0.35);
            let by_distance = |&a: &u32, &b: &u32| {
                let gap = |node: u32| nodes[node as usize].position.distance(place);
                gap(a).total_cmp(&gap(b))
            };
            let all = (0..300).min_by(by_distance);
            let expected = all.filter(|&node| nodes[node as usize].position.distance(place) <= reach);
            assert_eq!(nearest.nearest(place, reach), expected);
            found += usize::from(expected.is_some());
        }
        assert!((100..450).contains(&found), "{found}");
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
